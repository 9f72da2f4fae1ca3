//! From what the search found to what is said.

use sinew_sim::{Plant, Rig};

use crate::diagnose::acceptance::leaves_something;
use crate::diagnose::attribution::shares;
use crate::diagnose::baseline::explains_as_written;
use crate::diagnose::calibration::{Known, effects};
use crate::diagnose::candidate::implausible;
use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::corrected::worse_on;
use crate::diagnose::details::{Details, Recovered};
use crate::diagnose::differing::differing;
use crate::diagnose::doubt::{lower, stopped};
use crate::diagnose::errors;
use crate::diagnose::finalists::finalists;
use crate::diagnose::finding::{
    Diagnosis, Estimate, FORMAT, FoundEffect, Location, Remainder, Verdict,
};
use crate::diagnose::imitated_numbers;
use crate::diagnose::imitated_sensors;
use crate::diagnose::imitated_starts;
use crate::diagnose::locate::learned_force::learn;
use crate::diagnose::locate::{Corrected, intervals, locate, regime};
use crate::diagnose::next_experiment::next_experiment;
use crate::diagnose::one_way::{NOTE, one_way};
use crate::diagnose::pool::Pool;
use crate::diagnose::remainder::{beside, judged, whole};
use crate::diagnose::share::share_left;
use crate::diagnose::split::Roles;
use crate::diagnose::verify::{Named, numbers};
use crate::diagnose::wording::share_of;
use crate::error::Result;
use crate::fit::{BeyondBounds, Fit, FittedParameter, Runaway, SensorFit, free_run};
use crate::report::{beyond_bounds, runs_away, significant};

/// Decides on the verdict and writes everything down.
///
/// # Errors
/// As [`fit`].
pub(crate) fn conclude(
    rig: &Rig,
    refitted: &Fit,
    case: &Case,
    found: Option<&Pool>,
    named: Option<Named>,
    roles: &Roles,
) -> Result<Diagnosis> {
    let chosen = found.and_then(|found| Some((found, found.chosen?)));
    let suspected = Suspected {
        pairs: found.map_or(&[], |found| &found.pairs[..]),
        numbers: chosen.map_or_else(Vec::new, |(found, index)| numbers(found, index, case)),
        left: chosen.map_or(0.0, |(found, index)| {
            let best = &found.candidates[index];
            if leaves_something(case, best) {
                share_left(case, best, &found.baseline)
            } else {
                0.0
            }
        }),
    };
    let (named, mended) = match named {
        Some(Named { index, rig, known }) => {
            (found.map(|found| (found, index)), Some((rig, known)))
        }
        None => (None, None),
    };
    let (mended, mut known) = mended.unwrap_or_else(|| (refitted.rig.clone(), estimates(refitted)));
    known_own_values(&mut known, &mended, roles)?;
    let mut notes = notes(refitted);
    let effects = match named {
        Some((found, index)) => {
            let corrected = (&refitted.rig, &mended, &known);
            let (effects, doubts) = doubted_effects((found, index), case, corrected, roles)?;
            notes.extend(doubts);
            effects
        }
        None => {
            notes.extend(stopped(case));
            notes.extend(one_way(case).then(|| NOTE.to_owned()));
            Vec::new()
        }
    };
    let verdict = verdict(rig, case, found, named.is_some())?;
    if let Some(found) = found {
        let left = named.map_or(&found.baseline, |(found, index)| &found.candidates[index]);
        if leaves_something(case, left) {
            notes.extend(differing(case, left));
        }
    }
    let wrong = matches!(verdict, Verdict::MissingPhysics | Verdict::Unexplained);
    let wanted = effects.first().map(|effect| effect.component.as_str());
    let shown = named.is_some().then_some(Corrected {
        rig: &mended,
        recordings: &roles.fit,
    });
    let (location, recovered) = match found {
        Some(found) if wrong => {
            let (location, recovered) = located((rig, refitted), case, found, wanted, shown)?;
            (Some(location), recovered)
        }
        _ => (None, None),
    };
    let learned = match (verdict, &location, &recovered) {
        (Verdict::Unexplained, Some(location), Some(recovered)) => {
            learn(&refitted.rig, &location.component, recovered, case, roles)?
        }
        _ => None,
    };
    let stands_in = learned.is_some();
    let remainder = match (named, verdict) {
        (Some((found, index)), _) => beside(found, index, &mended, &effects, case)?,
        (None, Verdict::Unexplained) => Some(whole(found, location.as_ref(), case)),
        _ => None,
    };
    let explained = named
        .map(|(found, index)| 1.0 - share_left(case, &found.candidates[index], &found.baseline));
    let mended = learned.unwrap_or(mended);
    let place = location.as_ref().map_or("it", |at| at.component.as_str());
    let sentence = match far(refitted) {
        Some(far) if verdict == Verdict::Parameters => far,
        _ if found.is_none() => match &refitted.runaway {
            Some(runaway) => no_free_runs(runaway),
            None => UNSIMULATED.into(),
        },
        _ => match explained.zip(remainder.as_ref()) {
            Some((explained, remainder)) => in_part(&effects, explained, remainder),
            None => match &refitted.beyond {
                Some(beyond) if verdict == Verdict::Unexplained => bound(beyond, &refitted.sensors),
                _ => {
                    let tried = found.is_some_and(|found| !found.candidates.is_empty());
                    let stopped = stopped(case).map(|_| tried);
                    let place = location.as_ref();
                    sentence(verdict, &effects, &suspected, place, (stands_in, stopped))
                }
            },
        },
    };
    Ok(Diagnosis {
        format: FORMAT,
        verdict,
        sentence,
        complete: remainder.is_none(),
        judged: judged(
            case,
            Plant::new(rig)?.sensors().iter().map(|s| s.column.clone()),
        ),
        candidates: found.map_or_else(Vec::new, |found| {
            finalists(found, named.map(|(_, index)| index), case)
        }),
        fit: errors::signals([rig, &refitted.rig, &mended], case, roles)?,
        parameters: known
            .iter()
            .filter(|(name, _)| refitted.parameters.iter().any(|p| p.name == **name))
            .map(|(name, estimate)| (name.clone(), estimate.clone()))
            .collect(),
        next_experiment: next_experiment(verdict, &effects, remainder.as_ref(), place),
        remainder,
        location,
        effects,
        seconds: 0.0,
        checks: Vec::new(),
        refitted: refitted.rig.clone(),
        mended,
        notes,
        details: Details {
            set_aside: roles.set_aside.clone(),
            recovered,
        },
    })
}

