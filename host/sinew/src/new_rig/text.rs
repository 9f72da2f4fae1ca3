//! The rig file, with comments that teach.

use std::fmt::Write;

use sinew_sim::unit;

use super::Motion;
use super::answers::Answers;
use super::columns::{Columns, is_counts, is_force, stem};
use sinew_ident::recording::Recording;

/// Numbers that only a recording can guess: what would make forces, springs and dampers matter
/// alike.
struct Guess {
    stiffness: f64,
    damping: f64,
}

/// The last argument: whether a spring pulls it back, and what the recording says of it where it
/// was asked.
pub(super) fn write(
    recording: &Recording,
    columns: &Columns,
    answers: &Answers,
    (spring, found): (bool, Option<&str>),
) -> String {
    let file = recording.name();
    let mut text = String::new();
    // Writing to a String cannot fail, here and below.
    let _ = write!(
        text,
        "# What the owner of this device believes about it; written by `sinew new` from {file}.\n\
         # A bare number is known and stays. {{ value = ..., min = ..., max = ... }} is believed, and `sinew fit`\n\
         # finds it from recordings (min and max may be left out). All units are SI.\n\
         format = \"sinew-rig/1\"\n\
         name = {}\n",
        quoted(&answers.name)
    );
    for index in 0..columns.positions.len() {
        push_body(&mut text, columns, answers, index);
        if let Some(found) = found {
            let _ = write!(text, "\n# {found}");
            text.push_str(if spring { "" } else { "\n" });
        }
        push_spring_and_damper(&mut text, recording, columns, answers, (index, spring));
    }
    let force = match answers.motion {
        Motion::Slide => "N",
        Motion::Hinge => "N m",
    };
    for (index, input) in columns.inputs.iter().enumerate() {
        push_actuator(&mut text, recording, columns, (index, input), force);
    }
    for index in 0..columns.positions.len() {
        push_sensors(&mut text, columns, answers, index);
    }
    push_rest(&mut text, columns);
    text
}

fn push_body(text: &mut String, columns: &Columns, answers: &Answers, index: usize) {
    let (motion, mass) = match answers.motion {
        Motion::Slide => ("slide", "kg"),
        Motion::Hinge => ("hinge", "kg m^2"),
    };
    let force_input = columns.inputs.iter().all(|input| is_force(input));
    let body = body_name(columns, index);
    let inertia = number(answers.inertia);
    let source = if answers.inertia_known {
        "as you said"
    } else {
        "a guess"
    };
    let _ = write!(
        text,
        "\n[[body]]                      # one coordinate with inertia\nname = {}\nmotion = \"{motion}\"\n",
        quoted(&body)
    );
    if force_input {
        let (min, max) = (
            number(answers.inertia * 1e-3),
            number(answers.inertia * 1e3),
        );
        let _ = writeln!(
            text,
            "inertia = {{ value = {inertia}, min = {min}, max = {max} }}   # {mass}, {source}"
        );
    } else {
        let _ = writeln!(
            text,
            "# {mass}, {source}. Held: a recording shows gain / inertia only. If you know the gain and not the\n\
             # inertia, make this the {{ value = ... }} and the gain a bare number.\n\
             inertia = {inertia}"
        );
    }
}

