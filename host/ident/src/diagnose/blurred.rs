//! Rows that lie so far apart that the differences of a signal show its motion and not its noise.

use crate::diagnose::config::CONFIG;
use crate::diagnose::noise::{level, median};
use crate::fit::{Fit, FreeRunSensor};
use crate::report::quantity;

/// Noise of each sensor in what the refitted rig leaves of it, where the refitted rig alone, which
/// has no noise, shows most of what was taken for noise; `None` of the others.
pub(crate) fn levels(refitted: &Fit, noise: &[f64]) -> Vec<Option<f64>> {
    let sensors = noise.iter().enumerate();
    let of = |(sensor, noise): (usize, &f64)| {
        let over = |signal: &dyn Fn(&FreeRunSensor) -> Vec<f64>| {
            let each = refitted.runs.iter();
            median(
                each.map(|run| level(&run.t, &signal(&run.sensors[sensor])))
                    .collect(),
            )
        };
        let motion = over(&|run| run.simulated.clone());
        let left = over(&|run| {
            let pairs = run.measured.iter().zip(&run.simulated);
            pairs
                .map(|(measured, simulated)| measured - simulated)
                .collect()
        });
        (motion > CONFIG.model.blurred * noise && left > 0.0).then_some(left)
    };
    sensors.map(of).collect()
}

/// Sentence where nothing is left beside a noise that nobody knows: what is left may be physics.
pub(crate) fn warning(refitted: &Fit, levels: &[Option<f64>]) -> Option<String> {
    let blurred = levels.iter().zip(&refitted.sensors);
    let blurred = blurred.filter(|(level, _)| level.is_some());
    let said = blurred.map(|(_, sensor)| {
        format!(
            "{} of {} at {}",
            quantity(sensor.rms, &sensor.unit),
            quantity(sensor.spread, &sensor.unit),
            sensor.signal
        )
    });
    let said: Vec<String> = said.collect();
    (!said.is_empty()).then(|| {
        format!(
            "The rows are too far apart to tell noise from motion: what is left, {}, may be \
             physics that is missing.",
            said.join(", ")
        )
    })
}
