//! A sensor that shows nothing where the rig moves it, and its neighbours as recorded.

use sinew_sim::Rig;

use super::finding::{Check, number};
use super::timescale::is_guessed;
use crate::fit::{FreeRun, free_runs};
use crate::noise::noise_alone;
use crate::recording::Recording;

/// Largest factor between what a rig says of a neighbour's motion and what was recorded, for its
/// word on a sensor to count.
const AGREES: f64 = 3.0;

/// Smallest motion, beside that of a neighbour in the same unit, that a sensor has to show.
const MOVES: f64 = 0.1;

/// Largest part of the motion that a dead sensor's noise may have.
const QUIET: f64 = 0.1;

/// `dead_channel` of one of several sensors: it is constant, or noise alone, where the rig as
/// written moves it as far as another that reads the same unit and moves as recorded.
pub(super) fn detect(rig: &Rig, recording: &Recording) -> Option<Check> {
    let values = |name: &str| recording.column(name).unwrap_or_default();
    let quiet = |name: &str| noise_of(recording, values(name));
    let silent: Vec<usize> = (0..rig.sensors.len())
        .filter(|&sensor| quiet(&rig.sensors[sensor].signal).is_some())
        .collect();
    if silent.is_empty() || silent.len() == rig.sensors.len() {
        return None;
    }
    // A start that a dead sensor gives would lead the others astray.
    let heard = without(recording, rig, &silent)?;
    let runs = free_runs(rig, std::slice::from_ref(&heard)).ok()?;
    let run = runs.first()?;
    silent.into_iter().find_map(|sensor| {
        let name = &rig.sensors[sensor].signal;
        let unit = sinew_sim::unit::of_column(name);
        let moved = simulated(run, name)?;
        let neighbours = rig.sensors.iter().filter_map(|other| {
            let recorded = spread(values(&other.signal));
            let said = simulated(run, &other.signal)?;
            let agrees = said < AGREES * recorded && recorded < AGREES * said;
            let counts = other.signal != *name && sinew_sim::unit::of_column(&other.signal) == unit;
            (counts && agrees && quiet(&other.signal).is_none()).then_some(recorded)
        });
        let neighbour = neighbours.reduce(f64::max)?;
        let dead = moved > MOVES * neighbour && quiet(name)? < QUIET * moved;
        dead.then(|| {
            let sentence = format!(
                "{name} shows no motion, where the rig as it is written moves it by {} {unit} \
                 (standard deviation)",
                number(moved)
            );
            let remedy = "check the sensor and its cable; or leave the sensor out of the rig";
            // Guesses may say of any part that it moves.
            let grade = if is_guessed(rig) {
                Check::likely
            } else {
                Check::certain
            };
            grade(recording, 0, "dead_channel", sentence, remedy)
        })
    })
}

/// The recording without a value of these sensors.
fn without(recording: &Recording, rig: &Rig, silent: &[usize]) -> Option<Recording> {
    let columns = recording.columns().iter().map(|column| {
        let mut column = column.clone();
        let mut names = silent.iter().map(|&sensor| &rig.sensors[sensor].signal);
        if names.any(|name| *name == column.name) {
            column.values.fill(f64::NAN);
        }
        column
    });
    let columns = columns.collect();
    Recording::new(recording.path(), recording.t().to_vec(), columns).ok()
}

/// Standard deviation of a sensor that shows noise alone, or nothing; `None` of one that moves.
fn noise_of(recording: &Recording, values: &[f64]) -> Option<f64> {
    if spread(values) == 0.0 {
        return Some(0.0);
    }
    noise_alone(recording.t(), values)
}

/// Standard deviation of what a run says of a sensor.
fn simulated(run: &FreeRun, name: &str) -> Option<f64> {
    let signal = run.sensors.iter().find(|signal| signal.signal == name)?;
    let spread = spread(&signal.simulated);
    spread.is_finite().then_some(spread)
}

/// Standard deviation of the valid values.
fn spread(values: &[f64]) -> f64 {
    let valid = values.iter().copied().filter(|value| value.is_finite());
    let (count, sum) = valid
        .clone()
        .fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value));
    let mean = sum / f64::max(count, 1.0);
    let squares: f64 = valid.map(|value| (value - mean).powi(2)).sum();
    (squares / f64::max(count, 1.0)).sqrt()
}