/// `spring`: a spring pulls it back.
fn push_spring_and_damper(
    text: &mut String,
    recording: &Recording,
    columns: &Columns,
    answers: &Answers,
    (index, spring): (usize, bool),
) {
    let push = match answers.motion {
        Motion::Slide => "N/m",
        Motion::Hinge => "N m/rad",
    };
    let body = body_name(columns, index);
    let guess = guess(
        recording,
        &columns.positions[index],
        columns.inputs.get(index).unwrap_or(&columns.inputs[0]),
        answers,
    );
    let neighbour = columns.neighbour(index);
    let from = neighbour.map_or("ground".into(), |other| body_name(columns, other));
    if neighbour.is_some() {
        text.push_str(
            "\n# A guess: no input drives this body, so that spring and damper join it to the one before.\n",
        );
    }
    if spring || neighbour.is_some() {
        let _ = write!(
            text,
            "\n[[spring]]                    # force = -stiffness (q - rest)\nname = {}\nfrom = {}\nto = {}\n\
             stiffness = {{ value = {}, min = 0.0 }}   # {push}, a guess\n\
             # rest = {{ value = 0.0 }}    # where it pulls to, if that is not zero\n",
            quoted(&format!("{body}_spring")),
            quoted(&from),
            quoted(&body),
            number(guess.stiffness)
        );
    }
    let per_speed = if answers.motion == Motion::Slide {
        "N s/m"
    } else {
        "N m s/rad"
    };
    let _ = write!(
        text,
        "\n[[damper]]                    # force = -damping v\nname = {}\nfrom = {}\nto = {}\n\
         damping = {{ value = {}, min = 0.0 }}   # {per_speed}, a guess\n",
        quoted(&format!("{body}_damper")),
        quoted(&from),
        quoted(&body),
        number(guess.damping)
    );
}

fn push_actuator(
    text: &mut String,
    recording: &Recording,
    columns: &Columns,
    (index, input): (usize, &String),
    force: &str,
) {
    let body = body_name(columns, index.min(columns.positions.len() - 1));
    let symbol = unit::of_column(input);
    let factor = unit::factor(symbol).unwrap_or(1.0);
    let largest = recording
        .column(input)
        .unwrap_or(&[])
        .iter()
        .filter(|u| u.is_finite())
        .fold(0.0_f64, |a, u| a.max(u.abs()));
    let _ = write!(
        text,
        "\n[[actuator]]                  # force on the body = gain * input\nname = {}\ndrives = {}\n",
        quoted(&format!("{}_drive", stem(input))),
        quoted(&body)
    );
    let _ = writeln!(
        text,
        "input = {}                # column of the recording",
        quoted(input)
    );
    push_unit(text, factor, symbol);
    if is_force(input) {
        let _ = writeln!(
            text,
            "gain = 1.0                    # the input is a force or torque already"
        );
    } else {
        let _ = writeln!(
            text,
            "gain = {{ value = 1.0 }}        # {force} per unit of the input, a guess"
        );
    }
    if largest > 0.0 {
        let bound = number(round_up(largest * factor));
        let _ = writeln!(
            text,
            "limit = [-{bound}, {bound}]   # what a controller may ask for: no more than was recorded"
        );
    }
    let _ = writeln!(text, "# rate_limit = 100.0          # and per second");
}

fn push_sensors(text: &mut String, columns: &Columns, answers: &Answers, index: usize) {
    let position = &columns.positions[index];
    let body = body_name(columns, index);
    push_sensor(
        text,
        &format!("{body}_encoder"),
        &format!("{body}.position"),
        position,
    );
    if is_counts(position) {
        text.push_str(match answers.motion {
            Motion::Hinge => {
                "gain = 651.8986469            # counts per rad, a guess: 4096 counts a turn / 6.283185307\n"
            }
            Motion::Slide => {
                "gain = 1e6                    # counts per m, a guess: a scale of 1 um a count\n"
            }
        });
    }
    if let Some(velocity) = &columns.velocities[index] {
        push_sensor(
            text,
            &format!("{body}_tachometer"),
            &format!("{body}.velocity"),
            velocity,
        );
    }
}

fn push_sensor(text: &mut String, name: &str, reads: &str, column: &str) {
    let symbol = unit::of_column(column);
    let _ = write!(
        text,
        "\n[[sensor]]                    # signal = gain * reading + offset\nname = {}\nreads = {}\nsignal = {}\n",
        quoted(name),
        quoted(reads),
        quoted(column)
    );
    push_unit(text, unit::factor(symbol).unwrap_or(1.0), symbol);
}

