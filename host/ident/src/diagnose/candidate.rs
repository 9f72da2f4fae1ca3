//! Candidates: the rig with some terms added, as far as it was fitted, and what it leaves of the
//! recordings.

use crate::diagnose::config::CONFIG;
use sinew_sim::effects::Family;
use sinew_sim::{Parameter, Plant};

use crate::diagnose::model::{Model, Point};
use crate::diagnose::residuals::Residuals;
use crate::diagnose::term::Term;
use crate::fit::local;

/// A rig with some terms in it, as far as it was fitted.
#[derive(Clone)]
pub(crate) struct Trial {
    /// Terms that were added to the baseline rig; empty for that rig itself.
    pub terms: Vec<Term>,
    pub model: Model,
    pub point: Point,
}

/// Tells whether a parameter is that far from what its owner wrote.
pub(crate) fn implausible(value: f64, written: f64) -> bool {
    written != 0.0
        && !(1.0 / CONFIG.model.implausible_change..=CONFIG.model.implausible_change)
            .contains(&(value / written))
}

impl Trial {
    /// Some parameter of the rig itself is far from what its owner wrote.
    pub fn implausible(&self) -> bool {
        let mut own = self.model.own();
        own.any(|(slot, written)| implausible(self.point.values[slot], written))
    }

    /// Values of a plant's parameters, with those of this trial wherever it has a parameter of that
    /// name.
    pub fn values_for(&self, plant: &Plant, values: &[f64]) -> Vec<f64> {
        let value_of = |(parameter, value): (&Parameter, &f64)| {
            let slot = self.model.plant.slot(&parameter.name);
            slot.map_or(*value, |slot| self.point.values[slot])
        };
        plant
            .parameters()
            .iter()
            .zip(values)
            .map(value_of)
            .collect()
    }
}

/// Cost with a fine for every parameter: what the screening is decided by.
pub(crate) fn merit(trial: &Trial) -> f64 {
    trial.point.cost + CONFIG.screening.parameter_cost * trial.model.slots.len() as f64
}

/// An explanation fitted to all of the fit recordings, and what it leaves.
#[derive(Clone)]
pub(crate) struct Candidate {
    pub trial: Trial,
    pub fit: Residuals,
    pub check: Residuals,
    /// Its numbers are what the whole of the fit recordings says, where full refits are fitted to
    /// intervals of them.
    pub all_rows: bool,
}

impl Candidate {
    /// Number of fitted parameters; one that differs by recording counts once for each.
    pub fn parameters(&self) -> usize {
        let (model, roles) = (&self.trial.model, [&self.fit, &self.check]);
        let recordings: usize = roles.iter().map(|role| role.recordings()).sum();
        model.slots.len() + recordings * local::slots(&model.plant).len()
    }

    /// Tells whether it has a coordinate that nobody sees.
    pub fn has_mode(&self) -> bool {
        let mut families = self.trial.terms.iter().map(Term::family);
        families.any(|family| family == Some(Family::Mode))
    }

    /// Terms that it adds to the rig.
    pub fn terms(&self) -> &[Term] {
        &self.trial.terms
    }

    /// Tells whether it adds the same terms as another, in any order.
    pub fn has_terms_of(&self, other: &Self) -> bool {
        self.adds(other.terms())
    }

    /// Tells whether it adds these terms and no other, in any order.
    pub fn adds(&self, terms: &[Term]) -> bool {
        let ours = self.terms();
        ours.len() == terms.len() && ours.iter().all(|term| terms.contains(term))
    }
}

/// The one term of `a` that `b` has not, if it is one.
pub(crate) fn only<'a>(a: &'a Candidate, b: &Candidate) -> Option<&'a Term> {
    let mut of_a = (a.trial.terms.iter()).filter(|s| !b.trial.terms.contains(s));
    of_a.next().filter(|_| of_a.next().is_none())
}

/// Tells whether two candidates may be one finding: they differ by a law of one family in one
/// place, or by one law in two places.
pub(crate) fn same_mechanism(a: &Candidate, b: &Candidate) -> bool {
    let differ = only(a, b).zip(only(b, a));
    differ.is_some_and(|(mine, its)| {
        let family = mine.family().is_some() && mine.family() == its.family();
        family && (mine.has_place_of(its) || mine.kind() == its.kind())
    })
}
