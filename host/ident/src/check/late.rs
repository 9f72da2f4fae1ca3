//! Columns that were written some rows late or early: inputs, or one of several sensors.

use sinew_sim::Rig;

use super::finding::{Check, counted, number};
use super::refitted::{EXACT, FAR_LESS, NOISE_ALONE, Refit, is_noise, noise};
use crate::recording::Recording;
use crate::recording::repair::Repair;

/// Lags that are tried first, rows; then those beside the best of them.
const LAGS: [i64; 7] = [1, 2, 3, 5, 8, 12, 18];

/// Leads that are tried.
const LEADS: [i64; 4] = [-1, -2, -3, -4];

/// Squares, beside those as recorded, from which on a lag is worth a closer look.
const CLOSER: f64 = 0.5;

/// `input_lags`, `input_leads`, `sensor_lags`: an input that was written some rows after it acted,
/// so that the device moves before its command, or some rows before.
pub(super) fn detect(rig: &Rig, recording: &Recording, plain: &Refit) -> Option<Check> {
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
        .filter_map(|input| best_of(&plain.fit.rig, recording, input, LEADS));
    let early = early.min_by(|a, b| a.squares.total_cmp(&b.squares));
    let early = early.map(|moved| surely(rig, recording, moved, plain));
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

/// A column moved by some rows, and what the refitted rig leaves then.
struct Moved<'a> {
    squares: f64,
    column: &'a str,
    lag: i64,
}

impl<'a> Moved<'a> {
    /// Squares that a few steps from the rig as it was fitted leave of the recording with the
    /// column `lag` rows earlier; `None` where that cannot be fitted.
    fn near(fitted: &Rig, recording: &Recording, column: &'a str, lag: i64) -> Option<Self> {
        let refit = Refit::from_near(fitted, &shifted(recording, column, lag)?)?;
        Some(Self {
            squares: refit.squares,
            column,
            lag,
        })
    }

    /// The same, by the whole search.
    fn searched(self, rig: &Rig, recording: &Recording) -> Self {
        let refit = shifted(recording, self.column, self.lag);
        let refit = refit.and_then(|shifted| Refit::searched(rig, &shifted));
        let squares = refit.map_or(f64::INFINITY, |refit| refit.squares);
        Self {
            squares: squares.min(self.squares),
            ..self
        }
    }
}

/// The recording with a column some rows earlier, without the rows that lack it then.
fn shifted(recording: &Recording, column: &str, lag: i64) -> Option<Recording> {
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
    shifted.rows(rows).ok()
}

/// The best of some lags for the best of some columns.
fn latest<'a>(
    rig: &Rig,
    recording: &Recording,
    columns: &[&'a str],
    plain: &Refit,
) -> Option<Moved<'a>> {
    let late = columns.iter().filter_map(|column| {
        let best = best_of(&plain.fit.rig, recording, column, LAGS)?;
        if best.squares < CLOSER * plain.squares {
            Some(closely(&plain.fit.rig, recording, best))
        } else {
            Some(best)
        }
    });
    let best = late.min_by(|a, b| a.squares.total_cmp(&b.squares))?;
    Some(surely(rig, recording, best, plain))
}

/// A lag by the whole search, where a few steps promise that it leaves far less.
fn surely<'a>(rig: &Rig, recording: &Recording, best: Moved<'a>, plain: &Refit) -> Moved<'a> {
    if best.squares < CLOSER * plain.squares {
        best.searched(rig, recording)
    } else {
        best
    }
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
    fitted: &Rig,
    recording: &Recording,
    column: &'a str,
    lags: [i64; N],
) -> Option<Moved<'a>> {
    let mut best: Option<Moved> = None;
    for lag in lags {
        let Some(moved) = Moved::near(fitted, recording, column, lag) else {
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
fn closely<'a>(fitted: &Rig, recording: &Recording, mut best: Moved<'a>) -> Moved<'a> {
    let tried = best.lag;
    for step in [1, -1] {
        let mut lag = tried + step;
        while lag > 0 && !LAGS.contains(&lag) {
            match Moved::near(fitted, recording, best.column, lag) {
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
