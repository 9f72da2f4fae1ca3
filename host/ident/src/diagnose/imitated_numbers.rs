//! Bare numbers of a rig that an effect imitates. An offset of a sensor, the rest of a spring and
//! the angle at which a weight hangs look like loads; they are zero where nobody wrote them. A
//! wrong damping looks like one that is missing. They are tried once such an effect is named, and
//! the zeros where nothing is.

use sinew_sim::effects::Family;
use sinew_sim::{Meaning, Plant, Rig};

use crate::diagnose::acceptance::{best_acceptable_of, leaves_something};
use crate::diagnose::attribution::alone;
use crate::diagnose::candidate::{Candidate, Trial};
use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::finding::{FoundEffect, WRONG_NUMBER};
use crate::diagnose::one_way::one_way;
use crate::diagnose::pool::Pool;
use crate::diagnose::share::share_left;
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::parallel;

/// Names of the bare numbers of a rig that have this meaning.
fn bare(rig: &Rig, meaning: Meaning, may: impl Fn(f64) -> bool) -> Result<Vec<String>> {
    let plant = Plant::new(rig)?;
    let bare = plant.parameters().iter().filter(|parameter| {
        !parameter.free && parameter.meaning == meaning && may(parameter.value)
    });
    Ok(bare.map(|parameter| parameter.name.clone()).collect())
}

/// Bare zeros of the rig.
fn zeros(case: &Case) -> Result<Vec<String>> {
    bare(case.written, Meaning::Zero, |value| value == 0.0)
}

/// Bare numbers that move the rig as an effect of this family may.
fn imitators(case: &Case, family: Option<Family>) -> Result<Vec<String>> {
    match family {
        Some(Family::Load) => zeros(case),
        Some(Family::Damping) => bare(case.written, Meaning::Damping, |_| true),
        _ => Ok(Vec::new()),
    }
}

/// Candidates with each of these bare numbers beside some terms, fitted from a trial, but those
/// that the pool has.
fn candidates(
    found: &Pool,
    case: &Case,
    from: &Trial,
    (names, others): (Vec<String>, &[Term]),
) -> Result<Vec<Candidate>> {
    if case.time.is_spent() {
        return Ok(Vec::new());
    }
    let with = |name: &String| {
        let mut terms = others.to_vec();
        terms.push(Term::Number { name: name.clone() });
        if found.candidates.iter().any(|known| known.adds(&terms)) {
            return Ok(None);
        }
        alone(case, from, &found.baseline.trial, &terms)
    };
    let tried = parallel::try_map(&names, with)?;
    Ok(tried.into_iter().flatten().collect())
}

/// Adds candidates to the pool; the search has given the evidence to others.
fn add(found: &mut Pool, candidates: Vec<Candidate>) {
    let none = std::iter::repeat_n(0.0, candidates.len());
    found.probabilities.extend(none);
    found.candidates.extend(candidates);
}

/// Adds the bare numbers that may stand in the place of a load or a damping that is named.
///
/// # Errors
/// None that reading the recordings has not excluded.
pub(crate) fn beside_named(found: &mut Pool, index: usize, case: &Case) -> Result<()> {
    let named = found.candidates[index].trial.clone();
    for (at, term) in named.terms.iter().enumerate() {
        let mut others = named.terms.clone();
        others.remove(at);
        let names = imitators(case, term.family())?;
        let more = candidates(found, case, &named, (names, &others))?;
        add(found, more);
    }
    Ok(())
}

/// Chooses the bare number that explains the recordings, where nothing was named: what moves as it
/// does had taken its evidence.
///
/// # Errors
/// None that reading the recordings has not excluded.
pub(crate) fn try_single(found: &mut Pool, case: &Case) -> Result<()> {
    let nothing = !leaves_something(case, &found.baseline);
    if found.chosen.is_some() || nothing || one_way(case) {
        return Ok(());
    }
    let start = found.baseline.trial.clone();
    let more = candidates(found, case, &start, (zeros(case)?, &[]))?;
    add(found, more);
    let is_number = |candidate: &Candidate| matches!(candidate.terms(), [Term::Number { .. }]);
    let all = &found.candidates;
    let best = best_acceptable_of(case, &found.baseline, all, |index| is_number(&all[index]));
    found.chosen = best.filter(|&index| {
        let left = share_left(case, &all[index], &found.baseline);
        !leaves_something(case, &all[index]) || left < CONFIG.acceptance.nearly
    });
    Ok(())
}

