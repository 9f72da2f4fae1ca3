//! Verification of the best candidate: the one is named whose free runs over whole recordings hold.

use crate::diagnose::config::CONFIG;
use sinew_sim::Rig;

use crate::diagnose::acceptance::{
    best_acceptable_by_size, best_acceptable_of, holds_over_whole_recordings, is_determined,
    leaves_something, probabilities, simplest,
};
use crate::diagnose::calibration::{Known, sureness};
use crate::diagnose::candidate::{Candidate, only};
use crate::diagnose::case::Case;
use crate::diagnose::corrected::{correct, falls};
use crate::diagnose::evidence::apart;
use crate::diagnose::imitated_numbers;
use crate::diagnose::pool::Pool;
use crate::diagnose::share::share_left;
use crate::diagnose::split::Roles;
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::fit::{Fit, score};

/// Reasons for which a candidate is taken out.
const NO_SIZE: &str = "has an effect of which no parameter is known to be away from zero";
const LOST: &str = "loses free runs over whole recordings";

/// A named candidate.
pub(crate) struct Named {
    /// Index into the candidates.
    pub index: usize,
    /// The corrected model.
    pub rig: Rig,
    /// Its parameters.
    pub known: Known,
}

/// The best explanation that holds. Intervals have start states of their own, so what drifts or is
/// carried away over a whole recording may win there; such a one is taken out, and the rest are
/// judged without it.
///
/// # Errors
/// A rig that cannot be compiled.
pub(crate) fn verify(
    found: &mut Pool,
    refitted: &Fit,
    case: &Case,
    roles: &Roles,
) -> Result<Option<Named>> {
    let named = named(found, refitted, case, roles)?;
    match &named {
        Some(named) if bound_explains(refitted, named, roles)? => {
            found.chosen = None;
            return Ok(None);
        }
        Some(named) => imitated_numbers::beside_named(found, named.index, case)?,
        None => {
            imitated_numbers::try_single(found, case)?;
            imitated_numbers::try_pairs(found, case)?;
        }
    }
    Ok(named)
}

/// Tells whether the rig without the bounds that its parameters rest at leaves as little of the fit
/// recordings as the corrected model does: then no physics need be missing.
fn bound_explains(refitted: &Fit, named: &Named, roles: &Roles) -> Result<bool> {
    Ok(match &refitted.beyond {
        Some(beyond) => beyond.leaves_as_little_as(&score(&named.rig, &roles.fit)?),
        None => false,
    })
}

/// The best explanation that holds, if one does; else a bare number may stay chosen.
fn named(found: &mut Pool, refitted: &Fit, case: &Case, roles: &Roles) -> Result<Option<Named>> {
    for round in 0..=CONFIG.acceptance.refuted {
        let Some(index) = found.chosen else { break };
        (case.progress)("free runs of the best one", 0, 1);
        if number(found, index).is_some() {
            break;
        }
        // An effect of no size only led away from where the refit of the rig had stopped, as its
        // rivals may have; the simpler law of its family is asked next.
        let known = is_determined(case, &found.candidates[index])?;
        let unsure = if found.candidates[index].has_mode() {
            CONFIG.acceptance.unsure_of_mode
        } else {
            CONFIG.acceptance.unsure
        };
        let limit = unsure * case.trust;
        let sure = sureness(found, index, case);
        if known && sure.iter().any(|sure| *sure < limit) {
            let half = sure_half(found, index, case, (&sure, limit));
            if half.is_none() {
                found.unsure = Some(index);
                break;
            }
            found.chosen = half;
            found.probabilities = probabilities(case, &found.baseline, &found.candidates, half);
            continue;
        }
        if known && let Some(named) = holds(found, index, refitted, case, roles)? {
            return Ok(Some(named));
        }
        if round == CONFIG.acceptance.refuted {
            break;
        }
        let why = if known { LOST } else { NO_SIZE };
        refute(found, index, case, why);
        found.chosen = found.chosen.filter(|&index| number(found, index).is_none());
    }
    found.chosen = found.chosen.filter(|&index| number(found, index).is_some());
    Ok(None)
}

/// The sure half of two effects of which one is not sure: the candidate that has it alone, where it
/// may be named by itself. All explanations that have it speak for it.
fn sure_half(
    found: &Pool,
    index: usize,
    case: &Case,
    (sure, limit): (&[f64], f64),
) -> Option<usize> {
    let pair = &found.candidates[index];
    let sure = pair
        .terms()
        .iter()
        .zip(sure)
        .filter(|(_, sure)| **sure >= limit);
    let sure: Vec<&Term> = sure.map(|(term, _)| term).collect();
    let alone = |candidate: &Candidate| {
        candidate.terms().len() == 1 && sure.iter().any(|term| candidate.terms().contains(term))
    };
    let ones = found.candidates.iter().map(alone).collect::<Vec<bool>>();
    let single = best_acceptable_of(case, &found.baseline, &found.candidates, |i| ones[i]);
    single.filter(|_| pair.terms().len() > 1)
}

