//! Faults that only a rig tells: it is refitted to the recording as it is and as it would be
//! without the fault, and the fault is named where that leaves far less.

use sinew_sim::Rig;
use sinew_sim::rig::Reads;
use sinew_sim::unit::Motion;

use super::finding::{Check, number};
use super::refitted::{
    BELIEVED, EXACT, FAR_LESS, GOOD, NOISE_ALONE, Refit, is_noise, is_small, noise, squares,
};
use super::timescale::is_guessed;
use super::{dead, held, late, long_units, sensor_numbers, silent, swapped, unanswered};
use crate::fit::{FitOptions, fit};
use crate::recording::{Column, Recording};

/// Rows of a recording that are refitted.
const ROWS: usize = 1200;

/// Error beside the spread of the signals above which a rig is refuted.
const POOR: f64 = 0.5;

/// Factor between the errors that a rig leaves of two recordings by the same cause.
const ALIKE: f64 = 1.5;

/// Squares of two recordings together, beside those of each alone, above which two rigs that leave
/// noise alone are of different devices.
const TOGETHER: f64 = 1.5;

/// Part by which a parameter of another device differs, where the rig leaves noise alone.
const DIFFERS: f64 = 0.03;

/// `wrong_sign`, `swapped_columns`, `dead_channel`, `input_lags`, `input_leads`, `input_not_held`,
/// `sensor_lags`, `degrees_for_radians`, `millimetres_for_metres`, `time_in_minutes`,
/// `time_in_hours`, `sensor_offset`, `sensor_drift`, `sensor_gain`, `unanswered_input`,
/// `different_devices`.
pub(super) fn detect(rig: &Rig, recordings: &[Recording]) -> Vec<Check> {
    if !is_small(rig) {
        return Vec::new();
    }
    let mut found = Vec::new();
    let mut plain: Vec<(&Recording, Refit)> = Vec::new();
    for recording in recordings {
        let Ok(part) = recording.rows(0..recording.len().min(ROWS)) else {
            continue;
        };
        let dead = dead::detect(rig, &part);
        if let Some(dead) = dead.or_else(|| silent::detect(rig, recording)) {
            found.push(dead);
            continue;
        }
        let Some(refit) = Refit::of(rig, &part) else {
            continue;
        };
        let named = if plain.iter().any(|(_, sound)| alike(sound, &refit)) {
            None
        } else {
            fault(rig, &part, &refit)
        };
        match named {
            Some(check) => found.push(check),
            None => plain.push((recording, refit)),
        }
    }
    for other in 1..plain.len() {
        found.extend(different(rig, &plain[0], &plain[other]));
    }
    found
}

/// Tells whether what a rig leaves of a recording has the cause of what it leaves of a sound one:
/// as much of it, and where that is little, by parameters as far from what the rig says.
fn alike(sound: &Refit, refit: &Refit) -> bool {
    let near = |a: f64, b: f64| a < ALIKE * b && b < ALIKE * a;
    let (errors, far) = (
        [sound.error(), refit.error()],
        [sound, refit].map(Refit::farthest),
    );
    near(errors[0], errors[1]) && (errors[0].min(errors[1]) > GOOD || near(far[0], far[1]))
}

/// The fault without which the refitted rig leaves far less of a recording.
fn fault(rig: &Rig, part: &Recording, refit: &Refit) -> Option<Check> {
    swapped::detect(rig, part, refit)
        .or_else(|| another_unit(rig, part, refit))
        .or_else(|| wrong_sign(rig, part, refit))
        .or_else(|| long_units::detect(rig, part, refit))
        .or_else(|| unanswered::detect(rig, part, refit))
        .or_else(|| sensor_numbers(rig, part, refit))
        .or_else(|| held::detect(rig, part, refit))
        .or_else(|| late::detect(rig, part, refit))
}

/// The recording with a column multiplied.
fn scaled(recording: &Recording, names: &[&str], factor: f64) -> Option<Recording> {
    let columns = recording.columns().iter().map(|column| Column {
        name: column.name.clone(),
        values: if names.contains(&column.name.as_str()) {
            column.values.iter().map(|value| value * factor).collect()
        } else {
            column.values.clone()
        },
    });
    Recording::new(recording.path(), recording.t().to_vec(), columns.collect()).ok()
}

