//! One term on top of the rig as it was refitted.

use crate::diagnose::pool::{Pool, Proposal, Selection};
use crate::diagnose::search::context::{Context, Move};
use crate::diagnose::search::refit::screen_and_refit;
use crate::error::Result;

/// Screens every term alone and refits the best to all recordings.
pub(crate) struct Single;

impl Move for Single {
    fn name(&self) -> &'static str {
        "single"
    }

    fn applies(&self, _context: &Context, pool: &Pool) -> bool {
        pool.candidates.is_empty()
    }

    fn propose(&self, context: &Context, _pool: &Pool) -> Result<Option<Proposal>> {
        let Context {
            case,
            subset,
            start,
            terms,
            ..
        } = context;
        let candidates = screen_and_refit(case, subset, start, terms, "one effect")?;
        Ok(Some(Proposal {
            candidates,
            ..Proposal::default()
        }))
    }

    fn selection(&self) -> Selection {
        Selection::Best
    }
}
