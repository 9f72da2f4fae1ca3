//! Halves of pairs: one of two terms may do alone.

use crate::diagnose::config::CONFIG;

use crate::diagnose::acceptance::ranking;
use crate::diagnose::candidate::{Candidate, Trial};
use crate::diagnose::case::Case;
use crate::diagnose::pool::{Pool, Proposal, Selection};
use crate::diagnose::search::context::{Context, Move};
use crate::diagnose::search::refit::refit;
use crate::diagnose::search::subset::Subset;
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::parallel;

/// Refits the halves of the best pairs alone, each from where its pair ended.
pub(crate) struct DropOne;

impl Move for DropOne {
    fn name(&self) -> &'static str {
        "drop one"
    }

    fn applies(&self, _context: &Context, pool: &Pool) -> bool {
        pool.undivided.is_some()
    }

    fn propose(&self, context: &Context, pool: &Pool) -> Result<Option<Proposal>> {
        let Context {
            case,
            subset,
            start,
            ..
        } = context;
        let Some(pairs) = &pool.undivided else {
            return Ok(None);
        };
        Ok(Some(Proposal {
            candidates: halves(case, subset, start, &pool.baseline, pairs)?,
            ..Proposal::default()
        }))
    }

    fn selection(&self) -> Selection {
        Selection::BestBySize
    }
}

/// The halves of the best pairs, each from where its pair ended: where a single effect was not
/// found because the way to it was too long, another has paved it.
pub(crate) fn halves(
    case: &Case,
    subset: &Subset,
    start: &Trial,
    base: &Candidate,
    pairs: &[Candidate],
) -> Result<Vec<Candidate>> {
    let order = ranking(case, base, pairs)
        .into_iter()
        .take(CONFIG.pair.halved);
    let halves: Vec<(&Trial, &Term)> = order
        .map(|index| &pairs[index].trial)
        .flat_map(|pair| pair.terms.iter().map(move |term| (pair, term)))
        .collect();
    let count = case
        .progress_of("halves of pairs")
        .count("fitted", halves.len());
    let halves = parallel::try_map(&halves, |(pair, term)| {
        if case.time.is_spent() {
            return Ok(None);
        }
        let half = subset.alone(start, pair, term, CONFIG.screening.more_steps)?;
        let half = half.map(|half| refit(case, subset, &half, CONFIG.refit.steps));
        count.one();
        half.transpose().map(Option::flatten)
    })?;
    Ok(halves.into_iter().flatten().collect())
}
