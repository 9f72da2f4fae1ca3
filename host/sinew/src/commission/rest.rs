//! Sensors at rest: noise, drift, and what is dead.

use super::journal::{AtRest, Cause};
use super::setup::{Sensor, Setup};
use sinew_ident::noise::noise_level;

/// Samples of a block, over which slow noise is averaged.
pub(super) const BLOCK: usize = 8;
/// Part of missing samples from which a sensor counts as dead.
const MOST_MISSING: f64 = 0.5;
/// Part of a sensor's predicted range by which it may drift while it is looked at.
const MOST_DRIFT: f64 = 0.05;

/// Figures of each sensor, from readings at times `t`, a column a sensor.
pub fn figures(setup: &Setup, t: &[f64], y: &[Vec<f64>]) -> Vec<AtRest> {
    let sensors = setup.sensors.iter().zip(y);
    sensors.map(|(sensor, y)| figure(sensor, t, y)).collect()
}

fn figure(sensor: &Sensor, t: &[f64], y: &[f64]) -> AtRest {
    let valid: Vec<(f64, f64)> = (t.iter().zip(y))
        .filter(|(_, y)| y.is_finite())
        .map(|(t, y)| (*t, *y))
        .collect();
    let values: Vec<f64> = valid.iter().map(|(_, y)| *y).collect();
    let mean = mean(&values);
    let blocks: Vec<f64> = values.chunks_exact(BLOCK).map(self::mean).collect();
    AtRest {
        signal: sensor.column.clone(),
        unit: sensor.unit.clone(),
        mean,
        noise: noise_level(t, y),
        wander: deviation(&blocks),
        drift: slope(&valid),
        missing: 1.0 - values.len() as f64 / y.len().max(1) as f64,
        frozen: values.windows(2).all(|pair| pair[0] == pair[1]),
    }
}

/// Faults of sensors at rest; `spans`: half the predicted range of each, `seconds`: how long they
/// were looked at.
pub fn faults(at_rest: &[AtRest], spans: &[f64], seconds: f64) -> Vec<Cause> {
    let mut causes = Vec::new();
    for (sensor, span) in at_rest.iter().zip(spans) {
        let name = &sensor.signal;
        if sensor.missing > MOST_MISSING {
            causes.push(Cause {
                kind: "dead_sensor".into(),
                signals: vec![name.clone()],
                sentence: format!(
                    "`{name}` is dead: {:.0} % of its samples are missing",
                    100.0 * sensor.missing
                ),
                remedy: format!(
                    "look for a broken wire or a short at `{name}` and at its scale in the wiring: \
                     a code at either end of the converter is a missing sample"
                ),
            });
        } else if sensor.drift.abs() * seconds > (MOST_DRIFT * span).max(10.0 * sensor.noise) {
            causes.push(Cause {
                kind: "drift".into(),
                signals: vec![name.clone()],
                sentence: format!("`{name}` still moves although nothing drives it"),
                remedy: "let it come to rest, or find what moves it, then go on".into(),
            });
        }
    }
    causes
}

/// Change of the mean of a block that noise alone does not make.
pub(super) fn threshold(sensor: &AtRest) -> f64 {
    // A reading that never changed has the noise of its last digit, which nobody knows: f32's.
    let digit = f64::from(f32::EPSILON) * sensor.mean.abs().max(1e-6);
    let white = sensor.noise / (BLOCK as f64).sqrt();
    5.0 * sensor.wander.max(white).max(digit)
}

pub(super) fn mean(values: &[f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    values.iter().sum::<f64>() / values.len() as f64
}

fn deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (squares / values.len().max(1) as f64).sqrt()
}

/// Slope of the line of least squares.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len().max(1) as f64;
    let (t0, y0) = points.iter().fold((0.0, 0.0), |(t, y), point| {
        (t + point.0 / n, y + point.1 / n)
    });
    let (mut above, mut below) = (0.0, 0.0);
    for (t, y) in points {
        above += (t - t0) * (y - y0);
        below += (t - t0).powi(2);
    }
    if below > 0.0 { above / below } else { 0.0 }
}
