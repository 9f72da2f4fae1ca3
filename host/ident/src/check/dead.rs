//! A sensor that shows nothing where the rig moves it, and its neighbours as recorded.

use sinew_sim::{Plant, Rig};

use super::finding::{Check, number};
use super::motion::{from_rest, spread};
use super::timescale::is_guessed;
use crate::noise::noise_alone;
use crate::recording::Recording;

/// Largest factor between what a rig says of a neighbour's motion and what was recorded, for its
/// word on a sensor to count.
pub(super) const AGREES: f64 = 3.0;

/// Smallest motion, beside that of a neighbour in the same unit, that a sensor has to show.
pub(super) const MOVES: f64 = 0.1;

/// Largest part of the motion that a dead sensor's noise may have.
pub(super) const QUIET: f64 = 0.1;

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
    let moved_by = simulated(rig, recording)?;
    silent.into_iter().find_map(|sensor| {
        let name = &rig.sensors[sensor].signal;
        let unit = sinew_sim::unit::of_column(name);
        let moved = moved_by[sensor];
        let neighbours = rig
            .sensors
            .iter()
            .zip(&moved_by)
            .filter_map(|(other, &said)| {
                let recorded = spread(values(&other.signal));
                let agrees = said < AGREES * recorded && recorded < AGREES * said;
                let counts =
                    other.signal != *name && sinew_sim::unit::of_column(&other.signal) == unit;
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

/// Standard deviation of a sensor that shows noise alone, or nothing; `None` of one that moves.
fn noise_of(recording: &Recording, values: &[f64]) -> Option<f64> {
    // A mean of equal values is not always that value.
    let mut valid = values.iter().filter(|value| value.is_finite());
    let first = valid.next();
    if valid.all(|value| Some(value) == first) {
        return Some(0.0);
    }
    noise_alone(recording.t(), values)
}

/// Standard deviation of each sensor's column as the rig moves it from rest: a start that a dead
/// sensor gives would lead the others astray.
fn simulated(rig: &Rig, recording: &Recording) -> Option<Vec<f64>> {
    let run = from_rest(&Plant::new(rig).ok()?, recording)?;
    let sensors = rig.sensors.iter().enumerate();
    let spreads = sensors.map(|(index, sensor)| spread(&run.column(index)) / sensor.column_factor);
    let spreads: Vec<f64> = spreads.collect();
    spreads.iter().all(|it| it.is_finite()).then_some(spreads)
}
