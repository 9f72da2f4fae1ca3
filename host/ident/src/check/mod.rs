//! Faults of recordings, found before any fit (docs/reference/checks.md).
//!
//! ```text
//! recordings ─► sampling, time ─────────────┐
//!            ─► a column: sentinel, wrap, flat ├─► checks, with kind, line, sentence, remedy
//!            ─► a pair: derivative ───────────┘
//! ```
//! Each detector is a file of its own and returns [`Check`]s. A check that is `certain` means that
//! nothing computed from the recording as it is would be right.

mod columns;
mod copies;
mod dead;
mod derivative;
mod determine;
mod excitation;
mod finding;
mod flat;
mod held;
mod jitter;
mod late;
mod long_units;
mod motion;
mod refit;
mod refitted;
mod sampling;
mod sensor_numbers;
mod sentinel;
mod series;
mod silent;
mod swapped;
mod time;
mod timescale;
mod unanswered;
mod wrap;

use sinew_sim::Rig;

use crate::fit::START_ROWS;
use crate::recording::Recording;
use columns::Columns;
pub use determine::{Determined, Effect, Parameter, determine};
pub use finding::Check;
use finding::rows;

/// Kinds of faults, by their names in results and on the command line.
pub const KINDS: [&str; 33] = [
    "clipped",
    "coarse_sampling",
    "dead_channel",
    "degrees_for_radians",
    "different_devices",
    "few_rows",
    "gap",
    "input_lags",
    "input_leads",
    "input_not_held",
    "irregular_sampling",
    "jittering_delay",
    "millimetres_for_metres",
    "no_excitation",
    "quantised",
    "same_recording",
    "sensor_drift",
    "sensor_gain",
    "sensor_lags",
    "sensor_offset",
    "sentinel",
    "spike",
    "stuck_channel",
    "swapped_columns",
    "time_in_hours",
    "time_in_microseconds",
    "time_in_milliseconds",
    "time_in_minutes",
    "time_in_nanoseconds",
    "time_in_other_unit",
    "unanswered_input",
    "wrapped_counter",
    "wrong_sign",
];

/// Faults of recordings, file by file and line by line; a rig tells which columns are inputs.
///
/// ```
/// # use sinew_ident::{check::check, recording::Recording};
/// let rows: String = (0..100).map(|k| {
///     let q = if k == 50 { -9999.0 } else { f64::from(k).sin() };
///     format!("{},{q}\n", 0.01 * f64::from(k))
/// }).collect();
/// let recording = Recording::parse(format!("t,q_m\n{rows}").as_bytes(), "a.csv")?;
/// let found = check(&[recording], None);
/// assert_eq!((found[0].kind, found[0].line), ("sentinel", 52));
/// assert_eq!(found[0].remedy, "--missing -9999");
/// # Ok::<(), sinew_ident::error::Error>(())
/// ```
pub fn check(recordings: &[Recording], rig: Option<&Rig>) -> Vec<Check> {
    let mut found: Vec<Check> = Vec::new();
    let mut sound: Vec<Recording> = Vec::new();
    for recording in recordings {
        let mut here = alone(recording, rig);
        // The first of two that are equally sure stays: the times themselves before a guessed rig.
        here.extend(rig.and_then(|rig| timescale::detect(rig, recording)));
        surest_of_time(&mut here);
        here.extend(rig.and_then(|rig| timescale::coarse(rig, recording)));
        if !here.iter().any(|check| check.certain) {
            sound.push(recording.clone());
        }
        here.sort_by_key(|check| check.line);
        found.extend(here);
    }
    found.extend(copies::detect(recordings));
    // A refit of what is certainly wrong would tell nothing.
    let refitted = rig.map_or_else(Vec::new, |rig| refit::detect(rig, &sound));
    // A constant sensor that has to move was only likely to be dead.
    let column = |check: &Check| {
        let first = check.sentence.split_whitespace().next();
        (check.file.clone(), first.unwrap_or_default().to_owned())
    };
    found.retain(|known| {
        let mut dead = refitted.iter().filter(|it| it.kind == "dead_channel");
        known.kind != "dead_channel" || !dead.any(|it| column(it) == column(known))
    });
    found.extend(refitted);
    found
}

