//! The rig with what was found, fitted to whole recordings.

use crate::diagnose::config::CONFIG;
use sinew_sim::{Plant, Rig, SimulationSettings};

use crate::diagnose::calibration::Known;
use crate::diagnose::case::Case;
use crate::diagnose::finding::Estimate;
use crate::diagnose::pool::Pool;
use crate::diagnose::split::Roles;
use crate::diagnose::whole_recordings::whole;
use crate::error::Result;
use crate::fit::{FitOptions, fit, score};
use crate::recording::Recording;

/// The rig with what was found; its parameters with intervals. Where the search saw the recordings
/// in pieces, the rig is refitted once more to the whole of them if that helps there.
pub(crate) fn correct(
    found: &Pool,
    index: usize,
    case: &Case,
    roles: &Roles,
) -> Result<(Rig, Known)> {
    let best = &found.candidates[index].trial;
    let rig = best.model.with(&best.point.values)?;
    if !case.in_parts {
        let (point, segments) = whole(best, case, CONFIG.refit.corrected_steps)?;
        let model = best.model.integrated(SimulationSettings::default());
        let widths = model.half_widths(case.fit, &segments, &point);
        let rig = best.model.with(&point.values)?;
        let known = estimates(&rig, |name| widths.get(name).copied())?;
        return Ok((rig, known));
    }
    let options = FitOptions {
        iterations: CONFIG.refit.corrected_steps,
        ..FitOptions::default()
    };
    let Ok(last) = fit(&rig, &roles.fit, &options, &mut |_| {}) else {
        return Ok((rig.clone(), estimates(&rig, |_| None)?));
    };
    let error = |rig: &Rig| -> Result<f64> {
        let all = score(rig, &roles.fit)?;
        Ok(all.iter().map(|s| s.rms.max(f64::MIN_POSITIVE).ln()).sum())
    };
    let width = |name: &str| {
        let [low, high] = last.parameters.iter().find(|p| p.name == name)?.ci95?;
        Some(0.5 * (high - low))
    };
    let better = error(&last.rig)? <= error(&rig)?;
    let rig = if better { last.rig.clone() } else { rig };
    let known = estimates(&rig, width)?;
    Ok((rig, known))
}

/// Values of a rig's parameters, with intervals of these half widths.
fn estimates(rig: &Rig, width: impl Fn(&str) -> Option<f64>) -> Result<Known> {
    let plant = Plant::new(rig)?;
    let known = plant.parameters().iter().map(|parameter| {
        let value = parameter.value;
        let estimate = Estimate {
            value,
            unit: parameter.unit.clone(),
            ci95: width(&parameter.name).map(|half| [value - half, value + half]),
            recordings: Vec::new(),
        };
        (parameter.name.clone(), estimate)
    });
    Ok(known.collect())
}

/// Names of the recordings of all roles on which the corrected model's free runs are worse than
/// those of the refitted one, all sensors together.
///
/// # Errors
/// A rig that cannot be compiled.
pub(crate) fn worse_on(before: &Rig, after: &Rig, roles: &Roles) -> Result<Vec<String>> {
    let error = |rig: &Rig, recording: &Recording| -> Result<f64> {
        let all = score(rig, std::slice::from_ref(recording))?;
        let parts = all.iter().filter(|s| s.spread > 0.0);
        Ok(parts
            .map(|s| (s.rms / s.spread).powi(2))
            .sum::<f64>()
            .sqrt())
    };
    let mut worse = Vec::new();
    for recording in roles.fit.iter().chain(&roles.check).chain(&roles.test) {
        let (before, after) = (error(before, recording)?, error(after, recording)?);
        if after.is_nan() || after > CONFIG.acceptance.no_worse * before {
            worse.push(recording.name());
        }
    }
    worse.dedup();
    Ok(worse)
}

/// Tells whether the free-run error on these recordings falls to this part, all sensors together;
/// it does not where the corrected model cannot be simulated.
pub(crate) fn falls(before: &Rig, after: &Rig, recordings: &[Recording], part: f64) -> bool {
    let of = |rig: &Rig| -> Option<f64> {
        let all = score(rig, recordings).ok()?;
        let logs = all.iter().map(|s| s.rms.max(f64::MIN_POSITIVE).ln());
        Some(logs.sum::<f64>() / all.len() as f64)
    };
    let both = of(after).zip(of(before));
    both.is_some_and(|(after, before)| after < before + part.ln())
}
