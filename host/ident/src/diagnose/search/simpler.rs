//! Simpler laws that the choice of a stopped search may give way to.
//!
//! A richer law leaves as little as the simple one that it contains. A whole search fits both, and
//! the simple one is named. A search whose time is over may have fitted the richer one alone.

use crate::diagnose::candidate::{Candidate, Trial};
use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::pool::{Pool, Proposal};
use crate::diagnose::progress::Progress;
use crate::diagnose::search::context::Context;
use crate::diagnose::search::halving::successive_halving;
use crate::diagnose::search::refit::refit;
use crate::diagnose::search::subset::Subset;
use crate::diagnose::term::Term;
use crate::diagnose::time_budget::TimeBudget;
use crate::error::Result;

/// Adds to the pool the simpler laws of the same family in the place of each chosen one, refitted
/// to all recordings. The time is over, so that the limit does not apply to these few.
///
/// # Errors
/// None that reading the recordings has not excluded.
pub(crate) fn add_simpler(context: &Context, pool: &mut Pool) -> Result<()> {
    let Some(best) = pool.best().cloned() else {
        return Ok(());
    };
    let mut candidates = Vec::new();
    for (at, term) in best.terms().iter().enumerate() {
        let mut others = best.terms().to_vec();
        others.remove(at);
        let untried = |other: &&Term| {
            let terms = [&others[..], std::slice::from_ref(*other)].concat();
            !pool.candidates.iter().any(|known| known.adds(&terms))
        };
        let simpler = context.terms.iter();
        let simpler = simpler.filter(|other| is_simpler(other, term) && other.may_join(&others));
        let simpler: Vec<Term> = simpler.filter(untried).cloned().collect();
        if !simpler.is_empty()
            && let Some(parent) = without(context, &best, &others)?
        {
            candidates.extend(refitted(context.case, &context.subset, &parent, &simpler)?);
        }
    }
    pool.take(Proposal {
        candidates,
        ..Proposal::default()
    });
    Ok(())
}

/// Tells whether a law has fewer parameters than another of its family in the same place.
fn is_simpler(law: &Term, than: &Term) -> bool {
    law.effect().is_some()
        && law.family() == than.family()
        && law.has_place_of(than)
        && law.parameters().len() < than.parameters().len()
}

/// The rig with the other terms of a candidate, from the candidate's own numbers.
fn without(context: &Context, best: &Candidate, others: &[Term]) -> Result<Option<Trial>> {
    let parent = match others {
        [] => Some(context.start.clone()),
        [other] => context
            .subset
            .alone(&context.start, &best.trial, other, 0)?,
        _ => None,
    };
    let (plant, values) = (&best.trial.model.plant, &best.trial.point.values);
    Ok(parent.map(|mut parent| {
        parent.point.values = parent.model.inherit(plant, values);
        parent
    }))
}

/// One screening without a limit of time, every end of it fitted to all recordings.
fn refitted(
    case: &Case,
    subset: &Subset,
    parent: &Trial,
    simpler: &[Term],
) -> Result<Vec<Candidate>> {
    let progress = Progress {
        callback: case.progress,
        what: "simpler laws",
        time: &TimeBudget::default(),
    };
    let mut found = Vec::new();
    for trial in successive_halving(subset, parent, simpler, progress)? {
        found.extend(refit(case, subset, &trial, CONFIG.refit.steps)?);
    }
    Ok(found)
}
