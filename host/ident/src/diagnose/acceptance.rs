//! Rules of acceptance of a candidate (docs/explanation/diagnosis.md, eq. 4 and 7).

use crate::diagnose::config::CONFIG;
use std::collections::BTreeMap;

use sinew_sim::effects::Family;
use sinew_sim::{Rig, SimulationSettings};

use crate::diagnose::candidate::{Candidate, only, same_mechanism};
use crate::diagnose::case::Case;
use crate::diagnose::data::Data;
use crate::diagnose::evidence::{Comparison, Gain, apart};
use crate::diagnose::model::Model;
use crate::diagnose::residuals::Residuals;
use crate::diagnose::share::{beside_noise, share_left, spoils_a_recording};
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::fit::levenberg::DecisionVariables;
use crate::order;

/// Tells whether an explanation leaves something that noise does not explain and that matters.
pub(crate) fn leaves_something(case: &Case, candidate: &Candidate) -> bool {
    stands_out(&candidate.fit, case.fit) || stands_out(&candidate.check, case.check)
}

/// Tells whether the whole of the check recordings, from the start states that explain each best,
/// is left to no more than the part of what is believed.
///
/// # Errors
/// A rig that cannot be compiled.
pub(crate) fn holds_over_whole_recordings(case: &Case, before: &Rig, after: &Rig) -> Result<bool> {
    let left = |rig: &Rig| -> Result<Option<f64>> {
        let model = Model::new(rig, rig, &[], SimulationSettings::default())?;
        let (values, whole) = (model.plant.values(), case.check.cut(1));
        let residuals = Residuals::of(&model, &values, case.check, &whole, None)?;
        Ok(residuals.map(|residuals| beside_noise(&residuals, case.check)))
    };
    let both = left(before)?.zip(left(after)?);
    Ok(both.is_some_and(|(before, after)| after < CONFIG.acceptance.most_left_of_whole * before))
}

/// A gain that counts: sure under resampling, and large enough to matter.
pub(crate) fn gain_counts(case: &Case, gain: Gain, after: &Candidate, before: &Candidate) -> bool {
    let matters = (0..case.check.noise.len()).any(|sensor| {
        let removed = before.check.rms(sensor).powi(2) - after.check.rms(sensor).powi(2);
        removed.max(0.0).sqrt() > matters(case.check, sensor)
    });
    gain.low > 0.0 && matters
}

/// Tells whether every effect has parameters that make sense here.
fn plausible(case: &Case, candidate: &Candidate) -> bool {
    let (model, values) = (&candidate.trial.model, &candidate.trial.point.values);
    let longest = case
        .fit
        .experiments
        .iter()
        .map(|e| e.t[e.rows() - 1] - e.t[0])
        .fold(0.0, f64::max);
    let mut all = candidate.trial.terms.iter();
    all.all(|term| term.plausible(&model.plant, values, longest))
}

/// Reason for which a candidate may not be named, whatever the evidence; `None` where it may. A law
/// that removes less than half is none: a disturbance can be followed a little by many an effect.
pub(crate) fn refusal(
    case: &Case,
    candidate: &Candidate,
    base: &Candidate,
) -> Option<&'static str> {
    let left = share_left(case, candidate, base);
    if !plausible(case, candidate) {
        Some("has a parameter of the wrong sign, or one that shows in no recording of this length")
    } else if left >= CONFIG.acceptance.most_left {
        Some("leaves more than half of the mismatch on the check recordings")
    } else if candidate.has_mode() && left >= CONFIG.acceptance.most_left_of_mode {
        Some("is a coordinate that no sensor sees, and leaves a mismatch")
    } else if within_a_step(case, candidate, base) {
        Some("bends a sensor by less than half its resolution")
    } else if follows_anything(case, candidate) {
        Some("moves a parameter of the rig far from its value, and leaves a mismatch")
    } else if spoils_a_recording(case, candidate, base) {
        Some("makes one of the recordings worse")
    } else {
        None
    }
}

fn acceptable(case: &Case, candidate: &Candidate, base: &Candidate) -> bool {
    refusal(case, candidate, base).is_none()
}

