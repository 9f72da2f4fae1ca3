//! Ranges, speeds, noise and limits from recordings.

use sinew_sim::Plant;

use crate::closed_loop::reference::Workspace;
use crate::closed_loop::scenario::InputLimits;
use sinew_ident::error::{Error, Result};
use sinew_ident::noise::noise_level;
use sinew_ident::recording::Recording;

/// Workspace and noise of each output in the recordings; `reference` is named where there are none.
///
/// # Errors
/// A column that is not there, or that never moves.
pub(super) fn workspaces(
    plant: &Plant,
    outputs: &[usize],
    recordings: &[Recording],
    reference: &Recording,
) -> Result<(Vec<Workspace>, Vec<f64>)> {
    let mut workspaces = Vec::new();
    let mut noise = Vec::new();
    for &sensor in outputs {
        let sensor = &plant.sensors()[sensor];
        let (mut low, mut high, mut speed, mut level) =
            (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64, f64::INFINITY);
        for recording in recordings {
            let y = recording.sensor(sensor)?;
            low = y.iter().copied().fold(low, f64::min);
            high = y.iter().copied().fold(high, f64::max);
            level = level.min(noise_level(recording.t(), &y));
            speed = speed.max(typical_speed(recording.t(), &y));
        }
        if high <= low {
            let first = recordings.first().map_or(reference.path(), Recording::path);
            let message = format!(
                "`{}` never moves, so there is nothing to learn from",
                sensor.column
            );
            return Err(Error::file(first, message)
                .at(1, 1)
                .expected("a recording in which every output moves"));
        }
        workspaces.push(Workspace { low, high, speed });
        noise.push(level);
    }
    Ok((workspaces, noise))
}

/// Noise of each channel in the quietest recording.
///
/// # Errors
/// A column that is not there.
pub(super) fn noise(
    plant: &Plant,
    channels: &[usize],
    recordings: &[Recording],
) -> Result<Vec<f64>> {
    let quietest = |sensor: &usize| -> Result<f64> {
        let sensor = &plant.sensors()[*sensor];
        let levels = recordings
            .iter()
            .map(|r| Ok(noise_level(r.t(), &r.sensor(sensor)?)));
        let levels = levels.collect::<Result<Vec<f64>>>()?;
        Ok(levels.into_iter().fold(f64::INFINITY, f64::min))
    };
    channels.iter().map(quietest).collect()
}

/// First valid sample of every sensor.
///
/// # Errors
/// A column that is not there.
pub(super) fn home(plant: &Plant, recording: &Recording) -> Result<Vec<Option<f64>>> {
    let first = plant.sensors().iter().map(|sensor| {
        let y = recording.sensor(sensor)?;
        Ok(y.into_iter().find(|v| v.is_finite()))
    });
    first.collect()
}

/// The rig's limits; an input without one may go a fifth beyond what was recorded.
pub(super) fn limits(
    plant: &Plant,
    recordings: &[Recording],
    period: f64,
) -> Result<Vec<InputLimits>> {
    let of = |input: &sinew_sim::Input| -> Result<InputLimits> {
        let (low, high) = match input.limit {
            Some(limit) => limit,
            None => {
                let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
                for recording in recordings {
                    for value in recording.input(input)?.values {
                        low = low.min(value);
                        high = high.max(value);
                    }
                }
                let margin = 0.1 * (high - low);
                (low - margin, high + margin)
            }
        };
        if high.partial_cmp(&low) != Some(std::cmp::Ordering::Greater) {
            return Err(Error::failed(format!(
                "`{}` has no limit and never moves in the recordings",
                input.column
            ))
            .help(format!("give the actuator `{}` a `limit`", input.actuator)));
        }
        Ok((
            low,
            high,
            input.rate_limit.map_or(f64::INFINITY, |rate| rate * period),
        ))
    };
    plant.inputs().iter().map(of).collect()
}

/// Root mean square speed over stretches of a hundredth of the recording, so that noise averages
/// out.
fn typical_speed(t: &[f64], y: &[f64]) -> f64 {
    let stride = (t.len() / 100).max(1);
    let speeds: Vec<f64> = (stride..t.len())
        .step_by(stride)
        .map(|i| (y[i] - y[i - stride]) / (t[i] - t[i - stride]))
        .filter(|v| v.is_finite())
        .collect();
    (speeds.iter().map(|v| v * v).sum::<f64>() / speeds.len().max(1) as f64).sqrt()
}
