//! Numbers that one explanation found, given to others: each was fitted from where its own race had left it, and a fit ends
//! in the nearest valley (docs/diagnosis.md, "The order of work", 6).

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
    /// The best rivals of as many effects as `best` has, all but one of them the same, refitted from its numbers.
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
        let rivals = self.order(base, finalists).into_iter();
        let rivals: Vec<&Contender> = rivals
            .map(|index| &finalists[index])
            .filter(|rival| rival.tried.suspects.len() == best.tried.suspects.len())
            .filter(|rival| others(rival) == 1)
            .take(RIVALS)
            .collect();
        let leg = self
            .doing("rivals from the best one's numbers")
            .leg("fitted", rivals.len());
        let again = rivals.into_par_iter().map(|rival| {
            let (plant, known) = (&rival.tried.model.plant, &rival.tried.point);
            let from = Unknowns {
                values: taken(plant, &known.values, &best.tried),
                states: known.states.clone(),
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
