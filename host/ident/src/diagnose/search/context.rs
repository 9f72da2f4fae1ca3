//! A move and what it sees of the search.

use sinew_sim::Rig;

use crate::diagnose::candidate::Trial;
use crate::diagnose::case::Case;
use crate::diagnose::pool::{Pool, Proposal, Selection};
use crate::diagnose::search::subset::Subset;
use crate::diagnose::term::Term;
use crate::error::Result;

/// State that all moves of a search share.
pub(crate) struct Context<'a> {
    /// The recordings.
    pub case: &'a Case<'a>,
    /// Part of them on which terms are screened.
    pub subset: Subset<'a>,
    /// The rig alone, fitted to that part.
    pub start: Trial,
    /// The refitted rig.
    pub rig: &'a Rig,
    /// Terms that may be missing from it.
    pub terms: Vec<Term>,
    /// Terms that are tried in the place of those that are easily taken for them, and nowhere else.
    pub refinements: Vec<Term>,
}

/// One way of finding better candidates than those of the pool.
pub(crate) trait Move: Sync {
    /// Name of the move.
    fn name(&self) -> &'static str;

    /// Tells whether the move may improve the pool.
    fn applies(&self, context: &Context, pool: &Pool) -> bool;

    /// Candidates fitted to all recordings; `None` where the pool and its choice shall stay as they
    /// are.
    ///
    /// # Errors
    /// None that reading the recordings has not excluded.
    fn propose(&self, context: &Context, pool: &Pool) -> Result<Option<Proposal>>;

    /// Rule by which a candidate is chosen after the move.
    fn selection(&self) -> Selection;

    /// Number of times that the move is made while it makes another candidate the best.
    fn rounds(&self) -> usize {
        1
    }
}