/// A dozen numbers at components that are alike follow what another mechanism does: they bend the
/// rig out of shape, and still leave something.
fn follows_anything(case: &Case, candidate: &Candidate) -> bool {
    let mut terms = candidate.trial.terms.iter();
    terms.any(Term::is_group) && candidate.trial.implausible() && leaves_something(case, candidate)
}

/// A sensor that is bent by less than half a step of its own scale is as straight as that scale.
fn within_a_step(case: &Case, candidate: &Candidate, base: &Candidate) -> bool {
    let mut terms = candidate.trial.terms.iter();
    terms.any(|term| term.family() == Some(Family::Sensor))
        && (0..case.check.step.len()).all(|sensor| {
            let squares = base.check.rms(sensor).powi(2) - candidate.check.rms(sensor).powi(2);
            squares.max(0.0).sqrt() < CONFIG.acceptance.within_step * case.check.step[sensor]
        })
}

/// Tells whether what an explanation removes from some sensor exceeds the noise.
pub(crate) fn exceeds_noise(case: &Case, candidate: &Candidate, base: &Candidate) -> bool {
    (0..case.check.noise.len()).any(|sensor| {
        let squares = base.check.rms(sensor).powi(2) - candidate.check.rms(sensor).powi(2);
        squares.max(0.0).sqrt() > CONFIG.acceptance.large * case.check.sigma[sensor]
    })
}

/// Tells whether a small gain holds the other way round too: fitted to the check recordings alone,
/// judged by the fit recordings, against a rig that was fitted to both. Large gains need no second
/// witness.
fn holds_both_ways(case: &Case, candidate: &Candidate, base: &Candidate) -> Result<bool> {
    let sensors = 0..case.check.noise.len();
    if exceeds_noise(case, candidate, base) {
        return Ok(true);
    }
    let (model, values) = (&candidate.trial.model, &candidate.trial.point.values);
    let mut segments = case.check.segments(&model.plant, &case.check_intervals)?;
    let states = (case.check).starts(&model.rig, &model.plant, &segments, values)?;
    let from = DecisionVariables {
        values: values.clone(),
        states,
    };
    let Some(point) = model.improve(case.check, &mut segments, from, CONFIG.refit.steps, 1e-4)
    else {
        return Ok(false);
    };
    let swapped = Residuals::of(model, &point.values, case.fit, &case.fit_intervals, None)?;
    Ok(swapped.is_some_and(|swapped| {
        let gains = sensors.map(|s| (base.fit.rms(s) / swapped.rms(s)).ln());
        gains.sum::<f64>() > 0.0
    }))
}

/// Indices of candidates by evidence, best first.
pub(crate) fn ranking(case: &Case, base: &Candidate, candidates: &[Candidate]) -> Vec<usize> {
    let evidence = comparison(case, base, candidates).evidence();
    let mut order: Vec<usize> = (0..candidates.len()).collect();
    order::sort_down(&mut order, |&index| evidence[index + 1]);
    order
}

/// The base is number 0, candidates follow.
pub(crate) fn comparison(case: &Case, base: &Candidate, candidates: &[Candidate]) -> Comparison {
    let all: Vec<Candidate> = std::iter::once(base).chain(candidates).cloned().collect();
    Comparison::new(&all, &case.check.spread, case.seed)
}

/// The best candidate that is believable against the base.
pub(crate) fn best_acceptable(
    case: &Case,
    base: &Candidate,
    candidates: &[Candidate],
) -> Option<usize> {
    best_acceptable_of(case, base, candidates, |_| true)
}

/// The same of those that `asked` admits.
pub(crate) fn best_acceptable_of(
    case: &Case,
    base: &Candidate,
    candidates: &[Candidate],
    asked: impl Fn(usize) -> bool,
) -> Option<usize> {
    let comparison = comparison(case, base, candidates);
    let order = ranking(case, base, candidates).into_iter();
    let mut order = order.filter(|&index| asked(index));
    order.find(|&index| {
        gain_counts(
            case,
            comparison.gain(index + 1, 0),
            &candidates[index],
            base,
        ) && acceptable(case, &candidates[index], base)
            && holds_both_ways(case, &candidates[index], base).unwrap_or(false)
    })
}

