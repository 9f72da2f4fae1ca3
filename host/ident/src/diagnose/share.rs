//! Mismatch that an explanation removes on the check recordings, and what it leaves
//! (docs/explanation/diagnosis.md, eq. 7a).

use std::ops::Range;

use crate::diagnose::acceptance::only;
use crate::diagnose::candidate::{Candidate, Trial};
use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::data::Data;
use crate::diagnose::model::Model;
use crate::diagnose::pool::Pool;
use crate::diagnose::residuals::Residuals;
use crate::diagnose::search::refit::refit_from;
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::fit::levenberg::DecisionVariables;

/// Squares beside noise, of all sensors, each in its spread.
pub(crate) fn beside_noise(residuals: &Residuals, data: &Data) -> f64 {
    let excess = residuals.excess(data).into_iter().enumerate();
    excess.map(|(s, e)| (e.rms / data.spread[s]).powi(2)).sum()
}

/// The part of what `before` left beside noise on the check recordings that `after` still leaves: 0
/// is all explained.
pub(crate) fn share_left(case: &Case, after: &Candidate, before: &Candidate) -> f64 {
    let left = |candidate: &Candidate| beside_noise(&candidate.check, case.check);
    part(left(after), left(before))
}

/// The same on the recordings that they were fitted to.
pub(crate) fn share_fitted(case: &Case, after: &Candidate, before: &Candidate) -> f64 {
    let left = |candidate: &Candidate| beside_noise(&candidate.fit, case.fit);
    part(left(after), left(before))
}

/// The part that `after` is of `before`, at most all of it; nothing where there was nothing.
fn part(after: f64, before: f64) -> f64 {
    if before > 0.0 {
        (after / before).min(1.0)
    } else {
        0.0
    }
}

/// Share of each term of a candidate: the part that it removes of what the others leave without it.
///
/// # Errors
/// None that reading the recordings has not excluded.
pub(crate) fn shares(found: &Pool, index: usize, case: &Case) -> Result<Vec<f64>> {
    let all = &found.candidates[index];
    let without = |at: usize| -> Result<f64> {
        let mut others = all.terms().to_vec();
        others.remove(at);
        if others.is_empty() {
            return Ok(share_left(case, all, &found.baseline));
        }
        let of = |known: &&Candidate| {
            let terms = known.terms();
            terms.len() == others.len() && others.iter().all(|term| terms.contains(term))
        };
        let out = found.refuted.iter().map(|(candidate, _)| candidate);
        let known = found.candidates.iter().chain(out).find(of);
        let again = match known {
            Some(known) => Some(known.clone()),
            None => alone(case, &all.trial, &found.baseline.trial, &others)?,
        };
        let before = again.as_ref().unwrap_or(&found.baseline);
        Ok(share_left(case, all, before))
    };
    let left = (0..all.terms().len()).map(without);
    left.map(|left| Ok(1.0 - left?)).collect()
}

/// The rig with these terms alone, from the numbers of a candidate that has more.
fn alone(case: &Case, from: &Trial, base: &Trial, terms: &[Term]) -> Result<Option<Candidate>> {
    let known = from.model.plant.parameters();
    let mut rig = base.model.rig.clone();
    for term in terms {
        let value = |name: &String| {
            let slot = known.iter().position(|parameter| parameter.name == *name);
            slot.map_or(0.0, |slot| from.point.values[slot])
        };
        let values: Vec<f64> = term.parameters().iter().map(value).collect();
        rig = term.apply(&rig, &values)?;
    }
    let model = Model::new(&rig, case.written, terms, case.settings)?;
    let values = model.inherit(&from.model.plant, &from.point.values);
    let segments = case.fit.segments(&model.plant, &case.fit_intervals)?;
    let states = (case.fit).starts(&rig, &model.plant, &segments, &values)?;
    let begun = DecisionVariables { values, states };
    let trial = Trial {
        terms: terms.to_vec(),
        point: from.point.clone(),
        model,
    };
    refit_from(case, &trial, begun, CONFIG.refit.steps)
}

/// Root mean square of what a candidate leaves beside noise on the check recordings, in the noise
/// of each sensor.
pub(crate) fn above_noise(case: &Case, candidate: &Candidate) -> f64 {
    let excess = candidate.check.excess(case.check).into_iter();
    let squares: Vec<f64> = excess
        .zip(&case.check.sigma)
        .map(|(e, sigma)| (e.rms / sigma).powi(2))
        .collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// Tells whether an explanation makes some recording worse, over the intervals that are judged.
pub(crate) fn spoils_a_recording(case: &Case, after: &Candidate, before: &Candidate) -> bool {
    spoils(case.fit, &case.fit_intervals, [&after.fit, &before.fit])
        || spoils(
            case.check,
            &case.check_intervals,
            [&after.check, &before.check],
        )
}

/// The same of the recordings of one role: residuals after and before.
pub(crate) fn spoils(
    data: &Data,
    intervals: &[(usize, Range<usize>)],
    [after, before]: [&Residuals; 2],
) -> bool {
    let sensors = 0..data.spread.len();
    let least: f64 = (sensors.clone())
        .map(|s| (0.1 * data.noise[s] / data.spread[s] + 1e-3).powi(2))
        .sum();
    let squares = |residuals: &Residuals, recording: usize| -> f64 {
        let of = |sensor: usize| {
            let parts = residuals.series[sensor].iter().zip(intervals);
            let own = parts.filter(|(_, (index, _))| *index == recording);
            let own: Vec<f64> = own.flat_map(|(part, _)| part.iter().copied()).collect();
            let squares: f64 = own.iter().map(|r| r * r).sum();
            squares / own.len().max(1) as f64 / data.spread[sensor].powi(2)
        };
        sensors.clone().map(of).sum()
    };
    (0..data.experiments.len()).any(|recording| {
        let (after, before) = (squares(after, recording), squares(before, recording));
        after > CONFIG.acceptance.spoilt.powi(2) * before && after - before > least
    })
}

/// Tells whether two candidates may be one finding: they differ by a law of one family in one
/// place, or by one law in two places.
pub(crate) fn kin(a: &Candidate, b: &Candidate) -> bool {
    let differ = only(a, b).zip(only(b, a));
    differ.is_some_and(|(mine, its)| {
        let family = mine.family().is_some() && mine.family() == its.family();
        family && (mine.has_place_of(its) || mine.kind() == its.kind())
    })
}