/// The finding in a word; `is_named`: an effect is named.
fn verdict(rig: &Rig, case: &Case, found: Option<&Pool>, is_named: bool) -> Result<Verdict> {
    Ok(match found {
        _ if is_named => Verdict::MissingPhysics,
        Some(found) if found.needs_nothing(case) => {
            if explains_as_written(case, rig)? {
                Verdict::Consistent
            } else {
                Verdict::Parameters
            }
        }
        _ => Verdict::Unexplained,
    })
}

/// Effects of a candidate with all that makes them less sure, and notes about that. `corrected`:
/// the refitted rig, the corrected one, and its estimates.
fn doubted_effects(
    (found, index): (&Pool, usize),
    case: &Case,
    (refitted, mended, known): (&Rig, &Rig, &Known),
    roles: &Roles,
) -> Result<(Vec<FoundEffect>, Vec<String>)> {
    let mut notes = Vec::new();
    let shares = shares(found, index, case)?;
    let mut effects = effects(found, index, case, known, &shares);
    let named = &found.candidates[index];
    notes.extend(lower(&mut effects, named, mended, known, case)?);
    let worse = worse_on(refitted, mended, roles)?;
    if !worse.is_empty() {
        let doubt = CONFIG.calibration.doubt;
        effects
            .iter_mut()
            .for_each(|effect| effect.confidence *= doubt);
        notes.push(format!(
            "less sure: the corrected rig is worse than the refitted one on {}",
            worse.join(", ")
        ));
    }
    notes.extend(imitated_numbers::doubt(&mut effects, case)?);
    notes.extend(imitated_sensors::doubt(&mut effects, (found, index), case)?);
    notes.extend(imitated_starts::doubt(&mut effects, (found, index), case)?);
    Ok((effects, notes))
}

