//! Parameters and effects that recordings determine, before anything is diagnosed: the machinery of
//! `sinew excite` applied to what was recorded.

use serde::Serialize;
use sinew_sim::{Plant, Rig};

use super::refitted::is_small;
use crate::excite::Experiment;
use crate::excite::reveal::{Visibility, reveal};
use crate::fit::{FitOptions, fit};
use crate::noise::noise_level;
use crate::recording::Recording;

/// Rows of a recording that are simulated, where every sensor has [`READINGS`] in them.
const ROWS: usize = 1200;

/// Most rows that are simulated of a recording with few readings.
const MOST_ROWS: usize = 12_000;

/// Readings of a sensor that are as good as all of them.
const READINGS: usize = 300;

/// Fewest readings that tell noise from motion.
const FEWEST_READINGS: usize = 20;

/// Parameters and effects beside what recordings say of them.
#[derive(Debug, Clone, Serialize)]
pub struct Determined {
    /// The rig's free parameters.
    pub parameters: Vec<Parameter>,
    /// Every effect of the vocabulary at every place.
    pub effects: Vec<Effect>,
}

/// A free parameter, fitted.
#[derive(Debug, Clone, Serialize)]
pub struct Parameter {
    /// `mass.inertia`.
    pub name: String,
    /// SI.
    pub unit: String,
    /// Fitted value; the rig's where the recordings do not determine it.
    pub value: f64,
    /// 95 % interval; null where the recordings do not determine it.
    pub ci95: Option<[f64; 2]>,
}

/// An effect that might be missing.
#[derive(Debug, Clone, Serialize)]
pub struct Effect {
    /// Its name in the vocabulary.
    pub kind: &'static str,
    /// Component where it would sit.
    pub component: String,
    /// Distance of its signals from all that the rig could imitate, in standard deviations of the
    /// noise, in the recording that shows it best; null where it cannot be simulated, or where the
    /// readings are too few.
    pub distance: Option<f64>,
    /// Grade of the distance.
    pub verdict: Visibility,
    /// Motion that would show it.
    pub excited_by: &'static str,
}

/// Parameters and effects that recordings determine of a small rig; `None` for a large one, and
/// where it cannot be fitted.
pub fn determine(rig: &Rig, recordings: &[Recording]) -> Option<Determined> {
    if !is_small(rig) {
        return None;
    }
    let parts: Vec<Recording> = (recordings.iter())
        .map(|recording| recording.rows(0..rows_of(rig, recording)))
        .collect::<crate::error::Result<_>>()
        .ok()?;
    let fitted = fit(rig, &parts, &FitOptions::default(), &mut |_| {}).ok()?;
    let mut effects: Vec<Effect> = Vec::new();
    for part in &parts {
        for here in effects_of(&fitted.rig, part)? {
            let known = effects
                .iter_mut()
                .find(|known| known.kind == here.kind && known.component == here.component);
            match known {
                None => effects.push(here),
                Some(known) if here.distance > known.distance => *known = here,
                Some(_) => {}
            }
        }
    }
    // A law beside a rig of which nothing is known can follow anything: it is a guess.
    let known = fitted.parameters.iter().any(|p| p.ci95.is_some());
    if !known && !fitted.parameters.is_empty() {
        for effect in &mut effects {
            if effect.verdict == Visibility::Determined {
                effect.verdict = Visibility::Weakly;
            }
        }
    }
    let parameters = fitted.parameters.into_iter().map(|found| Parameter {
        name: found.name,
        unit: found.unit,
        value: found.value,
        ci95: found.ci95,
    });
    Some(Determined {
        parameters: parameters.collect(),
        effects,
    })
}

/// First rows of a recording that hold enough readings of every sensor.
fn rows_of(rig: &Rig, recording: &Recording) -> usize {
    let enough = |column: &str| {
        let values = recording.column(column).unwrap_or_default();
        let valid = values.iter().enumerate().filter(|(_, y)| y.is_finite());
        let mut rows = valid.map(|(row, _)| row + 1);
        rows.nth(READINGS - 1).unwrap_or(recording.len())
    };
    let sensors = rig.sensors.iter().map(|sensor| enough(&sensor.signal));
    let wanted = sensors.max().unwrap_or(ROWS);
    wanted.clamp(ROWS, MOST_ROWS).min(recording.len())
}

/// Noise of a sensor over its range, as if every row had a reading: of few readings each says as
/// much less. Infinite where they are too few to tell noise from motion; `None` of a sensor that
/// never changes.
fn noise_over_range(recording: &Recording, values: &[f64]) -> Option<f64> {
    let rows = recording.t().iter().zip(values);
    let (t, valid): (Vec<f64>, Vec<f64>) = rows.filter(|(_, y)| y.is_finite()).unzip();
    let high = valid.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let low = valid.iter().copied().fold(f64::INFINITY, f64::min);
    if valid.len() < FEWEST_READINGS {
        return Some(f64::INFINITY);
    }
    let thinned = (values.len() as f64 / valid.len() as f64).sqrt();
    (high > low).then(|| thinned * noise_level(&t, &valid) / (high - low))
}

/// Effects in one recording, its inputs applied to the fitted rig.
fn effects_of(rig: &Rig, recording: &Recording) -> Option<Vec<Effect>> {
    let plant = Plant::new(rig).ok()?;
    let inputs = plant
        .inputs()
        .iter()
        .map(|input| Some(recording.input(input).ok()?.values));
    let begin = recording.t()[0];
    let experiment = Experiment {
        t: recording.t().iter().map(|t| t - begin).collect(),
        inputs: inputs.collect::<Option<Vec<Vec<f64>>>>()?,
    };
    // The noisiest sensor beside its range.
    let parts = plant
        .sensors()
        .iter()
        .filter_map(|sensor| noise_over_range(recording, recording.column(&sensor.column)?));
    let noise = parts.fold(0.0, f64::max);
    let found = reveal(rig, &experiment, noise.clamp(1e-4, 1.0), &|_, _| {}).ok()?;
    let effects = found.effects.into_iter().map(|seen| {
        let description = seen.kind.description();
        let distance = seen.distance.filter(|_| noise.is_finite());
        Effect {
            kind: description.kind,
            component: seen.component,
            distance,
            verdict: Visibility::of(distance),
            excited_by: description.excited_by,
        }
    });
    Some(effects.collect())
}
