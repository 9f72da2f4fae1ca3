//! Measured over simulated, and their difference.

use super::free::Model;
use crate::report::{Plot, Series, Stroke, Tone};

/// Error of a model that is so many times the best one's is not drawn: it would flatten the others.
const FAR: f64 = 5.0;

/// Signal and error of each sensor over one recording, two plots a sensor; `index` is the place of
/// the recording among the runs of every model.
pub fn motions(models: &[Model<'_>], index: usize, role: &str, bands: &[[f64; 2]]) -> Vec<Plot> {
    let Some(best) = models.last().and_then(|model| model.runs.get(index)) else {
        return Vec::new();
    };
    let mut plots = Vec::new();
    for (sensor, last) in best.sensors.iter().enumerate() {
        let line = |name: &str, stroke: Stroke, tone: Tone, y: Vec<f64>| {
            Series::new(name, stroke, best.t.clone(), y).tone(tone)
        };
        let name = &best.recording;
        let of = if role.is_empty() {
            format!("{} of {name}", last.signal)
        } else {
            format!("{} of {name} ({role})", last.signal)
        };
        let measured = last.measured.clone();
        let mut signal = Plot::over_time(of).y(&last.signal, &last.unit).with(line(
            "measured",
            Stroke::Solid,
            Tone::Ink,
            measured,
        ));
        let title = format!("{} of {name}: simulated minus measured", last.signal);
        let mut difference = Plot::over_time(title).y("error", &last.unit);
        let limit = FAR * size(&error(&last.simulated, &last.measured));
        for (k, model) in models.iter().enumerate() {
            let Some(simulated) = model.runs.get(index).map(|r| &r.sensors[sensor].simulated)
            else {
                continue;
            };
            let errors = error(simulated, &last.measured);
            let is_last = k + 1 == models.len();
            // Of the one before the last the reader wants to see how much was gained.
            if k + 2 < models.len() && size(&errors) > limit {
                continue;
            }
            let stroke = if is_last {
                Stroke::Dashed
            } else {
                Stroke::Solid
            };
            signal = signal.with(line(model.name, stroke, model.tone, simulated.clone()));
            difference = difference.with(line(model.name, Stroke::Solid, model.tone, errors));
        }
        signal.bands = bands.to_vec();
        difference.bands = bands.to_vec();
        plots.extend([signal, difference]);
    }
    plots
}

/// Simulated minus measured.
pub(super) fn error(simulated: &[f64], measured: &[f64]) -> Vec<f64> {
    simulated.iter().zip(measured).map(|(s, m)| s - m).collect()
}

/// Largest magnitude; infinite where something is no number.
fn size(values: &[f64]) -> f64 {
    let finite = values.iter().filter(|v| !v.is_nan());
    finite.fold(0.0, |size: f64, v| size.max(v.abs()))
}