/// Place and time of the mismatch, and the force there. `wanted`: component of the first effect;
/// `shown`: the corrected rig.
fn located(
    (rig, refitted): (&Rig, &Fit),
    case: &Case,
    found: &Pool,
    wanted: Option<&str>,
    shown: Option<Corrected<'_>>,
) -> Result<(Location, Option<Recovered>)> {
    let body = wanted.filter(|at| rig.bodies.iter().any(|body| body.name == *at));
    let located = locate(&refitted.rig, case.fit, body, shown)?;
    let component = wanted
        .map(ToOwned::to_owned)
        .or(located.as_ref().map(|located| located.component.clone()))
        .or(rig.bodies.first().map(|body| body.name.clone()));
    let regime = match (shown, &located) {
        (Some(corrected), Some(located)) => {
            let at = &located.recovered.component;
            regime::of_named(&refitted.rig, corrected.rig, at, corrected.recordings)?
        }
        (_, located) => located.as_ref().and_then(|l| l.regime.clone()),
    };
    let location = Location {
        component: component.unwrap_or_default(),
        follows: located.as_ref().map_or_else(
            || "no quantity that was recorded".into(),
            |located| located.follows.clone(),
        ),
        intervals: intervals(&found.baseline.fit, case.fit),
        regime,
    };
    Ok((location, located.map(|located| located.recovered)))
}

fn estimates(fitted: &Fit) -> Known {
    let of = |p: &crate::fit::FittedParameter| Estimate {
        value: p.value,
        unit: p.unit.clone(),
        ci95: p.ci95,
        recordings: Vec::new(),
    };
    let parameters = fitted.parameters.iter();
    parameters.map(|p| (p.name.clone(), of(p))).collect()
}

/// Sentence where the search could not begin.
const UNSIMULATED: &str = "The search could not begin: from its refitted parameters the rig \
     cannot be simulated over the recordings, so nothing is known of what it lacks. Cut the \
     recordings shorter, or give the rig other values to start from.";

/// Sentence of a rig that runs away by itself: its free runs cannot be judged.
fn no_free_runs(runaway: &Runaway) -> String {
    format!(
        "Nothing is known of what the rig lacks: {}.",
        runs_away(runaway)
    )
}

/// Sentence where a bound of the rig keeps a parameter from a better value.
fn bound(beyond: &BeyondBounds, within: &[SensorFit]) -> String {
    format!(
        "A bound of the rig is suspected: {}. Widen it and diagnose again.",
        beyond_bounds(beyond, within)
    )
}

/// Sentence where something is named and something is left.
fn in_part(effects: &[FoundEffect], explained: f64, remainder: &Remainder) -> String {
    let all: Vec<&str> = effects.iter().map(|e| e.sentence.as_str()).collect();
    let explains = match effects {
        [_] => "It explains",
        _ => "Together they explain",
    };
    format!(
        "{} {explains} {} of the mismatch on the check recordings. {}",
        all.join(" "),
        share_of(explained),
        remainder.sentence
    )
}

/// Bare numbers that may be wrong.
struct Suspected<'a> {
    /// Two at once that leave noise alone, where no single one does.
    pairs: &'a [[String; 2]],
    numbers: Vec<&'a str>,
    /// Part of the mismatch that another value would leave; 0 where that is noise alone.
    left: f64,
}

