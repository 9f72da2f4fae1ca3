//! One recording, laid against the columns of a plant: SI, in the plant's order.

use std::ops::Range;

use sinew_sim::rig::Reads;
use sinew_sim::{Input, InputTrajectory, MotionQuantity, Plant, Rig};

use crate::error::{Error, Result};
use crate::recording::Recording;

/// A recording in SI units, in the order of the plant.
#[derive(Clone)]
pub(crate) struct Experiment {
    /// Name of the file, for reports.
    pub name: String,
    /// Times of the rows, s.
    pub t: Vec<f64>,
    /// One column an input, without gaps, SI.
    pub inputs: Vec<Vec<f64>>,
    /// One column a sensor, NaN where missing, SI.
    pub signals: Vec<Vec<f64>>,
    /// Inputs whose missing samples were held: column and count.
    pub held: Vec<(String, usize)>,
}

/// Sensor of a body with its gain and offset.
#[derive(Clone, Copy)]
pub(crate) struct View {
    pub sensor: usize,
    pub(crate) gain: Option<usize>,
    pub(crate) offset: Option<usize>,
}

impl View {
    /// The reading behind a signal, with the parameter values as they are now.
    pub fn reading(&self, signal: f64, values: &[f64]) -> f64 {
        (signal - self.offset.map_or(0.0, |slot| values[slot])) / self.gain(values)
    }

    pub fn gain(&self, values: &[f64]) -> f64 {
        self.gain.map_or(1.0, |slot| values[slot])
    }
}

/// Sensors of the positions and the velocities of the bodies.
pub(crate) struct Views {
    pub position: Vec<Option<View>>,
    pub velocity: Vec<Option<View>>,
    /// States of effects, which no sensor shows either.
    pub internal: usize,
    /// Bodies whose motion is imposed, each with the input that is its position; the next one is
    /// its velocity.
    pub imposed: Vec<(usize, usize)>,
}

impl Views {
    pub fn new(rig: &Rig, plant: &Plant) -> Self {
        // Those of hidden modes included: no sensor shows them.
        let bodies = plant.bodies();
        let mut views = Self {
            position: vec![None; bodies],
            velocity: vec![None; bodies],
            internal: plant.state_len() - 2 * bodies,
            imposed: imposed(rig, plant),
        };
        for (sensor, described) in rig.sensors.iter().enumerate() {
            let view = View {
                sensor,
                gain: plant.slot(&format!("{}.gain", described.name)),
                offset: plant.slot(&format!("{}.offset", described.name)),
            };
            match described.reads {
                Reads::Position(body) => _ = views.position[body].get_or_insert(view),
                Reads::Velocity(body) => _ = views.velocity[body].get_or_insert(view),
                Reads::Tension(_)
                | Reads::Effort(_)
                | Reads::ActuatorEffort(_)
                | Reads::Shape(_)
                | Reads::Hasel(..) => {}
            }
        }
        views
    }
}

/// Bodies whose motion is imposed, with the input that is the position.
fn imposed(rig: &Rig, plant: &Plant) -> Vec<(usize, usize)> {
    let position = |input: &Input| input.motion == Some(MotionQuantity::Position);
    let inputs = plant.inputs().iter().enumerate();
    let inputs = inputs.filter(|(_, input)| position(input));
    let bodies = rig.bodies.iter().enumerate();
    let bodies = bodies.filter(|(_, body)| body.motion_from.is_some());
    bodies
        .zip(inputs)
        .map(|((body, _), (input, _))| (body, input))
        .collect()
}

impl Experiment {
    /// Takes the columns that the plant names.
    ///
    /// # Errors
    /// `File`, with the recording's line, for a column that is not there, for an input without one
    /// value, and for a recording whose sensors have no sample at all.
    pub fn new(plant: &Plant, recording: &Recording) -> Result<Self> {
        let mut inputs = Vec::new();
        let mut held = Vec::new();
        for input in plant.inputs() {
            inputs.push(match input.motion {
                // The smoothing bridges what is missing.
                Some(_) => recording.si(&input.column, input.column_factor, &input.wanted_by())?,
                None => {
                    let column = recording.input(input)?;
                    if column.missing > 0 {
                        held.push((input.column.clone(), column.missing));
                    }
                    column.values
                }
            });
        }
        plant
            .derive_motions(recording.t(), &mut inputs)
            .map_err(|error| Error::file(recording.path(), error.to_string()))?;
        let sensors = plant.sensors().iter();
        let signals = sensors.map(|sensor| recording.sensor(sensor));
        let signals = signals.collect::<Result<Vec<_>>>()?;
        if signals.iter().flatten().all(|value| value.is_nan()) {
            return Err(Error::file(
                recording.path(),
                "no sensor of the rig has a single sample here",
            ));
        }
        Ok(Self {
            name: recording.name(),
            t: recording.t().to_vec(),
            inputs,
            signals,
            held,
        })
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.t.len()
    }

