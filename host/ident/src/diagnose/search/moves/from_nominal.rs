//! One term on top of the rig with its nominal values.

use crate::diagnose::pool::{Pool, Proposal, Selection};
use crate::diagnose::search::context::{Context, Move};
use crate::diagnose::search::refit::screen_and_refit;
use crate::error::Result;

/// Screens every term again from what the owner wrote: without the effect the parameters were
/// fitted to make up for it, and the way back may be too long.
pub(crate) struct FromNominal;

impl Move for FromNominal {
    fn name(&self) -> &'static str {
        "from nominal"
    }

    fn applies(&self, context: &Context, pool: &Pool) -> bool {
        !pool.is_explained_plainly(context.case)
    }

    fn propose(&self, context: &Context, _pool: &Pool) -> Result<Option<Proposal>> {
        let Context {
            case,
            subset,
            terms,
            ..
        } = context;
        let candidates = match subset.as_written(context.rig)? {
            Some(nominal) => screen_and_refit(case, subset, &nominal, terms, "one effect")?,
            None => Vec::new(),
        };
        Ok(Some(Proposal {
            candidates,
            ..Proposal::default()
        }))
    }

    fn selection(&self) -> Selection {
        Selection::Best
    }
}
