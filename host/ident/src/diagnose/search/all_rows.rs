//! Refit to all rows of what was chosen by a part of them (docs/lab/0065-refit-on-all-rows.md).

use crate::diagnose::config::CONFIG;
use std::ops::Range;

use crate::diagnose::acceptance::leaves_something;
use crate::diagnose::candidate::Candidate;
use crate::diagnose::case::Case;
use crate::diagnose::search::refit::with_values;
use crate::diagnose::term::Term;
use crate::diagnose::whole_recordings::whole;
use crate::error::Result;

/// Returns what `best` chooses of the candidates. Full refits of a rig with costly steps are fitted
/// to a part of the rows, and what is chosen at components that are alike has a dozen numbers: what
/// it leaves may be what so few rows left unknown of them. It is chosen, or not, by what all rows
/// say.
///
/// # Errors
/// None that reading the recordings has not excluded.
pub(crate) fn select(
    case: &Case,
    candidates: &mut [Candidate],
    best: impl Fn(&[Candidate]) -> Option<usize>,
) -> Result<Option<usize>> {
    loop {
        let chosen = best(candidates);
        let Some(index) = chosen.filter(|&index| lacks_rows(case, &candidates[index])) else {
            return Ok(chosen);
        };
        (case.progress)("what was chosen, to all rows", 0, 1);
        let trial = &candidates[index].trial;
        let (point, _) = whole(trial, case, CONFIG.refit.all_rows_steps)?;
        if let Some(better) = with_values(case, trial, point.values)? {
            candidates[index] = better;
        }
        candidates[index].all_rows = true;
    }
}

/// Tells whether more rows than it was fitted to may say that it leaves nothing.
fn lacks_rows(case: &Case, chosen: &Candidate) -> bool {
    let rows = |(_, rows): &(usize, Range<usize>)| rows.len();
    let seen: usize = case.fit_intervals.iter().map(rows).sum();
    let mut terms = chosen.trial.terms.iter();
    !chosen.all_rows
        && !case.in_parts
        && seen < case.fit.rows()
        && terms.any(Term::is_group)
        && leaves_something(case, chosen)
}
