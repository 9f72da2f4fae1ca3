//! The rig with what was found, fitted to whole recordings.

use sinew_sim::{Plant, Rig, Settings};

use super::data::Starts;
use super::finding::Estimate;
use super::model::Point;
use super::name::Known;
use super::race::Tried;
use super::roles::Roles;
use super::search::{Bench, Found};
use crate::error::Result;
use crate::fit::levenberg::Unknowns;
use crate::fit::segment::Segment;
use crate::fit::{FitOptions, fit, score};

/// Steps a stage of the last fit, which begins where the search ended.
const LAST_STEPS: usize = 15;

/// The rig with what was found; its parameters with intervals. Where the search saw the recordings in pieces,
/// the rig is refitted once more to the whole of them if that helps there.
pub(super) fn mend(
    found: &Found,
    index: usize,
    bench: &Bench,
    roles: &Roles,
) -> Result<(Rig, Known)> {
    let best = &found.finalists[index].tried;
    let rig = best.model.with(&best.point.values)?;
    if !bench.in_parts {
        let (point, segments) = whole(best, bench, LAST_STEPS)?;
        let model = best.model.integrated(Settings::default());
        let widths = model.half_widths(bench.fit, &segments, &point);
        let rig = best.model.with(&point.values)?;
        let known = estimates(&rig, |name| widths.get(name).copied())?;
        return Ok((rig, known));
    }
    let options = FitOptions {
        iterations: LAST_STEPS,
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

/// What was found fitted to the whole of the recordings, integrated as a simulation is, from where the search ended; and the
/// recordings as that fit saw them.
pub(super) fn whole(best: &Tried, bench: &Bench, steps: usize) -> Result<(Point, Vec<Segment>)> {
    let model = &best.model.integrated(Settings::default());
    let data = bench.fit;
    let mut segments = data.segments(&model.plant, &data.cut(1))?;
    let values = best.point.values.clone();
    let found = Starts {
        data,
        stretches: &bench.fit_stretches,
        states: &best.point.states,
    };
    let states = data.carried((&model.rig, &model.plant), &values, &segments, found)?;
    let from = Unknowns { values, states };
    let mut point = model
        .improve(data, &mut segments, from, steps, 1e-5)
        .unwrap_or_else(|| best.point.clone());
    super::gauge::settle(model, &best.suspects, &mut point);
    Ok((point, segments))
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
        };
        (parameter.name.clone(), estimate)
    });
    Ok(known.collect())
}

/// Whether the free-run error on the check recordings falls to this part, all sensors together; it does not where
/// the mended rig cannot be simulated.
pub(super) fn falls(before: &Rig, after: &Rig, roles: &Roles, part: f64) -> bool {
    let of = |rig: &Rig| -> Option<f64> {
        let all = score(rig, &roles.check).ok()?;
        let logs = all.iter().map(|s| s.rms.max(f64::MIN_POSITIVE).ln());
        Some(logs.sum::<f64>() / all.len() as f64)
    };
    let both = of(after).zip(of(before));
    both.is_some_and(|(after, before)| after < before + part.ln())
}
