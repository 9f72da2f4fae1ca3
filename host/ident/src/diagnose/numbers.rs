//! Numbers that one explanation found, given to others: each was fitted from where its own race had left it, and a fit ends
//! in the nearest valley (docs/explanation/diagnosis.md, "The order of work", 6).

use rayon::prelude::*;

use super::evidence::Contender;
use super::race::Tried;
use super::search::{Bench, FINAL_STEPS};
use super::suspect::Suspect;
use crate::error::Result;
use crate::fit::levenberg::Unknowns;

/// How many rivals are fitted once more.
const RIVALS: usize = 4;

/// The rig alone must leave less than this part of what it left before, for its first refit to have stopped short.
const SHORT_OF: f64 = 0.5;

impl Bench<'_> {
    /// The best rivals of as many effects as `best` has, all but one of them the same, and the best ones of fewer, refitted from
    /// its numbers: what two effects do together one may do where they ended.
    pub fn rivals_from(
        &self,
        best: &Contender,
        base: &Contender,
        finalists: &[Contender],
    ) -> Result<Vec<Contender>> {
        let others = |contender: &Contender| {
            let suspects = contender.tried.suspects.iter();
            let other = |suspect: &&Suspect| !best.tried.suspects.contains(suspect);
            suspects.filter(other).count()
        };
        let size = |contender: &Contender| contender.tried.suspects.len();
        // Laws of one family in one place first: they are one another's limits.
        let kin = |a: &Suspect, b: &Suspect| {
            a != b && a.component() == b.component() && a.family() == b.family()
        };
        let of_kin = |contender: &Contender| {
            let mut suspects = contender.tried.suspects.iter();
            suspects.any(|one| best.tried.suspects.iter().any(|other| kin(one, other)))
        };
        let mut ordered = self.order(base, finalists);
        ordered.sort_by_key(|&index| !of_kin(&finalists[index]));
        let ordered = || ordered.iter().map(|&index| &finalists[index]);
        let alike = ordered().filter(|rival| size(rival) == size(best) && others(rival) == 1);
        let fewer = ordered().filter(|rival| size(rival) < size(best));
        let rivals: Vec<&Contender> = alike.take(RIVALS).chain(fewer.take(RIVALS)).collect();
        let leg = self
            .doing("rivals from the best one's numbers")
            .leg("fitted", rivals.len());
        let again = rivals.into_par_iter().map(|rival| {
            let (plant, known) = (&rival.tried.model.plant, &rival.tried.point);
            // What brings no state of its own begins where the best one does.
            let states = [plant, &best.tried.model.plant].map(sinew_sim::Plant::state_len);
            let alike = states == [base.tried.model.plant.state_len(); 2];
            let begins = if alike { &best.tried.point } else { known };
            let from = Unknowns {
                values: taken(plant, &known.values, &best.tried),
                states: begins.states.clone(),
            };
            let again = self.refined(&rival.tried, from, FINAL_STEPS);
            leg.one();
            again
        });
        let again: Vec<Option<Contender>> = again.collect::<Result<_>>()?;
        Ok(again.into_iter().flatten().collect())
    }

    /// The rig alone from the numbers of an explanation, where it leaves much less there than after its own refit.
    pub fn alone_from(
        &self,
        start: &Tried,
        best: &Tried,
        base: &Contender,
    ) -> Result<Option<Contender>> {
        (self.told)("the rig alone from the best one's numbers", 0, 1);
        let values = taken(&start.model.plant, &start.point.values, best);
        let again = self.base_from(start, &values)?;
        Ok(again.filter(|again| self.share_left(again, base) < SHORT_OF))
    }
}

/// These values, with those of another explanation wherever it has a parameter of that name.
fn taken(plant: &sinew_sim::Plant, values: &[f64], from: &Tried) -> Vec<f64> {
    let of = |(parameter, value): (&sinew_sim::Parameter, &f64)| {
        let slot = from.model.plant.slot(&parameter.name);
        slot.map_or(*value, |slot| from.point.values[slot])
    };
    plant.parameters().iter().zip(values).map(of).collect()
}
