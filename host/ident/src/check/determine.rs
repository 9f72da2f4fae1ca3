//! Parameters and effects that recordings determine, before anything is diagnosed: the machinery of
//! `sinew excite` applied to what was recorded.

use serde::Serialize;
use sinew_sim::{Plant, Rig};

use super::refit::is_small;
use crate::excite::Experiment;
use crate::excite::reveal::{REVEALED, WEAKLY, reveal};
use crate::fit::{FitOptions, fit};
use crate::noise::noise_level;
use crate::recording::Recording;

/// Rows of a recording that are simulated.
const ROWS: usize = 1200;

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
    /// noise, in the recording that shows it best; null where it cannot be simulated.
    pub distance: Option<f64>,
    /// `determined`, `weakly` or `not_determined`.
    pub verdict: &'static str,
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
        .map(|recording| recording.rows(0..recording.len().min(ROWS)))
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

/// Effects in one recording, its inputs applied to the fitted rig.
fn effects_of(rig: &Rig, recording: &Recording) -> Option<Vec<Effect>> {
    let plant = Plant::new(rig).ok()?;
    let inputs = plant.inputs().iter().map(|input| {
        let held = recording.held(&input.column, &input.actuator).ok()?;
        let values = held.values.iter();
        Some(values.map(|value| value * input.column_factor).collect())
    });
    let begin = recording.t()[0];
    let experiment = Experiment {
        t: recording.t().iter().map(|t| t - begin).collect(),
        inputs: inputs.collect::<Option<Vec<Vec<f64>>>>()?,
    };
    // The noisiest sensor beside its range.
    let parts = plant.sensors().iter().filter_map(|sensor| {
        let values = recording.column(&sensor.column)?;
        let valid = || values.iter().copied().filter(|value| value.is_finite());
        let high = valid().fold(f64::NEG_INFINITY, f64::max);
        let low = valid().fold(f64::INFINITY, f64::min);
        (high > low).then(|| noise_level(recording.t(), values) / (high - low))
    });
    let noise = parts.fold(0.0, f64::max).clamp(1e-4, 1.0);
    let found = reveal(rig, &experiment, noise, &|_, _| {}).ok()?;
    let effects = found.effects.into_iter().map(|seen| {
        let description = seen.kind.description();
        Effect {
            kind: description.kind,
            component: seen.component,
            distance: seen.distance,
            verdict: match seen.distance {
                Some(distance) if distance >= REVEALED => "determined",
                Some(distance) if distance >= WEAKLY => "weakly",
                _ => "not_determined",
            },
            excited_by: description.excited_by,
        }
    });
    Some(effects.collect())
}
