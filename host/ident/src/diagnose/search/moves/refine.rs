//! Finer laws in the place of the single terms that came closest.

use crate::diagnose::acceptance::ranking;
use crate::diagnose::pool::{Pool, Proposal, Selection};
use crate::diagnose::search::context::{Context, Move};
use crate::diagnose::search::moves::swap::near;
use crate::diagnose::search::refit::screen_and_refit;
use crate::diagnose::term::Term;
use crate::error::Result;

/// Candidates in whose place finer laws are tried.
const LEADERS: usize = 3;

/// Screens the refinements that are easily taken for one of the best candidates, in its place.
pub(crate) struct Refine;

impl Move for Refine {
    fn name(&self) -> &'static str {
        "refine"
    }

    fn applies(&self, context: &Context, pool: &Pool) -> bool {
        !context.refinements.is_empty() && !pool.is_explained_plainly(context.case)
    }

    fn propose(&self, context: &Context, pool: &Pool) -> Result<Option<Proposal>> {
        let Context {
            case,
            subset,
            start,
            rig,
            refinements,
            ..
        } = context;
        let order = ranking(case, &pool.baseline, &pool.candidates).into_iter();
        let leaders = order.take(LEADERS).map(|index| &pool.candidates[index]);
        let found: Vec<&Term> = leaders.flat_map(|leader| leader.terms()).collect();
        let finer = |term: &&Term| found.iter().any(|found| near(rig, found, term));
        let finer: Vec<Term> = refinements.iter().filter(finer).cloned().collect();
        if finer.is_empty() {
            return Ok(None);
        }
        Ok(Some(Proposal {
            candidates: screen_and_refit(case, subset, start, &finer, "finer laws")?,
            ..Proposal::default()
        }))
    }

    fn selection(&self) -> Selection {
        Selection::Best
    }
}
