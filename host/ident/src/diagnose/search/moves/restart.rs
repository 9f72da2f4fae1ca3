//! Numbers that one explanation found, given to others: each was fitted from where its own
//! screening had left it, and a fit ends in the nearest local minimum
//! (docs/explanation/diagnosis.md, "Moves").

use crate::diagnose::config::CONFIG;

use crate::diagnose::acceptance::ranking;
use crate::diagnose::candidate::Candidate;
use crate::diagnose::case::Case;
use crate::diagnose::pool::{Pool, Proposal, Selection};
use crate::diagnose::search::context::{Context, Move};
use crate::diagnose::search::refit::refit_from;
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::fit::levenberg::DecisionVariables;
use crate::parallel;

/// Refits alternatives from the numbers of the best candidate: a fit ends in the nearest local
/// minimum.
pub(crate) struct Restart;

impl Move for Restart {
    fn name(&self) -> &'static str {
        "restart"
    }

    fn applies(&self, context: &Context, pool: &Pool) -> bool {
        context.case.has_rows_for_two() && pool.chosen.is_some()
    }

    fn propose(&self, context: &Context, pool: &Pool) -> Result<Option<Proposal>> {
        let Some(best) = pool.best() else {
            return Ok(None);
        };
        Ok(Some(Proposal {
            candidates: restarted(context.case, best, &pool.baseline, &pool.candidates)?,
            ..Proposal::default()
        }))
    }

    fn selection(&self) -> Selection {
        Selection::BestBySize
    }

    fn rounds(&self) -> usize {
        CONFIG.restart.rounds
    }
}

/// The best rivals of as many effects as `best` has, all but one of them the same, and the best
/// ones of fewer, refitted from its numbers: what two effects do together one may do where they
/// ended.
pub(crate) fn restarted(
    case: &Case,
    best: &Candidate,
    base: &Candidate,
    candidates: &[Candidate],
) -> Result<Vec<Candidate>> {
    let others = |candidate: &Candidate| {
        let terms = candidate.trial.terms.iter();
        let other = |term: &&Term| !best.trial.terms.contains(term);
        terms.filter(other).count()
    };
    let size = |candidate: &Candidate| candidate.trial.terms.len();
    // Laws of one family in one place first: they are one another's limits.
    let same_family = |a: &Term, b: &Term| a != b && a.has_place_of(b) && a.family() == b.family();
    let is_alternative = |candidate: &Candidate| {
        let mut terms = candidate.trial.terms.iter();
        terms.any(|one| best.trial.terms.iter().any(|other| same_family(one, other)))
    };
    let mut ordered = ranking(case, base, candidates);
    ordered.sort_by_key(|&index| !is_alternative(&candidates[index]));
    let ordered = || ordered.iter().map(|&index| &candidates[index]);
    let alike = ordered().filter(|rival| size(rival) == size(best) && others(rival) == 1);
    let fewer = ordered().filter(|rival| size(rival) < size(best));
    let rivals: Vec<&Candidate> = alike
        .take(CONFIG.restart.alternatives)
        .chain(fewer.take(CONFIG.restart.alternatives))
        .collect();
    let count = case
        .progress_of("rivals from the best one's numbers")
        .count("fitted", rivals.len());
    let again = parallel::try_map(&rivals, |rival| {
        if case.time.is_spent() {
            return Ok(None);
        }
        let (plant, known) = (&rival.trial.model.plant, &rival.trial.point);
        // What brings no state of its own begins where the best one does.
        let states = [plant, &best.trial.model.plant].map(sinew_sim::Plant::state_len);
        let alike = states == [base.trial.model.plant.state_len(); 2];
        let begins = if alike { &best.trial.point } else { known };
        let values = best.trial.values_for(plant, &known.values);
        let from = DecisionVariables {
            values: rival.trial.model.with_bare(values),
            states: begins.states.clone(),
        };
        let again = refit_from(case, &rival.trial, from, CONFIG.refit.steps);
        count.one();
        again
    })?;
    Ok(again.into_iter().flatten().collect())
}