/// The `unit` key, where the column is not in SI.
fn push_unit(text: &mut String, factor: f64, symbol: &str) {
    if factor != 1.0 {
        let _ = writeln!(
            text,
            "unit = {}                   # the column is converted to SI",
            quoted(symbol)
        );
    }
}

/// Dry friction to be switched on, and what the controller is to track.
fn push_rest(text: &mut String, columns: &Columns) {
    let _ = write!(
        text,
        "\n# Physics beyond the textbook, if you know of some. `sinew diagnose` finds out what is missing.\n\
         # [[effect]]\n# kind = \"coulomb_friction\"\n# component = {}\n# level = {{ value = 0.1, min = 0.0 }}\n",
        quoted(&body_name(columns, 0))
    );
    if columns.references.iter().all(Option::is_some) {
        let outputs: Vec<String> = (0..columns.positions.len())
            .map(|index| quoted(&format!("{}_encoder", body_name(columns, index))))
            .collect();
        let references: Vec<String> = columns
            .references
            .iter()
            .flatten()
            .map(|name| quoted(name))
            .collect();
        let _ = write!(
            text,
            "\n[control]                     # what the controller is to do; every key is optional\n\
             outputs = [{}]\nreference = [{}]   # columns that hold what the outputs are to follow\n",
            outputs.join(", "),
            references.join(", ")
        );
    }
}

/// The body of a position: named after its column, `body` where that says nothing (`q_m`, `x_mm`).
fn body_name(columns: &Columns, index: usize) -> String {
    let stem = stem(&columns.positions[index]);
    match (stem.chars().count() > 1, columns.positions.len()) {
        (true, _) => stem.to_owned(),
        (false, 1) => "body".to_owned(),
        (false, _) => format!("body{}", index + 1),
    }
}

/// Stiffness and damping that would each balance the recorded input over the recorded motion.
fn guess(recording: &Recording, position: &str, input: &str, answers: &Answers) -> Guess {
    let spread = |values: &[f64]| {
        let valid: Vec<f64> = values
            .iter()
            .copied()
            .filter(|value| value.is_finite())
            .collect();
        let mean = valid.iter().sum::<f64>() / valid.len().max(1) as f64;
        (valid
            .iter()
            .map(|value| (value - mean).powi(2))
            .sum::<f64>()
            / valid.len().max(1) as f64)
            .sqrt()
    };
    let si = |name: &str| {
        let factor = unit::factor(unit::of_column(name)).unwrap_or(1.0);
        recording
            .column(name)
            .unwrap_or(&[])
            .iter()
            .map(|value| value * factor)
            .collect::<Vec<_>>()
    };
    let (u, q) = (si(input), si(position));
    // Steps of a tenth of a second or so tell speed from noise.
    let stride = recording
        .interval()
        .map_or(1, |interval| (0.1 / interval).round().max(1.0) as usize);
    let speeds: Vec<f64> = (stride..q.len())
        .map(|row| (q[row] - q[row - stride]) / (recording.t()[row] - recording.t()[row - stride]))
        .collect();
    let or = |value: f64, fallback: f64| {
        if value.is_finite() && value > 0.0 {
            value
        } else {
            fallback
        }
    };
    Guess {
        stiffness: or(spread(&u) / spread(&q), 40.0 * answers.inertia),
        damping: or(0.3 * spread(&u) / spread(&speeds), answers.inertia),
    }
}

/// Two digits are all that a guess deserves.
fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.1e}").parse().unwrap_or(value);
    format!("{rounded:?}")
}

/// The next number with two digits.
fn round_up(value: f64) -> f64 {
    let step = 10f64.powf(value.log10().floor() - 1.0);
    (value / step - 1e-9).ceil() * step
}

/// A TOML string.
fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for character in text.chars() {
        match character {
            '"' | '\\' => quoted.extend(['\\', character]),
            control if control.is_control() => _ = write!(quoted, "\\u{:04X}", control as u32),
            other => quoted.push(other),
        }
    }
    quoted.push('"');
    quoted
}