/// Units that a column may be in without its rig saying so.
struct Unit {
    motion: Motion,
    kind: &'static str,
    words: [&'static str; 2],
    key: &'static str,
    /// One of it in SI.
    factor: f64,
}

const OTHER_UNITS: [Unit; 2] = [
    Unit {
        motion: Motion::Hinge,
        kind: "degrees_for_radians",
        words: ["degrees", "radians"],
        key: "deg",
        factor: std::f64::consts::PI / 180.0,
    },
    Unit {
        motion: Motion::Slide,
        kind: "millimetres_for_metres",
        words: ["millimetres", "metres"],
        key: "mm",
        factor: 1e-3,
    },
];

/// Sensors whose numbers fit the rig as degrees and not as radians, or as millimetres and not as
/// metres: all of their kind, or one of them.
fn another_unit(rig: &Rig, recording: &Recording, plain: &Refit) -> Option<Check> {
    if plain.error() < GOOD && plain.farthest() < BELIEVED {
        return None;
    }
    OTHER_UNITS.iter().find_map(|unit| {
        let moving = rig.sensors.iter().filter(|sensor| {
            let body = match sensor.reads {
                Reads::Position(body) | Reads::Velocity(body) => body,
                _ => return false,
            };
            rig.bodies[body].motion == unit.motion && sensor.column_factor == 1.0
        });
        let names: Vec<&str> = moving.map(|sensor| sensor.signal.as_str()).collect();
        let mut choices: Vec<Vec<&str>> = vec![names.clone()];
        if names.len() > 1 {
            choices.extend(names.iter().map(|name| vec![*name]));
        }
        let mut choices = choices.into_iter().filter(|names| !names.is_empty());
        choices.find_map(|names| in_unit(rig, recording, plain, (unit, &names)))
    })
}

/// Check of columns that fit the rig in another unit.
fn in_unit(
    rig: &Rig,
    recording: &Recording,
    plain: &Refit,
    (unit, names): (&Unit, &[&str]),
) -> Option<Check> {
    let converted = scaled(recording, names, unit.factor)?;
    let refit = Refit::below(GOOD * GOOD, rig, &converted)?;
    let explains = refit.error() < GOOD && refit.farthest() < BELIEVED;
    let nearer = plain.farthest() > 2.0 * refit.farthest() || plain.error() > 2.0 * refit.error();
    (explains && nearer).then(|| {
        let [other, own] = unit.words;
        let sentence = format!(
            "{} fits the rig as {other}, with parameters at most {} times as believed and {} % \
             missed; as {own} they are {} times that, and {} % is missed",
            names.join(" and "),
            number(refit.farthest()),
            number(100.0 * refit.error()),
            number(plain.farthest()),
            number(100.0 * plain.error())
        );
        // Of all positions in millimetres, a force in kilonewtons would show the same.
        let inputs: Vec<&str> = rig.actuators.iter().map(|it| it.input.as_str()).collect();
        let or_inputs = if unit.motion == Motion::Slide && names.len() == rig.sensors.len() {
            format!(
                "; or, if {} is a thousandth of what it says, `gain` of its actuator",
                inputs.join(" and ")
            )
        } else {
            String::new()
        };
        let remedy = format!(
            "`unit = \"{}\"` in the rig's sensor of {}{or_inputs}",
            unit.key,
            names.join(" and of ")
        );
        // Guesses may be a thousand times the truth.
        let grade = if is_guessed(rig) {
            Check::likely
        } else {
            Check::certain
        };
        grade(recording, 0, unit.kind, sentence, remedy)
    })
}

/// Numbers of a sensor, where noise alone does not make up what the rig leaves.
fn sensor_numbers(rig: &Rig, recording: &Recording, plain: &Refit) -> Option<Check> {
    let hopeless = is_noise(rig, recording, plain);
    (!hopeless).then(|| sensor_numbers::detect(rig, recording, plain))?
}

/// A sensor that counts backwards beside the rig, or all of them (an actuator that does).
fn wrong_sign(rig: &Rig, recording: &Recording, plain: &Refit) -> Option<Check> {
    if plain.error() < POOR {
        return None;
    }
    let mut names: Vec<&str> = rig.sensors.iter().map(|s| s.signal.as_str()).collect();
    names.dedup();
    let mut choices: Vec<Vec<&str>> = vec![names.clone()];
    if names.len() > 1 {
        choices.extend(names.iter().map(|name| vec![*name]));
    }
    choices.into_iter().find_map(|names| {
        let most = (GOOD * GOOD).min(FAR_LESS * plain.squares);
        let refit = Refit::below(most, rig, &scaled(recording, &names, -1.0)?)?;
        let explains = refit.error() < GOOD && refit.squares < FAR_LESS * plain.squares;
        explains.then(|| {
            let inputs: Vec<&str> = rig.actuators.iter().map(|a| a.input.as_str()).collect();
            let sentence = format!(
                "{} moves against {}: with the other sign the refitted rig misses {} % of it, as \
                 it is {} %",
                names.join(" and "),
                inputs.join(" and "),
                number(100.0 * refit.error()),
                number(100.0 * plain.error())
            );
            let sensors = rig.sensors.iter().filter(|s| names.contains(&&*s.signal));
            let sensors: Vec<&str> = sensors.map(|s| s.name.as_str()).collect();
            let remedy = format!(
                "`gain = -1.0` in sensor {} (or the other sign of the actuator's gain)",
                sensors.join(" and ")
            );
            Check::certain(recording, 0, "wrong_sign", sentence, remedy)
        })
    })
}

/// Two recordings that the rig explains alone, with parameters that exclude each other. Where it
/// leaves noise alone of each, a few per cent do; beside missing physics parameters differ by how
/// far a recording moved.
fn different(
    rig: &Rig,
    (first, one): &(&Recording, Refit),
    (second, two): &(&Recording, Refit),
) -> Option<Check> {
    if one.error().max(two.error()) > GOOD {
        return None;
    }
    let is_exact = |recording: &Recording, refit: &Refit| {
        let part = recording.rows(0..recording.len().min(ROWS));
        part.is_ok_and(|part| refit.error() < EXACT.max(NOISE_ALONE * noise(rig, &part)))
    };
    let exact = is_exact(first, one) && is_exact(second, two);
    let (least, factor, most) = if exact {
        (DIFFERS, 3.0, TOGETHER)
    } else {
        (0.1, 2.0, 1.0 / FAR_LESS)
    };
    let pairs = one.fit.parameters.iter().zip(&two.fit.parameters);
    let apart = pairs.filter_map(|(a, b)| {
        let widths = [a, b].map(|p| p.ci95.map(|[low, high]| 0.5 * (high - low)));
        let width = widths[0]? + widths[1]?;
        let distance = (a.value - b.value).abs();
        let relative = distance / a.value.abs().max(b.value.abs());
        (distance > factor * width && relative > least).then_some((a, b, distance / width))
    });
    let (a, b, _) = apart.max_by(|x, y| x.2.total_cmp(&y.2))?;
    let parts: Vec<Recording> = [first, second]
        .into_iter()
        .map(|recording| recording.rows(0..recording.len().min(ROWS)))
        .collect::<crate::error::Result<_>>()
        .ok()?;
    let together = fit(rig, &parts, &FitOptions::default(), &mut |_| {}).ok()?;
    let together = squares(&together)?;
    (together > most * one.squares.max(two.squares)).then(|| {
        let value = |value: f64| crate::report::quantity(value, &a.unit);
        let sentence = format!(
            "{} is {} here and {} in {}: the recordings are of different devices, or the device \
             was changed",
            a.name,
            value(b.value),
            value(a.value),
            first.name()
        );
        let remedy = "give recordings of one device to one run";
        Check::likely(second, 0, "different_devices", sentence, remedy)
    })
}