/// Ends of the ranges of a rig's sensors at which one of the recordings is `clipped`, by column. A
/// sensor has its range in every recording.
pub fn clipped_at(recordings: &[&Recording], rig: &Rig) -> Vec<(String, f64)> {
    let mut ends = Vec::new();
    for recording in recordings {
        for name in Columns::of(recording, Some(rig)).sensors {
            let values = recording.column(&name).unwrap_or_default();
            let here = flat::clipped_at(values).into_iter();
            ends.extend(here.map(|end| (name.clone(), end)));
        }
    }
    ends
}

/// The recording without the samples that lie at such an end, and their number.
pub fn without_clipped(recording: &Recording, ends: &[(String, f64)]) -> (Recording, usize) {
    let mut cleared = recording.clone();
    let mut count = 0;
    for (name, end) in ends {
        let Ok(values) = cleared.values_mut(name) else {
            continue;
        };
        for value in values.iter_mut().filter(|value| **value == *end) {
            *value = f64::NAN;
            count += 1;
        }
    }
    (cleared, count)
}

/// One word on the time at most, the surest.
fn surest_of_time(found: &mut Vec<Check>) {
    let on_time = |check: &Check| check.kind.starts_with("time_in");
    let best = found.iter().rev().filter(|check| on_time(check));
    let Some(best) = best.max_by_key(|check| check.certain).cloned() else {
        return;
    };
    found.retain(|check| !on_time(check));
    found.push(best);
}

/// Faults that one recording shows by itself.
fn alone(recording: &Recording, rig: Option<&Rig>) -> Vec<Check> {
    let columns = Columns::of(recording, rig);
    let values = |name: &String| recording.column(name).unwrap_or_default();
    // A rig asks for its sensors; a log may have columns of rare events.
    let named = rig.is_some();
    let driven = columns.inputs.iter().any(|name| varies(values(name)));
    let mut found = sampling::detect(recording, driven);
    found.extend(few_rows(recording));
    found.extend(time::detect(recording));
    for name in columns.inputs.iter().chain(&columns.sensors) {
        let sensor = columns.sensors.contains(name);
        let of_values = sentinel::detect(recording, name, values(name), sensor)
            .or_else(|| sensor.then(|| wrap::detect(recording, name, values(name)))?)
            .or_else(|| {
                sensor.then(|| flat::detect(recording, name, values(name), (driven, named)))?
            });
        found.extend(of_values);
    }
    // Beside a fault of the values or of the stamps, the scatter is that fault's.
    if found.is_empty() {
        let sensors = columns.sensors.iter();
        found.extend(sensors.filter_map(|name| jitter::detect(recording, name, values(name))));
    }
    for (q, qd) in derivative::pairs(recording) {
        found.extend(derivative::detect(recording, (&q, &qd)));
    }
    // A sentinel, a wrap or a spike is no motion, but hides it.
    let hides = |check: &Check| check.certain || check.kind == "spike";
    if !found.iter().any(hides) {
        found.extend(excitation::detect(recording, &columns.sensors));
    }
    found
}

/// A recording that is too short to judge a rig by.
fn few_rows(recording: &Recording) -> Option<Check> {
    let count = recording.len();
    (count <= START_ROWS).then(|| {
        let sentence = format!(
            "{} are too few to judge a rig by: the first {START_ROWS} show where a run starts",
            rows(count)
        );
        let remedy = "record longer";
        Check::likely(recording, 0, "few_rows", sentence, remedy)
    })
}

fn varies(values: &[f64]) -> bool {
    let mut valid = values.iter().filter(|value| value.is_finite());
    let first = valid.next();
    first.is_some_and(|first| valid.any(|value| value != first))
}
