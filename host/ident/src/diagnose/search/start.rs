//! Start values of a term: starts without scale, weak and strong, and the few of them that have the
//! lowest predicted cost.

use crate::diagnose::config::CONFIG;
use sinew_sim::Rig;
use sinew_sim::effects::Role;

use crate::diagnose::candidate::Trial;
use crate::diagnose::model::Model;
use crate::diagnose::search::screen::Screen;
use crate::diagnose::search::subset::Subset;
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::fit::levenberg::DecisionVariables;
use crate::fit::local;
use crate::order;
use crate::scales::Run;

/// The starts of a term that have the lowest predicted cost, the best one first: two, and a weak
/// and a strong one among them. From a weak start the way to a strong effect is long, and a strong
/// start promises less than it holds.
pub(crate) fn best_starts(
    subset: &Subset,
    parent: &Trial,
    run: &Run,
    screen: &Screen,
    term: &Term,
) -> Result<Vec<Start>> {
    let mut begun = Vec::new();
    for (start, weak) in starts(run, term)? {
        let mut one = begin(subset, parent, term, &start)?;
        one.predicted_cost = screen.predicted_cost(subset, &one.model, &one.from)?;
        if one.predicted_cost.is_finite() {
            begun.push((one, weak));
        }
    }
    order::sort_up(&mut begun, |(start, _)| start.predicted_cost);
    let first = |wanted: bool| begun.iter().position(|(_, weak)| *weak == wanted);
    let (weak, strong) = (first(true), first(false));
    let kept = |&(at, _): &(usize, Start)| {
        at < CONFIG.screening.starts || Some(at) == weak || Some(at) == strong
    };
    let begun = begun.into_iter().map(|(begun, _)| begun).enumerate();
    Ok(begun.filter(kept).map(|(_, begun)| begun).collect())
}

/// The parent with a term at one start.
pub(crate) fn begin(subset: &Subset, parent: &Trial, term: &Term, start: &[f64]) -> Result<Start> {
    let rig = term.apply(&parent.model.rig, start)?;
    let mut terms = parent.terms.clone();
    terms.push(term.clone());
    let model = Model::new(&rig, subset.written, &terms, subset.settings)?;
    let values = model.inherit(&parent.model.plant, &parent.point.values);
    let states = inherited(subset, parent, &rig, &model, &values)?;
    Ok(Start {
        terms,
        model,
        from: DecisionVariables { values, states },
        predicted_cost: f64::INFINITY,
    })
}

/// Start states of the parent; what the term brings itself begins as a recording shows it.
fn inherited(
    subset: &Subset,
    parent: &Trial,
    rig: &Rig,
    model: &Model,
    values: &[f64],
) -> Result<Vec<Vec<f64>>> {
    let (names, known) = (
        local::state_names(&model.plant),
        local::state_names(&parent.model.plant),
    );
    if names == known {
        return Ok(parent.point.states.clone());
    }
    let segments = subset.data.segments(&model.plant, &subset.intervals)?;
    let mut states = subset.data.starts(rig, &model.plant, &segments, values)?;
    for (index, name) in names.iter().enumerate() {
        if let Some(at) = known.iter().position(|known| known == name) {
            for (state, known) in states.iter_mut().zip(&parent.point.states) {
                state[index] = known[at];
            }
        }
    }
    Ok(states)
}

/// Start values of a term: nowhere in particular for a number, scale-free places for an effect,
/// weak (`true`) and as strong as the port.
fn starts(run: &Run, term: &Term) -> Result<Vec<(Vec<f64>, bool)>> {
    match term.effect() {
        None => Ok(vec![(Vec::new(), false)]),
        Some((kind, sites)) => {
            let each = sites.iter().map(|place| kind.starts(&run.at(place.site)));
            let each: Vec<Vec<Vec<f64>>> = each.collect();
            let count = each.iter().map(Vec::len).min().unwrap_or(0);
            let start = |k: usize| {
                let starts: Vec<&[f64]> = each.iter().map(|starts| &starts[k][..]).collect();
                mean(&starts)
            };
            let starts = (0..count).flat_map(|k| {
                let one = start(k);
                let with = term.with_slopes(&one).into_iter();
                with.map(|one| one.repeat(sites.len())).collect::<Vec<_>>()
            });
            Ok(with_weak(term, starts.collect()))
        }
    }
}

/// Starts at components that are alike as one: the geometric mean of each number's sizes, and the
/// sign of the first.
fn mean(starts: &[&[f64]]) -> Vec<f64> {
    let Some((first, rest)) = starts.split_first() else {
        return Vec::new();
    };
    let of = |(which, value): (usize, &f64)| {
        let ratios = rest.iter().map(|start| (start[which] / value).abs());
        let product: f64 = ratios.product();
        if product.is_finite() && product > 0.0 {
            value * product.powf(1.0 / starts.len() as f64)
        } else {
            *value
        }
    };
    first.iter().enumerate().map(of).collect()
}

/// A term before its first step.
pub(crate) struct Start {
    pub terms: Vec<Term>,
    pub model: Model,
    pub from: DecisionVariables,
    pub predicted_cost: f64,
}

/// The lowest predicted costs, and the lowest of each family: a prediction is no verdict.
pub(crate) fn promising(looked: Vec<Vec<Start>>) -> Vec<Vec<Start>> {
    let mut looked: Vec<Vec<Start>> = looked.into_iter().filter(|l| !l.is_empty()).collect();
    order::sort_up(&mut looked, |starts| starts[0].predicted_cost);
    let mut families = Vec::new();
    let mut kept = Vec::new();
    for begun in looked {
        let family = begun[0].terms.last().and_then(Term::family);
        if kept.len() < CONFIG.screening.refitted || !families.contains(&family) {
            families.push(family);
            kept.push(begun);
        }
    }
    kept
}

/// A start and the same one so weak that the linear theory holds for it (`true`): a start that
/// changes the motion a lot promises nothing, whatever the truth.
fn with_weak(term: &Term, starts: Vec<Vec<f64>>) -> Vec<(Vec<f64>, bool)> {
    let weak = |start: &Vec<f64>| -> Vec<f64> {
        // Of one component after the other.
        let specs = term.specs();
        let specs = specs.iter().cycle();
        specs
            .zip(start)
            .map(|(spec, value)| {
                if spec.role == Role::Strength {
                    CONFIG.screening.weak * value
                } else {
                    *value
                }
            })
            .collect()
    };
    let mut all: Vec<(Vec<f64>, bool)> = Vec::new();
    let weak = starts.iter().map(|start| (weak(start), true));
    for (start, weak) in weak.chain(starts.iter().cloned().map(|start| (start, false))) {
        // Starts that differ in nothing but strength are one once they are weak.
        if !all.iter().any(|(known, _)| *known == start) {
            all.push((start, weak));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::mean;

    #[test]
    fn components_that_are_alike_begin_at_the_mean_of_their_sizes() {
        let near = |of: &[&[f64]], wanted: &[f64]| {
            let found = mean(of);
            assert_eq!(found.len(), wanted.len());
            for (found, wanted) in found.iter().zip(wanted) {
                assert!((found - wanted).abs() < 1e-12, "{found} {wanted}");
            }
        };
        near(&[&[1.0, -2.0], &[4.0, 8.0]], &[2.0, -4.0]);
        near(&[&[0.0, 3.0], &[1.0, 3.0]], &[0.0, 3.0]);
        near(&[&[0.5]], &[0.5]);
        near(&[], &[]);
    }
}