/// The corrected model, if its free runs hold. Judged in intervals, an explanation is believed only
/// if the whole of a recording that chose nothing gains too; or if next to nothing is left in any
/// interval,
/// and the whole is not lost: what integrates over a ripple ends a whole recording in one well or
/// in another, and a start that the first rows hardly show, of a memory above all, carries it away.
fn holds(
    found: &Pool,
    index: usize,
    refitted: &Fit,
    case: &Case,
    roles: &Roles,
) -> Result<Option<Named>> {
    let (rig, known) = correct(found, index, case, roles)?;
    let finalist = &found.candidates[index];
    let left = share_left(case, finalist, &found.baseline);
    let all = !leaves_something(case, finalist) && left < CONFIG.acceptance.most_left_of_lost;
    let mut terms = finalist.trial.terms.iter();
    let wells = terms.any(|term| term.effect().is_some_and(|(kind, _)| kind.has_many_rests()));
    let lost = if wells {
        CONFIG.acceptance.lost_in_wells
    } else {
        CONFIG.acceptance.lost
    };
    let holds = falls(&refitted.rig, &rig, &roles.check, 1.0)
        || case.in_parts
            && all
            && (falls(&refitted.rig, &rig, &roles.check, lost)
                || holds_over_whole_recordings(case, &refitted.rig, &rig)?);
    // More numbers than the refitted rig has, and farther from what they were fitted to.
    let fitted = wells
        || falls(
            &refitted.rig,
            &rig,
            &roles.fit,
            CONFIG.acceptance.lost_of_fit,
        );
    let holds = holds && fitted && keeps_its_size(finalist, &known);
    let holds = holds && (!leaves_something(case, finalist) || shows_a_number(&known));
    Ok(holds.then_some(Named { index, rig, known }))
}

/// Tells whether the recordings determine any number of the corrected model. Where they determine
/// none, a law can follow a disturbance and let the rig's own numbers make up for it.
fn shows_a_number(known: &Known) -> bool {
    known.values().any(|estimate| estimate.ci95.is_some())
}

/// Tells whether every effect is still there in the corrected model, which was fitted to whole
/// recordings: one that vanishes there had followed the start states of intervals. Where the size
/// of one of two is known there, that of the other is, too.
fn keeps_its_size(finalist: &Candidate, known: &Known) -> bool {
    let (model, values) = (&finalist.trial.model, &finalist.trial.point.values);
    let kept = |name: &String| {
        let before = model.plant.slot(name).map(|slot| values[slot].abs());
        let after = known.get(name).map(|estimate| estimate.value.abs());
        after.zip(before).is_some_and(|(after, before)| {
            after > 0.0 && after >= CONFIG.acceptance.kept_of_size * before
        })
    };
    let sizes: Vec<Vec<Vec<String>>> = finalist.terms().iter().map(Term::sizes).collect();
    let shown = |name: &String| known.get(name).is_some_and(|size| size.ci95.is_some());
    let any_shown = |term: &Vec<Vec<String>>| term.iter().flatten().any(shown);
    let as_known = !sizes.iter().any(any_shown)
        || sizes
            .iter()
            .all(|term| term.iter().all(Vec::is_empty) || any_shown(term));
    let mut all = sizes.iter().flatten();
    as_known && all.all(|sizes| sizes.is_empty() || sizes.iter().any(kept))
}

/// Takes an explanation out, what builds on it and what is the same motion by a richer law in the
/// same place, and judges the rest without them.
fn refute(found: &mut Pool, index: usize, case: &Case, why: &'static str) {
    let refuted = found.candidates[index].clone();
    let (out, rest) = std::mem::take(&mut found.candidates)
        .into_iter()
        .partition(|finalist| {
            let holds = |term| finalist.trial.terms.contains(term);
            refuted.trial.terms.iter().all(holds) || richer(&refuted, finalist, case)
        });
    found.candidates = rest;
    let out: Vec<Candidate> = out;
    let out = out.into_iter().map(|candidate| (candidate, why));
    found.refuted.extend(out);
    let chosen = best_acceptable_by_size(case, &found.baseline, &found.candidates);
    found.chosen = chosen.map(|index| simplest(case, &found.baseline, index, &found.candidates));
    found.probabilities = probabilities(case, &found.baseline, &found.candidates, found.chosen);
}

/// Tells whether `other` has another law with more parameters in the place of one of what was
/// refuted, and moves as that does.
fn richer(refuted: &Candidate, other: &Candidate, case: &Case) -> bool {
    let differ = only(refuted, other).zip(only(other, refuted));
    differ.is_some_and(|(refuted, other)| refuted.has_place_of(other))
        && other.parameters() > refuted.parameters()
        && apart(refuted, other, case) < CONFIG.evidence.alike
}

/// The bare number that explains the recordings better than any effect, if one does.
pub(crate) fn number(found: &Pool, index: usize) -> Option<&str> {
    match &found.candidates[index].trial.terms[..] {
        [Term::Number { name }] => Some(name),
        _ => None,
    }
}

/// The chosen bare number, and every other that moves the rig alike with another value: recordings
/// do not tell which of them is wrong. Empty where the choice is no number.
pub(crate) fn numbers<'a>(found: &'a Pool, index: usize, case: &Case) -> Vec<&'a str> {
    let Some(chosen) = number(found, index) else {
        return Vec::new();
    };
    let best = &found.candidates[index];
    let alike = (0..found.candidates.len()).filter_map(|other| {
        let name = number(found, other).filter(|_| other != index)?;
        let distance = apart(best, &found.candidates[other], case);
        (distance < CONFIG.evidence.alike).then_some(name)
    });
    std::iter::once(chosen).chain(alike).collect()
}