/// The finding where nothing special is to be said. `stopped` is none of a whole search; of a
/// stopped one it tells whether anything had been fitted.
fn sentence(
    verdict: Verdict,
    effects: &[FoundEffect],
    suspected: &Suspected,
    location: Option<&Location>,
    (stands_in, stopped): (bool, Option<bool>),
) -> String {
    match verdict {
        Verdict::Consistent => {
            "The rig explains the recordings as it is written, to within their noise.".into()
        }
        Verdict::Parameters => {
            "With its parameters refitted the rig explains the recordings to within their \
                                noise; no physics is missing."
                .into()
        }
        Verdict::MissingPhysics => {
            let all: Vec<&str> = effects.iter().map(|e| e.sentence.as_str()).collect();
            all.join(" ")
        }
        Verdict::Unexplained => {
            let place = location.map_or_else(String::new, |at| {
                format!(" It sits at {} and follows {}.", at.component, at.follows)
            });
            let learned = match (stands_in, location) {
                (true, Some(at)) => format!(
                    " In the corrected rig a learned force at {} stands in for it: a spring and a damping without a name, which \
                     cannot drive the rig.",
                    at.component
                ),
                _ => String::new(),
            };
            let left = if suspected.left > 0.0 {
                let share = share_of(suspected.left);
                format!(
                    " {share} of the mismatch would remain: another number may be wrong as well, or \
                     physics is missing."
                )
            } else {
                String::new()
            };
            let what = match &suspected.numbers[..] {
                _ if !suspected.pairs.is_empty() => two_numbers(suspected.pairs),
                [number] => format!(
                    "The number `{number}` of the rig is suspected: with another value it explains the \
                     recordings, and no missing physics explains them better. Write it as \
                     {{ value = ... }} and fit again.{left}"
                ),
                [first, others @ ..] => format!(
                    "One of the numbers `{first}`{} of the rig is suspected: with another value any one of them explains \
                     the recordings alike, and no missing physics explains them better. Write the one that you trust \
                     least as {{ value = ... }} and fit again.{left}",
                    others
                        .iter()
                        .map(|other| format!(", `{other}`"))
                        .collect::<String>()
                ),
                [] if stopped == Some(false) => format!(
                    "The search was stopped before it had fitted any effect: something is missing from the model, \
                     and it is not known what. Give it more time.{place}"
                ),
                [] if stopped.is_some() => format!(
                    "Something is missing from the model. The search was stopped before it ended, and nothing that it \
                     had tried explains it.{place}"
                ),
                [] => format!(
                    "Something is missing from the model that no effect of the vocabulary explains.{place}"
                ),
            };
            what + &learned
        }
    }
}

/// Sentence of numbers that explain the recordings two at a time.
fn two_numbers(pairs: &[[String; 2]]) -> String {
    let quoted = pairs
        .iter()
        .map(|[one, other]| format!("`{one}` and `{other}`"));
    let quoted: Vec<String> = quoted.collect();
    format!(
        "More than one number of the rig is suspected: with other values {} together explain the \
         recordings, and no single number does. Write those that you trust least as \
         {{ value = ... }} and fit again.",
        quoted.join(", or ")
    )
}

/// Sentence of the verdict `parameters` where some are known to have changed their meaning: what
/// explains the recordings may be no number.
fn far(refitted: &Fit) -> Option<String> {
    let known = |p: &&FittedParameter| {
        p.ci95
            .is_some_and(|ends| ends.iter().all(|end| implausible(*end, p.as_written)))
    };
    let of = |p: &FittedParameter| {
        let times = significant(p.value / p.as_written, 2);
        format!("`{}` is {times} times what the rig says", p.name)
    };
    let far = refitted.parameters.iter().filter(known).map(of);
    let far: Vec<String> = far.collect();
    (!far.is_empty()).then(|| {
        format!(
            "With its parameters refitted the rig explains the recordings to within their noise, but {}: an effect may hide \
             there.",
            far.join(" and ")
        )
    })
}

fn notes(refitted: &Fit) -> Vec<String> {
    let held = refitted.held.iter().map(|held| {
        format!(
            "{}: {} samples of {} are missing and held their last value",
            held.recording, held.missing, held.column
        )
    });
    let open = |moved: bool| -> Option<String> {
        let open = refitted.parameters.iter();
        let open = open.filter(|p| p.ci95.is_none() && !p.at_bound);
        let open = open.filter(|p| (p.value != p.as_written) == moved);
        let open: Vec<&str> = open.map(|p| p.name.as_str()).collect();
        let said = if moved {
            "not determined by these recordings, and moved with others that they bind"
        } else {
            "not determined by these recordings, and left as the rig says"
        };
        (!open.is_empty()).then(|| format!("{said}: {}", open.join(", ")))
    };
    held.chain(open(false)).chain(open(true)).collect()
}

/// Enters the own values of all recordings where parameters differ by recording.
fn known_own_values(known: &mut Known, rig: &Rig, roles: &Roles) -> Result<()> {
    let plant = Plant::new(rig)?;
    if !plant.parameters().iter().any(|p| p.per_recording && p.free) {
        return Ok(());
    }
    for run in [&roles.fit, &roles.check, &roles.test]
        .into_iter()
        .flatten()
        .map(|recording| free_run(rig, recording))
    {
        for own in run?.own {
            if let Some(estimate) = known.get_mut(&own.name) {
                estimate.recordings.push(own);
            }
        }
    }
    Ok(())
}