/// As [`best_acceptable`], but two effects only where they are believable against the best single
/// one. A mode of no size beside it follows a little of the noise.
pub(crate) fn best_acceptable_by_size(
    case: &Case,
    base: &Candidate,
    candidates: &[Candidate],
) -> Option<usize> {
    let comparison = comparison(case, base, candidates);
    let order = ranking(case, base, candidates);
    let plausible: Vec<usize> = order
        .into_iter()
        .filter(|&index| {
            acceptable(case, &candidates[index], base)
                && gain_counts(
                    case,
                    comparison.gain(index + 1, 0),
                    &candidates[index],
                    base,
                )
        })
        .collect();
    let size = |index: usize| candidates[index].trial.terms.len();
    let single = plausible.iter().copied().find(|&index| size(index) == 1);
    let single =
        single.filter(|&index| holds_both_ways(case, &candidates[index], base).unwrap_or(false));
    // Each half removes half of what the other leaves.
    let halves = |pair: usize| {
        let of = |other: &Candidate| {
            let terms = other.terms();
            terms.len() == 1 && candidates[pair].terms().contains(&terms[0])
        };
        let mut alone = candidates.iter().filter(|other| of(other));
        alone.all(|one| share_left(case, &candidates[pair], one) < CONFIG.acceptance.most_left)
    };
    let pairs = plausible.iter().copied().filter(|&index| size(index) == 2);
    let mut pairs = pairs.filter(|&pair| halves(pair));
    let Some(single) = single else {
        return pairs.next();
    };
    let over = |pair: usize| {
        let (pair_of, single_of) = (&candidates[pair], &candidates[single]);
        gain_counts(
            case,
            comparison.gain(pair + 1, single + 1),
            pair_of,
            single_of,
        ) && share_left(case, pair_of, single_of) < CONFIG.acceptance.most_left
            && holds_both_ways(case, pair_of, single_of).unwrap_or(false)
            && (!pair_of.has_mode() || is_determined(case, pair_of).unwrap_or(false))
    };
    pairs.next().filter(|&pair| over(pair)).or(Some(single))
}

/// Tells whether each effect is known to be there, by one at least of the parameters that can be
/// zero. Where the recordings leave a direction open that the rig shares, all forces scaled alike,
/// no interval is known: the rig's own parameters are held then. A mode is not asked twice: one of
/// which nobody knows how heavy it is, is a damper or a spring that the rig has. What two that are
/// alike have together may be known and no part of it: two winches that wind the same joint. Each
/// of them is there where it is known once the others are as found.
pub(crate) fn is_determined(case: &Case, candidate: &Candidate) -> Result<bool> {
    let (model, point) = (&candidate.trial.model, &candidate.trial.point);
    let segments = case.fit.segments(&model.plant, &case.fit_intervals)?;
    let widths = |model: &Model| model.half_widths(case.fit, &segments, point);
    let farthest = |widths: &BTreeMap<String, f64>, sizes: &[String]| {
        let away = |name: &String| {
            let slot = model.plant.slot(name)?;
            Some(point.values[slot].abs() / widths.get(name)?)
        };
        sizes.iter().filter_map(away).reduce(f64::max)
    };
    let certain = |term: &Term, of: &Model, sizes: &[String]| {
        let mode = term.family() == Some(Family::Mode);
        let alone = || widths(&of.holding(|name| !term.parameters().iter().any(|p| p == name)));
        let known = farthest(&widths(of), sizes);
        let known = known.or_else(|| farthest(&alone(), sizes).filter(|_| !mode));
        sizes.is_empty() || known.is_some_and(|far| far >= CONFIG.acceptance.certain)
    };
    let there = |term: &Term| {
        let all = term.sizes();
        let beside = |sizes: &Vec<String>| {
            let mut others = all.iter().filter(|other| *other != sizes).flatten();
            let held = model.holding(|name| others.clone().any(|other| other == name));
            others.next().is_some() && certain(term, &held, sizes)
        };
        all.iter().all(|sizes| certain(term, model, sizes)) || all.iter().all(beside)
    };
    Ok(candidate.trial.terms.iter().all(there))
}

