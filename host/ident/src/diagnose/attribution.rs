//! Share of the mismatch that each term of a candidate removes (docs/explanation/diagnosis.md,
//! eq. 7a).

use crate::diagnose::candidate::{Candidate, Trial};
use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::model::Model;
use crate::diagnose::pool::Pool;
use crate::diagnose::search::refit::refit_from;
use crate::diagnose::share::share_left;
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::fit::levenberg::DecisionVariables;

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
pub(crate) fn alone(
    case: &Case,
    from: &Trial,
    base: &Trial,
    terms: &[Term],
) -> Result<Option<Candidate>> {
    alone_from(case, from, base, terms, 0.0)
}

/// As [`alone`]; parameters that the candidate lacks start at `unknown`, SI.
pub(crate) fn alone_from(
    case: &Case,
    from: &Trial,
    base: &Trial,
    terms: &[Term],
    unknown: f64,
) -> Result<Option<Candidate>> {
    let known = from.model.plant.parameters();
    let mut rig = base.model.rig.clone();
    for term in terms {
        let value = |name: &String| {
            let slot = known.iter().position(|parameter| parameter.name == *name);
            slot.map_or(unknown, |slot| from.point.values[slot])
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