    /// Input trajectory over some rows; actuators remember the rows before.
    ///
    /// # Errors
    /// None that [`Experiment::new`] has not excluded.
    pub fn drive(&self, plant: &Plant, rows: Range<usize>) -> Result<InputTrajectory> {
        let over = |rows: Range<usize>| -> Vec<&[f64]> {
            let inputs = self.inputs.iter();
            inputs.map(|column| &column[rows.clone()]).collect()
        };
        let drive = InputTrajectory::new(plant, rows.len(), &over(rows.clone()))?;
        let Some(&now) = self.t.get(rows.start) else {
            return Ok(drive);
        };
        let before = 0..rows.start;
        Ok(drive.after(plant, &self.t[before.clone()], now, &over(before))?)
    }

    /// Value and slope per second of a signal at a row: a parabola through the valid samples of at
    /// most `reach` rows on either side, by least squares. `None` without a valid sample there.
    pub fn value_and_slope(&self, sensor: usize, row: usize, reach: usize) -> Option<[f64; 2]> {
        let rows = row.saturating_sub(reach)..(row + reach + 1).min(self.rows());
        let samples: Vec<[f64; 2]> = rows
            .filter(|&i| self.signals[sensor][i].is_finite())
            .map(|i| [self.t[i] - self.t[row], self.signals[sensor][i]])
            .collect();
        let extent = samples
            .iter()
            .map(|sample| sample[0].abs())
            .fold(0.0, f64::max);
        if samples.is_empty() {
            return None;
        }
        let terms = samples.len().min(3);
        if terms < 3 || extent == 0.0 {
            let mean = samples.iter().map(|sample| sample[1]).sum::<f64>() / samples.len() as f64;
            return Some([mean, 0.0]);
        }
        // Abscissas within -1 to 1 keep the normal equations well conditioned.
        let mut normal = nalgebra::Matrix3::zeros();
        let mut right = nalgebra::Vector3::zeros();
        for [t, y] in &samples {
            let x = t / extent;
            let powers = nalgebra::Vector3::new(1.0, x, x * x);
            normal += powers * powers.transpose();
            right += powers * *y;
        }
        let solution = normal.cholesky()?.solve(&right);
        Some([solution[0], solution[1] / extent])
    }

    /// Standard deviation of a signal's valid samples; 0 without any.
    pub fn spread(&self, sensor: usize) -> f64 {
        let valid = || {
            self.signals[sensor]
                .iter()
                .copied()
                .filter(|value| value.is_finite())
        };
        let count = valid().count().max(1) as f64;
        let mean = valid().sum::<f64>() / count;
        (valid().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
    }
}

/// Fraction of a recording from which its initial state is estimated.
const START_PART: f64 = 0.05;

/// Fewest rows of a recording from which its initial state is estimated.
pub(crate) const START_ROWS: usize = 20;

/// Rows of a recording from which its initial state is estimated.
pub(crate) fn start_rows(rows: usize) -> usize {
    START_ROWS.max((START_PART * rows as f64).ceil() as usize)
}

/// Part of what the first rows say of a start by which it is anchored where nothing is missing.
pub(super) const ANCHORED: f64 = 0.05;

/// Size of each sensor's variations over all recordings, never zero.
pub(crate) fn spreads(experiments: &[Experiment]) -> Vec<f64> {
    let sensors = experiments
        .first()
        .map_or(0, |experiment| experiment.signals.len());
    (0..sensors)
        .map(|sensor| {
            let spread = experiments
                .iter()
                .map(|experiment| experiment.spread(sensor))
                .fold(0.0, f64::max);
            if spread > 0.0 { spread } else { 1.0 }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_recovered_in_spite_of_gaps() {
        let t: Vec<f64> = (0..40)
            .map(|k| 0.1 * f64::from(k) + 0.01 * f64::from(k % 3))
            .collect();
        let mut signal: Vec<f64> = t.iter().map(|t| 2.0 - 3.0 * t + 0.5 * t * t).collect();
        signal[18] = f64::NAN;
        signal[22] = f64::NAN;
        let at = t[20];
        let experiment = Experiment {
            name: String::new(),
            t,
            inputs: vec![],
            signals: vec![signal],
            held: vec![],
        };
        let [value, slope] = experiment.value_and_slope(0, 20, 6).unwrap();
        assert!((value - (2.0 - 3.0 * at + 0.5 * at * at)).abs() < 1e-12);
        assert!((slope - (at - 3.0)).abs() < 1e-10);
        assert!(
            experiment
                .value_and_slope(0, 0, 0)
                .is_some_and(|[_, slope]| slope == 0.0)
        );
    }
}