/// Finds the pairs of bare numbers that leave noise alone, where nothing was named and no single
/// number does: each of several wrong numbers makes up for a part of the others.
///
/// # Errors
/// None that reading the recordings has not excluded.
pub(crate) fn try_pairs(found: &mut Pool, case: &Case) -> Result<()> {
    let single = found.best();
    let explained = single.is_some_and(|single| !leaves_something(case, single));
    let nothing = !leaves_something(case, &found.baseline);
    if explained || nothing || one_way(case) || case.time.is_spent() {
        return Ok(());
    }
    let plant = Plant::new(case.written)?;
    let mut names: Vec<String> = (bare_sizes(&plant).into_iter())
        .filter(|name| !is_scale_of_a_sensor(case, name))
        .collect();
    if names.len() < 2 || names.len() > CONFIG.imitations.in_pairs {
        return Ok(());
    }
    let best = single.and_then(|single| match single.terms() {
        [Term::Number { name }] => Some(name.clone()),
        _ => None,
    });
    // The best single one is tried with all others first.
    names.sort_by_key(|name| Some(name) != best.as_ref());
    let mut pairs = Vec::new();
    for (at, one) in names.iter().enumerate() {
        pairs.extend(
            names[at + 1..]
                .iter()
                .map(|other| [one.clone(), other.clone()]),
        );
    }
    let start = found.baseline.trial.clone();
    let explains = |pair: &[String; 2]| -> Result<bool> {
        if case.time.is_spent() {
            return Ok(false);
        }
        let terms = pair.clone().map(|name| Term::Number { name });
        let tried = alone(case, &start, &start, &terms)?;
        Ok(tried.is_some_and(|tried| !leaves_something(case, &tried)))
    };
    let tried = parallel::try_map(&pairs, explains)?;
    let kept = pairs
        .into_iter()
        .zip(tried)
        .filter(|(_, explains)| *explains);
    found.pairs = kept.map(|(pair, _)| pair).collect();
    Ok(())
}

/// Bare numbers that have a size to be wrong by.
fn bare_sizes(plant: &Plant) -> Vec<String> {
    let bare = plant.parameters().iter().filter(|parameter| {
        !parameter.free && parameter.meaning != Meaning::Start && parameter.value != 0.0
    });
    bare.map(|parameter| parameter.name.clone()).collect()
}

/// A sensor's gain scales with the rig's other numbers, and doubles every pair.
fn is_scale_of_a_sensor(case: &Case, name: &str) -> bool {
    let of = |sensor: &sinew_sim::rig::Sensor| name == format!("{}.gain", sensor.name);
    case.written.sensors.iter().any(of)
}

/// Says the bare numbers that would look the same as a named effect. A zero that nobody wrote
/// lowers its confidence; a number that the rig's owner gave does not.
///
/// # Errors
/// A rig that cannot be compiled.
pub(crate) fn doubt(effects: &mut [FoundEffect], case: &Case) -> Result<Vec<String>> {
    let zeros = zeros(case)?;
    let mut reasons = Vec::new();
    for effect in effects {
        let alike = effect.indistinguishable_from.iter();
        let alike = alike.filter(|it| it.kind == WRONG_NUMBER);
        let numbers: Vec<String> = alike.map(|it| it.component.clone()).collect();
        if numbers.is_empty() {
            continue;
        }
        let quoted: Vec<String> = numbers.iter().map(|name| format!("`{name}`")).collect();
        let names = quoted.join(" or ");
        effect.sentence += &format!(
            " With another value {names} of the rig would look the same: these recordings do not \
             tell them apart."
        );
        if numbers.iter().any(|name| zeros.contains(name)) {
            effect.confidence *= CONFIG.calibration.doubt;
            reasons.push(format!("less sure: {names} may be wrong instead"));
        }
    }
    Ok(reasons)
}
