//! Faults that only a rig tells: it is refitted to the recording as it is and as it would be
//! without the fault, and the fault is named where that leaves far less.

use sinew_sim::Rig;
use sinew_sim::rig::Reads;
use sinew_sim::unit::Motion;

use super::finding::{Check, counted, number};
use super::refitted::{
    BELIEVED, EXACT, FAR_LESS, GOOD, NOISE_ALONE, Refit, is_noise, is_small, noise, squares,
};
use super::timescale::is_guessed;
use super::{dead, long_units, sensor_numbers, swapped, unanswered};
use crate::fit::{FitOptions, fit};
use crate::recording::repair::Repair;
use crate::recording::{Column, Recording};

/// Rows of a recording that are refitted.
const ROWS: usize = 1200;

/// Error beside the spread of the signals above which a rig is refuted.
const POOR: f64 = 0.5;

/// Lags that are tried first, rows; then those beside the best of them.
const LAGS: [i64; 7] = [1, 2, 3, 5, 8, 12, 18];

/// Leads that are tried.
const LEADS: [i64; 4] = [-1, -2, -3, -4];

/// Squares, beside those as recorded, from which on a lag is worth a closer look.
const CLOSER: f64 = 0.5;

/// Squares of two recordings together, beside those of each alone, above which two rigs that leave
/// noise alone are of different devices.
const TOGETHER: f64 = 1.5;

/// Part by which a parameter of another device differs, where the rig leaves noise alone.
const DIFFERS: f64 = 0.03;

/// `wrong_sign`, `swapped_columns`, `dead_channel`, `input_lags`, `input_leads`, `sensor_lags`,
/// `degrees_for_radians`, `millimetres_for_metres`, `time_in_minutes`, `time_in_hours`,
/// `sensor_offset`, `sensor_drift`, `sensor_gain`, `unanswered_input`, `different_devices`.
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
        if let Some(dead) = dead::detect(rig, &part) {
            found.push(dead);
            continue;
        }
        let Some(refit) = Refit::of(rig, &part) else {
            continue;
        };
        let named = swapped::detect(rig, &part, &refit)
            .or_else(|| another_unit(rig, &part, &refit))
            .or_else(|| wrong_sign(rig, &part, &refit))
            .or_else(|| long_units::detect(rig, &part, &refit))
            .or_else(|| unanswered::detect(rig, &part, &refit))
            .or_else(|| sensor_numbers(rig, &part, &refit))
            .or_else(|| moved_input(rig, &part, &refit));
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
    let refit = Refit::of(rig, &scaled(recording, names, unit.factor)?)?;
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
        let remedy = format!(
            "`unit = \"{}\"` in the rig's sensor of {}",
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
        let refit = Refit::of(rig, &scaled(recording, &names, -1.0)?)?;
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

/// A column moved by some rows, and what the refitted rig leaves then.
struct Moved<'a> {
    squares: f64,
    column: &'a str,
    lag: i64,
}

impl<'a> Moved<'a> {
    /// A refit to the recording with the column `lag` rows earlier; `None` where that cannot be
    /// fitted.
    fn of(rig: &Rig, recording: &Recording, column: &'a str, lag: i64) -> Option<Self> {
        let repair = Repair {
            late: vec![(column.to_owned(), lag)],
            ..Repair::default()
        };
        let shifted = repair.apply(recording.clone()).ok()?;
        let empty = usize::try_from(lag.unsigned_abs()).ok()?;
        let rows = if lag > 0 {
            0..shifted.len().checked_sub(empty)?
        } else {
            empty..shifted.len()
        };
        let refit = Refit::of(rig, &shifted.rows(rows).ok()?)?;
        Some(Self {
            squares: refit.squares,
            column,
            lag,
        })
    }
}

/// An input that was written some rows after it acted, so that the device moves before its command,
/// or some rows before.
fn moved_input(rig: &Rig, recording: &Recording, plain: &Refit) -> Option<Check> {
    if is_noise(rig, recording, plain) {
        return None;
    }
    let mut inputs: Vec<&str> = rig.actuators.iter().map(|a| a.input.as_str()).collect();
    inputs.dedup();
    // Missing physics can look early as well: only what leaves noise alone is a matter of time.
    let noise = EXACT.max(NOISE_ALONE * noise(rig, recording));
    let explains =
        |moved: &Moved| moved.squares < FAR_LESS * plain.squares && moved.squares.sqrt() < noise;
    let late = latest(rig, recording, &inputs, plain);
    if let Some(late) = late.filter(explains) {
        return Some(lags(recording, &late, plain));
    }
    let early = inputs
        .iter()
        .filter_map(|input| best_of(rig, recording, input, LEADS));
    let early = early.min_by(|a, b| a.squares.total_cmp(&b.squares));
    let early = early.filter(explains);
    // All sensors late are one early input: one of several is late by itself.
    let mut sensors: Vec<&str> = rig.sensors.iter().map(|s| s.signal.as_str()).collect();
    sensors.dedup();
    let late = if sensors.len() > 1 {
        latest(rig, recording, &sensors, plain).filter(explains)
    } else {
        None
    };
    match (late, early) {
        (Some(late), Some(early)) if early.squares <= late.squares => {
            Some(leads(recording, &early, plain))
        }
        (Some(late), _) => Some(sensor_lags(recording, &late, plain)),
        (None, early) => early.map(|early| leads(recording, &early, plain)),
    }
}

