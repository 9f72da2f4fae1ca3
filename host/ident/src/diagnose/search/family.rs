//! Laws of one family in one place: where the best of a screening is one of them, the others begin
//! where it ended. Of two that nearly agree the other may end in another local minimum,
//! from starts without scale (docs/explanation/diagnosis.md, "Moves").

use crate::diagnose::config::CONFIG;
use sinew_sim::effects::{Kind, Quantity};

use crate::diagnose::candidate::{Trial, merit};
use crate::diagnose::search::start::{Start, begin};
use crate::diagnose::search::subset::Subset;
use crate::diagnose::term::Term;
use crate::error::Result;

/// Laws of the family of the best of a screening among `terms`, before their first step from where
/// it ended; `parent` is the rig that was screened. Those in `known` that came as close as
/// `CONFIG.screening.same_family` are not begun again.
pub(crate) fn same_family(
    subset: &Subset,
    parent: &Trial,
    known: &[Trial],
    terms: &[Term],
) -> Result<Vec<Vec<Start>>> {
    let Some(best) = known.iter().min_by(|a, b| merit(a).total_cmp(&merit(b))) else {
        return Ok(Vec::new());
    };
    let Some((newest, size)) = (best.terms.last()).and_then(|newest| sized(newest, best)) else {
        return Ok(Vec::new());
    };
    let near = |term: &Term| {
        let mut ends = known.iter().filter(|t| t.terms.last() == Some(term));
        ends.any(|trial| trial.point.cost < CONFIG.screening.same_family * best.point.cost)
    };
    let others = terms.iter().filter(|term| {
        let same = term.family() == newest.family() && term.has_place_of(newest) && *term != newest;
        same && !near(term)
    });
    let mut ended = parent.clone();
    let plant = &best.model.plant;
    ended.point.values = ended.model.inherit(plant, &best.point.values);
    if plant.state_len() == ended.model.plant.state_len() {
        ended.point.states.clone_from(&best.point.states);
    }
    // Without what held it, the rig may run away from there.
    let Ok(run) = subset.run(&ended) else {
        return Ok(Vec::new());
    };
    let mut begun = Vec::new();
    for term in others {
        let Some((kind, place)) = term.single() else {
            continue;
        };
        let starts = kind.starts(&run.at(place.site)).into_iter();
        let starts = starts.filter_map(|start| resized(kind, start, size));
        let starts: Vec<Start> = starts
            .filter_map(|start| begin(subset, &ended, term, &start).ok())
            .collect();
        if !starts.is_empty() {
            begun.push(starts);
        }
    }
    Ok(begun)
}

/// An effect and the mean size of its forces where it was fitted; `None` of one that has no forces.
fn sized<'s>(term: &'s Term, trial: &Trial) -> Option<(&'s Term, f64)> {
    let (kind, _) = term.single()?;
    let plant = &trial.model.plant;
    let names = term.parameters();
    let values: Option<Vec<f64>> = names
        .iter()
        .map(|name| plant.slot(name).map(|slot| trial.point.values[slot]))
        .collect();
    mean_force(kind, &values?).map(|size| (term, size))
}

/// A start with forces of that mean size instead; `None` of an effect that has no forces.
fn resized(kind: Kind, mut start: Vec<f64>, size: f64) -> Option<Vec<f64>> {
    let factor = size / mean_force(kind, &start)?;
    let specs = kind.description().parameters.iter();
    for (value, spec) in start.iter_mut().zip(specs) {
        if spec.quantity == Quantity::Force {
            *value *= factor;
        }
    }
    factor.is_finite().then_some(start)
}

/// The mean size of an effect's forces.
fn mean_force(kind: Kind, values: &[f64]) -> Option<f64> {
    let specs = kind.description().parameters.iter();
    let forces = values.iter().zip(specs);
    let forces = forces.filter(|(_, spec)| spec.quantity == Quantity::Force);
    let forces: Vec<f64> = forces.map(|(value, _)| value.abs()).collect();
    (!forces.is_empty()).then(|| forces.iter().sum::<f64>() / forces.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_start_takes_the_size_of_another_laws_forces_and_keeps_its_shape() {
        let kind = |name| Kind::named(name).expect("the effect is in the vocabulary");
        let stribeck = resized(kind("stribeck_friction"), vec![0.1, 0.2, 3.0], 6.0);
        let stribeck = stribeck.expect("the term has forces");
        for (found, wanted) in stribeck.iter().zip([4.0, 8.0, 3.0]) {
            assert!((found - wanted).abs() < 1e-12, "{found} {wanted}");
        }
        assert!(resized(kind("cubic_stiffness"), vec![1.0], 6.0).is_none());
        assert!(resized(kind("coulomb_friction"), vec![0.0], 6.0).is_none());
    }
}