/// The one that is named of the chosen one and its like: of the same motion by two names the
/// simpler, at one component what need not be at all that are alike, and beside a remainder the law
/// with the fewest parameters that it may not be told from.
pub(crate) fn simplest(
    case: &Case,
    base: &Candidate,
    chosen: usize,
    candidates: &[Candidate],
) -> usize {
    let chosen = at_body(case, chosen, candidates);
    let chosen = at_one_component(case, base, chosen, candidates);
    plainest(case, base, chosen, candidates)
}

/// Of laws that are one finding, and of those whose own parameters nothing shows, the one with the
/// fewest parameters.
fn plainest(case: &Case, base: &Candidate, chosen: usize, candidates: &[Candidate]) -> usize {
    let alike = one_finding_with(case, base, chosen, candidates);
    let best = &candidates[chosen];
    let left = |candidate: &Candidate| share_left(case, candidate, base);
    // Two laws are not plainer than one that leaves less than they do.
    let outdone = |other: &Candidate| {
        let one_of = |one: &&Candidate| one.terms().len() < other.terms().len();
        let mut ones = candidates.iter().filter(one_of);
        ones.any(|one| left(one) <= left(other) && acceptable(case, one, base))
    };
    let plainer = |&index: &usize| {
        let other = &candidates[index];
        other.parameters() < best.parameters()
            && (alike[index] || gives_way(case, base, best, other))
            && left(other) < left(best) + CONFIG.acceptance.nearly
            && acceptable(case, other, base)
            && !outdone(other)
    };
    let plainer = (0..candidates.len()).filter(plainer);
    let least = plainer.min_by_key(|&index| candidates[index].parameters());
    least.unwrap_or(chosen)
}

/// Tells whether a law gives way to a simpler one of its family in its place: they explain nearly
/// as much as each other, and of the richer law some parameter is not known.
fn gives_way(case: &Case, base: &Candidate, richer: &Candidate, simpler: &Candidate) -> bool {
    let differ = only(richer, simpler).zip(only(simpler, richer));
    let Some((mine, _)) = differ.filter(|(mine, its)| mine.has_place_of(its)) else {
        return false;
    };
    let left = |candidate: &Candidate| share_left(case, candidate, base);
    same_mechanism(richer, simpler)
        && (left(simpler) - left(richer)).abs() < CONFIG.acceptance.nearly
        && !is_known(case, richer, mine).unwrap_or(true)
}

/// Tells whether the recordings show every parameter of a term: none has an interval that spans
/// zero, or none at all.
fn is_known(case: &Case, candidate: &Candidate, term: &Term) -> Result<bool> {
    let (model, point) = (&candidate.trial.model, &candidate.trial.point);
    let segments = case.fit.segments(&model.plant, &case.fit_intervals)?;
    let widths = model.half_widths(case.fit, &segments, point);
    let known = |name: &String| {
        let value = model.plant.slot(name).map(|slot| point.values[slot].abs());
        let fitted = model
            .plant
            .slot(name)
            .is_some_and(|slot| model.slots.contains(&slot));
        let width = widths.get(name).copied();
        !fitted || value.zip(width).is_some_and(|(value, width)| value > width)
    };
    Ok(term.parameters().iter().all(known))
}

/// Tells of each candidate whether the chosen one and it are one finding: a richer law that gives
/// way to it, or one of the same mechanism of which neither is surely better. For the latter, the
/// chosen one leaves more than noise to tell them apart by, or the other is a richer law in its
/// place.
pub(crate) fn one_finding_with(
    case: &Case,
    base: &Candidate,
    chosen: usize,
    candidates: &[Candidate],
) -> Vec<bool> {
    let best = &candidates[chosen];
    let left = leaves_something(case, best);
    let comparison = comparison(case, base, candidates);
    let surely = |a: usize, b: usize| comparison.gain(a + 1, b + 1).low > 0.0;
    let richer = |other: &Candidate| {
        let differ = only(best, other).zip(only(other, best));
        differ.is_some_and(|(mine, its)| mine.has_place_of(its))
            && other.parameters() > best.parameters()
    };
    let one = |index: usize| {
        let other = &candidates[index];
        let one = || (left || richer(other)) && !surely(chosen, index) && !surely(index, chosen);
        index != chosen
            && same_mechanism(best, other)
            && (one() || gives_way(case, base, other, best))
    };
    (0..candidates.len()).map(one).collect()
}

