//! Numbers that one explanation found, given to others: each was fitted from where its own race had left it, and a fit ends
//! in the nearest valley (docs/explanation/diagnosis.md, "The order of work", 6).

use rayon::prelude::*;

use crate::diagnose::candidate::Term;
use crate::diagnose::evidence::Candidate;
use crate::diagnose::search::halving::Trial;
use crate::diagnose::search::{Case, FINAL_STEPS};
use crate::error::Result;
use crate::fit::levenberg::Unknowns;

/// How many rivals are fitted once more.
const RIVALS: usize = 4;

/// The rig alone must leave less than this part of what it left before, for its first refit to have stopped short.
const SHORT_OF: f64 = 0.5;

impl Case<'_> {
    /// The best rivals of as many effects as `best` has, all but one of them the same, and the best ones of fewer, refitted from
    /// its numbers: what two effects do together one may do where they ended.
    pub fn rivals_from(
        &self,
        best: &Candidate,
        base: &Candidate,
        finalists: &[Candidate],
    ) -> Result<Vec<Candidate>> {
        let others = |candidate: &Candidate| {
            let terms = candidate.trial.terms.iter();
            let other = |term: &&Term| !best.trial.terms.contains(term);
            terms.filter(other).count()
        };
        let size = |candidate: &Candidate| candidate.trial.terms.len();
        // Laws of one family in one place first: they are one another's limits.
        let kin = |a: &Term, b: &Term| a != b && a.has_place_of(b) && a.family() == b.family();
        let of_kin = |candidate: &Candidate| {
            let mut terms = candidate.trial.terms.iter();
            terms.any(|one| best.trial.terms.iter().any(|other| kin(one, other)))
        };
        let mut ordered = self.order(base, finalists);
        ordered.sort_by_key(|&index| !of_kin(&finalists[index]));
        let ordered = || ordered.iter().map(|&index| &finalists[index]);
        let alike = ordered().filter(|rival| size(rival) == size(best) && others(rival) == 1);
        let fewer = ordered().filter(|rival| size(rival) < size(best));
        let rivals: Vec<&Candidate> = alike.take(RIVALS).chain(fewer.take(RIVALS)).collect();
        let count = self
            .doing("rivals from the best one's numbers")
            .count("fitted", rivals.len());
        let again = rivals.into_par_iter().map(|rival| {
            let (plant, known) = (&rival.trial.model.plant, &rival.trial.point);
            // What brings no state of its own begins where the best one does.
            let states = [plant, &best.trial.model.plant].map(sinew_sim::Plant::state_len);
            let alike = states == [base.trial.model.plant.state_len(); 2];
            let begins = if alike { &best.trial.point } else { known };
            let from = Unknowns {
                values: taken(plant, &known.values, &best.trial),
                states: begins.states.clone(),
            };
            let again = self.refined(&rival.trial, from, FINAL_STEPS);
            count.one();
            again
        });
        let again: Vec<Option<Candidate>> = again.collect::<Result<_>>()?;
        Ok(again.into_iter().flatten().collect())
    }

    /// The rig alone from the numbers of an explanation, where it leaves much less there than after its own refit.
    pub fn alone_from(
        &self,
        start: &Trial,
        best: &Trial,
        base: &Candidate,
    ) -> Result<Option<Candidate>> {
        (self.progress)("the rig alone from the best one's numbers", 0, 1);
        let values = taken(&start.model.plant, &start.point.values, best);
        let again = self.base_from(start, &values)?;
        Ok(again.filter(|again| self.share_left(again, base) < SHORT_OF))
    }
}

/// These values, with those of another explanation wherever it has a parameter of that name.
fn taken(plant: &sinew_sim::Plant, values: &[f64], from: &Trial) -> Vec<f64> {
    let of = |(parameter, value): (&sinew_sim::Parameter, &f64)| {
        let slot = from.model.plant.slot(&parameter.name);
        slot.map_or(*value, |slot| from.point.values[slot])
    };
    plant.parameters().iter().zip(values).map(of).collect()
}