/// The best of some lags for the best of some columns.
fn latest<'a>(
    rig: &Rig,
    recording: &Recording,
    columns: &[&'a str],
    plain: &Refit,
) -> Option<Moved<'a>> {
    let late = columns.iter().filter_map(|column| {
        let best = best_of(rig, recording, column, LAGS)?;
        if best.squares < CLOSER * plain.squares {
            Some(closely(rig, recording, best))
        } else {
            Some(best)
        }
    });
    late.min_by(|a, b| a.squares.total_cmp(&b.squares))
}

/// Check of one of several sensors that was written late.
fn sensor_lags(recording: &Recording, late: &Moved, plain: &Refit) -> Check {
    let (sensor, lag) = (late.column, late.lag);
    let sentence = format!(
        "{sensor} is written {} after the other signals: moved so, the refitted rig misses {} % \
         of the signals, as it is {} %",
        rows_in_time(recording, lag),
        number(100.0 * late.squares.sqrt()),
        number(100.0 * plain.error())
    );
    let remedy = format!("--late {sensor}={lag}");
    Check::likely(recording, 0, "sensor_lags", sentence, remedy)
}

/// The best of some lags for a column, each farther than the one before.
fn best_of<'a, const N: usize>(
    rig: &Rig,
    recording: &Recording,
    column: &'a str,
    lags: [i64; N],
) -> Option<Moved<'a>> {
    let mut best: Option<Moved> = None;
    for lag in lags {
        let Some(moved) = Moved::of(rig, recording, column, lag) else {
            continue;
        };
        match &best {
            Some(known) if moved.squares > 4.0 * known.squares => break,
            Some(known) if moved.squares >= known.squares => {}
            _ => best = Some(moved),
        }
    }
    best
}

/// The best lag that is reached from another row by row.
fn closely<'a>(rig: &Rig, recording: &Recording, mut best: Moved<'a>) -> Moved<'a> {
    let tried = best.lag;
    for step in [1, -1] {
        let mut lag = tried + step;
        while lag > 0 && !LAGS.contains(&lag) {
            match Moved::of(rig, recording, best.column, lag) {
                Some(moved) if moved.squares < best.squares => best = moved,
                _ => break,
            }
            lag += step;
        }
    }
    best
}

/// Check of an input that was written late.
fn lags(recording: &Recording, late: &Moved, plain: &Refit) -> Check {
    let (input, lag) = (late.column, late.lag);
    let sentence = format!(
        "{input} is written {} after it acts: moved so, the refitted rig misses {} % of the \
         signals, as it is {} %",
        rows_in_time(recording, lag),
        number(100.0 * late.squares.sqrt()),
        number(100.0 * plain.error())
    );
    let remedy = format!("--late {input}={lag}");
    Check::certain(recording, 0, "input_lags", sentence, remedy)
}

/// Check of an input that was written early. A device or a sensor that is late looks the same.
fn leads(recording: &Recording, early: &Moved, plain: &Refit) -> Check {
    let (input, lag) = (early.column, early.lag);
    let sentence = format!(
        "{input} is written {} before it acts, or the device or its sensors are that late: moved so, the refitted \
         rig misses {} % of the signals, as it is {} %",
        rows_in_time(recording, -lag),
        number(100.0 * early.squares.sqrt()),
        number(100.0 * plain.error())
    );
    let remedy = format!("--late {input}={lag} if the logger did it");
    Check::likely(recording, 0, "input_leads", sentence, remedy)
}

/// A number of rows with its time: `2 rows (20 ms)`.
fn rows_in_time(recording: &Recording, lag: i64) -> String {
    let step = recording.interval().unwrap_or(0.0);
    let rows = usize::try_from(lag).unwrap_or(0);
    format!(
        "{} ({} ms)",
        counted(rows, "row"),
        number(1e3 * step * lag as f64)
    )
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
