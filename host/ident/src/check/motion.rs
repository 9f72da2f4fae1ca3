//! Motion of a rig as it is written, driven from rest by a recording.

use sinew_sim::{InputTrajectory, Plant, Trajectory};

use crate::recording::Recording;

/// Motion of a rig as written from rest, driven by a recording; `None` where that cannot be
/// simulated.
pub(super) fn from_rest(plant: &Plant, recording: &Recording) -> Option<Trajectory<f64>> {
    let inputs = plant.inputs().iter();
    let inputs = inputs.map(|input| Some(recording.input(input).ok()?.values));
    let inputs = inputs.collect::<Option<Vec<Vec<f64>>>>()?;
    let columns: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
    let drive = InputTrajectory::new(plant, recording.len(), &columns).ok()?;
    let values = plant.values();
    let start = plant.initial_state(&values, &vec![None; plant.sensors().len()]);
    let begin = recording.t()[0];
    let t: Vec<f64> = recording.t().iter().map(|t| t - begin).collect();
    plant.simulate(&values, &start.ok()?, &drive, &t).ok()
}

/// Standard deviation of the valid values.
pub(super) fn spread(values: &[f64]) -> f64 {
    let valid = values.iter().copied().filter(|value| value.is_finite());
    let (count, sum) = valid
        .clone()
        .fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value));
    let mean = sum / f64::max(count, 1.0);
    let squares: f64 = valid.map(|value| (value - mean).powi(2)).sum();
    (squares / f64::max(count, 1.0)).sqrt()
}
