//! Reach of a rig: the workspace that constant inputs within its limits span at rest.

use sinew_sim::{Plant, Stepper};

use crate::closed_loop::reference::Workspace;
use crate::closed_loop::scenario::InputLimits;
use sinew_ident::error::Result;

/// Part of each input's limit that a reference may need at rest: a plant a fifth stiffer still gets
/// there, with something left for moving.
const REACH: f64 = 0.7;
/// A reach smaller than this part of what was recorded is none.
const LEAST_REACH: f64 = 0.05;
/// Seconds within which a plant that settles has settled.
const SETTLING_S: f64 = 60.0;

/// Narrows recorded workspaces to what can be held at rest.
///
/// # Errors
/// A start that the rig refuses.
pub(super) fn narrow(
    workspaces: &mut [Workspace],
    plant: &Plant,
    home: &[Option<f64>],
    outputs: &[usize],
    limits: &[InputLimits],
) -> Result<()> {
    let ends = [
        rest(plant, home, outputs, limits, |(_, high, _)| REACH * high)?,
        rest(plant, home, outputs, limits, |(low, _, _)| REACH * low)?,
    ];
    for (i, workspace) in workspaces.iter_mut().enumerate() {
        if let (Some(a), Some(b)) = (ends[0][i], ends[1][i]) {
            // Opposite pushes that lead to the same place, as to a tip's height, say nothing
            // about its reach.
            if (a - b).abs() > LEAST_REACH * (workspace.high - workspace.low) {
                workspace.low = workspace.low.max(a.min(b));
                workspace.high = workspace.high.min(a.max(b));
            }
        }
    }
    Ok(())
}

/// Rest of each output under constant inputs; `None` where it does not rest, such as an axis that
/// drifts, and where it does not leave home. What was recorded may lie beyond: a springy plant
/// swings further than it can be held.
fn rest(
    plant: &Plant,
    home: &[Option<f64>],
    outputs: &[usize],
    limits: &[InputLimits],
    push: impl Fn(&InputLimits) -> f64,
) -> Result<Vec<Option<f64>>> {
    let start = plant.initial_state(&plant.values(), home)?;
    let inputs: Vec<f64> = limits.iter().map(push).collect();
    if !inputs.iter().all(|u| u.is_finite()) {
        return Ok(vec![None; outputs.len()]);
    }
    let seen = match balanced(plant, &inputs, &start, outputs) {
        Some(rests) => Some(rests.into_iter().map(|y| (y, y)).collect()),
        None => simulated(plant, &inputs, &start, outputs)?,
    };
    let Some(seen) = seen else {
        return Ok(vec![None; outputs.len()]);
    };
    let settled = seen.iter().zip(outputs).map(|((low, high), sensor)| {
        let travel = ((low + high) / 2.0 - home[*sensor].unwrap_or(0.0)).abs();
        (high - low < 0.02 * travel).then_some((low + high) / 2.0)
    });
    Ok(settled.collect())
}

/// Rest of each output by the balance of forces. `None` where there is none, and where friction,
/// hysteresis or play leave an interval of rests: the end of a motion then depends on its course.
fn balanced(plant: &Plant, inputs: &[f64], start: &[f64], outputs: &[usize]) -> Option<Vec<f64>> {
    let values = plant.values();
    let rest = plant.rest(&values, inputs, start).ok()?;
    let intervals = plant.rest_intervals(&values, inputs, &rest.state).ok()?;
    let rests = outputs.iter().map(|sensor| rest.signals[*sensor]);
    intervals.is_empty().then(|| rests.collect())
}

/// Lowest and highest reading of each output at the end of a long simulation; `None` where the
/// simulation fails.
fn simulated(
    plant: &Plant,
    inputs: &[f64],
    start: &[f64],
    outputs: &[usize],
) -> Result<Option<Vec<(f64, f64)>>> {
    const ROWS: usize = 600;
    let mut stepper = Stepper::new(plant, &plant.values(), start)?;
    let mut seen = vec![(f64::INFINITY, f64::NEG_INFINITY); outputs.len()];
    for row in 0..ROWS {
        if stepper.advance(SETTLING_S / ROWS as f64, inputs).is_err() {
            return Ok(None);
        }
        if row >= ROWS * 9 / 10 {
            for (seen, sensor) in seen.iter_mut().zip(outputs) {
                let y = stepper.signal(*sensor);
                *seen = (seen.0.min(y), seen.1.max(y));
            }
        }
    }
    Ok(Some(seen))
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;
    use std::time::Instant;

    use sinew_sim::Rig;

    use super::*;

    /// Rigs without anything that ends a motion: their simulation never comes to rest.
    const UNDAMPED: &[&str] = &["torque-limited-pendulum.toml"];

    fn shipped() -> Vec<(String, Plant)> {
        let root = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../rigs"));
        let files = ["", "recorded"].map(|folder| std::fs::read_dir(root.join(folder)));
        let files = files.into_iter().flatten().flatten();
        let mut files: Vec<PathBuf> = files.flatten().map(|entry| entry.path()).collect();
        files.retain(|path| path.extension().is_some_and(|end| end == "toml"));
        files.sort();
        let read = |path: PathBuf| {
            let name = path.file_name().map(|name| name.to_string_lossy().into());
            let rig = Rig::load(&path).unwrap_or_else(|error| panic!("{error}"));
            (name.unwrap_or_default(), Plant::new(&rig).expect("a plant"))
        };
        files.into_iter().map(read).collect()
    }

    /// The end of a minute's simulation and the balance of forces are one place.
    #[test]
    fn rests_by_statics_are_those_of_a_long_simulation() {
        let mut judged = 0;
        for (name, plant) in shipped() {
            if UNDAMPED.contains(&name.as_str()) || plant.only_recordings().is_some() {
                continue;
            }
            let outputs: Vec<usize> = (0..plant.sensors().len()).collect();
            let start = vec![0.0; plant.state_len()];
            for share in [0.7, -0.7] {
                let limits = plant.inputs().iter().map(|input| input.limit);
                let inputs = limits.map(|limit| match limit {
                    Some((low, high)) => REACH * if share > 0.0 { high } else { low },
                    None => share,
                });
                let inputs: Vec<f64> = inputs.collect();
                let begun = Instant::now();
                let Some(rests) = balanced(&plant, &inputs, &start, &outputs) else {
                    continue;
                };
                let by_statics = begun.elapsed().as_secs_f64();
                let begun = Instant::now();
                let seen = simulated(&plant, &inputs, &start, &outputs).expect("a start");
                let by_simulation = begun.elapsed().as_secs_f64();
                let Some(seen) = seen else {
                    panic!("{name} cannot be simulated");
                };
                let mut worst = 0.0f64;
                for (rest, (low, high)) in rests.iter().zip(seen) {
                    // The minute ends before the slowest of them are still.
                    let error = ((rest - (low + high) / 2.0).abs() - (high - low)).max(0.0);
                    worst = worst.max(error / (1e-3 + rest.abs()));
                }
                println!("{name} {share}: {worst:.1e}, {by_statics:.1e} s, {by_simulation:.1e} s");
                assert!(worst < 1e-9, "{name}: {worst:e}");
                judged += 1;
            }
        }
        assert!(judged >= 6, "{judged} rests");
    }
}