/// Of what is the same motion by two names, the simpler: an effect at a body rather than in a
/// spring that holds it (contract of the vocabulary).
fn at_body(case: &Case, chosen: usize, candidates: &[Candidate]) -> usize {
    let best = &candidates[chosen];
    let simpler = |other: &Candidate| {
        let differ = only(best, other).zip(only(other, best));
        differ.is_some_and(|(mine, its)| {
            mine.kind() == its.kind() && !mine.at_body() && its.at_body()
        }) && apart(best, other, case) < CONFIG.evidence.same
    };
    let other = (0..candidates.len()).find(|&index| simpler(&candidates[index]));
    other.unwrap_or(chosen)
}

/// An effect at one component rather than at all that are alike, where it is about as probable.
fn at_one_component(
    case: &Case,
    base: &Candidate,
    chosen: usize,
    candidates: &[Candidate],
) -> usize {
    let best = &candidates[chosen];
    let one_of_them = |other: &Candidate| {
        let differ = only(best, other).zip(only(other, best));
        differ.is_some_and(|(mine, its)| mine.says(its)) && plausible(case, other)
    };
    let ones = (0..candidates.len()).filter(|&index| one_of_them(&candidates[index]));
    let ones: Vec<usize> = ones.collect();
    if ones.is_empty() {
        return chosen;
    }
    let probable = probabilities(case, base, candidates, Some(chosen));
    let best = ones
        .into_iter()
        .max_by(|&a, &b| probable[a].total_cmp(&probable[b]));
    best.filter(|&one| probable[one] > CONFIG.acceptance.one_of_group * probable[chosen])
        .unwrap_or(chosen)
}

/// Shares of the evidence among what is possible here: of no more effects than were found to
/// matter, and such as may be named where something is. What may not be named, or is not surely
/// better than the rig alone, takes no share from what is.
pub(crate) fn probabilities(
    case: &Case,
    base: &Candidate,
    candidates: &[Candidate],
    chosen: Option<usize>,
) -> Vec<f64> {
    let most = chosen.map_or(CONFIG.acceptance.most_terms, |index| {
        candidates[index].trial.terms.len()
    });
    let of_all = chosen.map(|_| comparison(case, base, candidates));
    let surely =
        |index: usize| (of_all.as_ref()).is_none_or(|all| all.gain(index + 1, 0).low > 0.0);
    let possible = |&index: &usize| {
        let candidate = &candidates[index];
        let may = match chosen {
            Some(_) => acceptable(case, candidate, base) && surely(index),
            None => plausible(case, candidate),
        };
        may && candidate.trial.terms.len() <= most
    };
    let able: Vec<usize> = (0..candidates.len()).filter(possible).collect();
    let rivals: Vec<Candidate> = able
        .iter()
        .map(|&index| candidates[index].clone())
        .collect();
    let shares = comparison(case, base, &rivals).probabilities().split_off(1);
    let mut all = vec![0.0; candidates.len()];
    for (index, share) in able.into_iter().zip(shares) {
        all[index] = share;
    }
    all
}

/// Least amount of a sensor's signal that matters.
pub(crate) fn matters(data: &Data, sensor: usize) -> f64 {
    let of_noise = CONFIG.acceptance.matters_of_noise * data.noise[sensor];
    of_noise + CONFIG.acceptance.matters_of_spread * data.spread[sensor]
}

/// Tells whether residuals hold something that noise does not explain and that matters.
pub(crate) fn stands_out(residuals: &Residuals, data: &Data) -> bool {
    let mut sensors = residuals.excess(data).into_iter().enumerate();
    sensors.any(|(sensor, e)| {
        e.significance > CONFIG.acceptance.significant && e.rms > matters(data, sensor)
    })
}
