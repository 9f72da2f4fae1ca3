//! The screening: every term refitted inside the simulator, on part of the data, a few steps from
//! several starts.

use crate::diagnose::config::CONFIG;

use crate::diagnose::candidate::{Trial, merit};
use crate::diagnose::progress::Progress;
use crate::diagnose::search::family::same_family;
use crate::diagnose::search::screen::Screen;
use crate::diagnose::search::start::{Start, best_starts, promising};
use crate::diagnose::search::subset::Subset;
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::fit::levenberg::{DecisionVariables, Stop};
use crate::order;
use crate::parallel;

/// Every term on top of `parent`, best first; what cannot be simulated is left out.
pub(crate) fn successive_halving(
    subset: &Subset,
    parent: &Trial,
    terms: &[Term],
    progress: Progress,
) -> Result<Vec<Trial>> {
    let run = subset.run(parent)?;
    let Some(screen) = Screen::new(subset, parent)? else {
        return Ok(Vec::new());
    };
    let count = progress.count("looked at", terms.len());
    let looked = parallel::map(terms, |term| {
        if progress.time.is_spent() {
            return Vec::new();
        }
        let look = best_starts(subset, parent, &run, &screen, term);
        count.one();
        look.unwrap_or_default()
    });
    let mut first = promising(looked);
    let rest = first.split_off(CONFIG.screening.at_once.min(first.len()));
    let mut trial = refitted(subset, first, progress);
    if !explained(subset, parent, &trial) {
        trial.extend(refitted(subset, rest, progress));
    }
    thin_out(subset, parent, &mut trial);
    let count = progress.count("fitted further", trial.len());
    let mut ended = parallel::map_owned(trial, |trial| {
        if progress.time.is_spent() {
            return trial;
        }
        let further = further(subset, trial);
        count.one();
        further
    });
    if !explained(subset, parent, &ended) && !progress.time.is_spent() {
        let count = progress.count("fitted afresh", ended.len());
        ended = parallel::map_owned(ended, |trial| {
            if progress.time.is_spent() {
                return trial;
            }
            let afresh = afresh(subset, trial);
            count.one();
            afresh
        });
    }
    let family = same_family(subset, parent, &ended, terms)?;
    let again = refitted(subset, family, progress);
    ended.extend(parallel::map_owned(again, |trial| further(subset, trial)));
    let mut kept: Vec<Trial> = Vec::new();
    order::sort_up(&mut ended, merit);
    for trial in ended {
        if !kept.iter().any(|kept| kept.terms == trial.terms) {
            kept.push(trial);
        }
    }
    thin_out(subset, parent, &mut kept);
    Ok(kept)
}

/// The better end of each term's starts after a few steps.
pub(crate) fn refitted(subset: &Subset, begun: Vec<Vec<Start>>, progress: Progress) -> Vec<Trial> {
    let count = progress.count("fitted", begun.len());
    let best = parallel::map_owned(begun, |starts| {
        if progress.time.is_spent() {
            return None;
        }
        let ends = (tied(subset, starts).into_iter()).filter_map(|b| {
            subset.improved(b.terms, b.model, b.from, CONFIG.screening.first_steps)
        });
        let best = ends.min_by(|a, b| a.point.cost.total_cmp(&b.point.cost));
        count.one();
        best
    });
    best.into_iter().flatten().collect()
}

/// A term at identical components, fitted as one, a few steps from each start, and the best
/// end of them: a dozen numbers that nobody knows yet would each follow what the others miss
/// (docs/lab/0066-tied-start-of-identical-components.md). Other starts as they are.
pub(crate) fn tied(subset: &Subset, starts: Vec<Start>) -> Vec<Start> {
    let newest = starts.first().and_then(|begun| begun.terms.last());
    let alike = newest.map(Term::alike).unwrap_or_default();
    if alike.is_empty() {
        return starts;
    }
    let ends = starts.into_iter().filter_map(|begun| {
        let model = begun.model.clone().tied(&alike);
        let mut segments = subset.data.segments(&model.plant, &subset.intervals).ok()?;
        let from = begun.from.clone();
        let point = model.improve(
            subset.data,
            &mut segments,
            from,
            CONFIG.screening.first_steps,
            CONFIG.screening.tolerance,
        )?;
        let from = DecisionVariables {
            values: point.values,
            states: point.states,
        };
        Some((point.cost, Start { from, ..begun }))
    });
    let best = ends.min_by(|(a, _), (b, _)| a.total_cmp(b));
    best.map(|(_, begun)| begun).into_iter().collect()
}

/// Tells whether the best of them leaves noise and little else: then those that are far behind are
/// spared.
pub(crate) fn explained(subset: &Subset, parent: &Trial, trial: &[Trial]) -> bool {
    let noise = 0.5 * subset.samples();
    let left = trial
        .iter()
        .map(|trial| trial.point.cost - noise)
        .fold(f64::INFINITY, f64::min);
    left < CONFIG.screening.explained * noise
        && left < CONFIG.screening.explained * (parent.point.cost - noise)
}

/// The best first, the hopeless left out.
pub(crate) fn thin_out(subset: &Subset, parent: &Trial, trial: &mut Vec<Trial>) {
    order::sort_up(trial, merit);
    trial.truncate(CONFIG.screening.kept);
    if explained(subset, parent, trial) {
        let (best, parent) = (trial[0].point.cost, parent.point.cost);
        let most = CONFIG.screening.hopeless * (parent + best);
        trial.retain(|trial| trial.point.cost <= most);
    }
}

/// More steps from where it stands.
pub(crate) fn further(subset: &Subset, trial: Trial) -> Trial {
    if trial.point.stop == Stop::Converged {
        return trial;
    }
    let Ok(mut segments) = subset.data.segments(&trial.model.plant, &subset.intervals) else {
        return trial;
    };
    let from = DecisionVariables {
        values: trial.point.values.clone(),
        states: trial.point.states.clone(),
    };
    match trial.model.improve(
        subset.data,
        &mut segments,
        from,
        CONFIG.screening.more_steps,
        CONFIG.screening.tolerance,
    ) {
        Some(point) if point.cost < trial.point.cost => Trial { point, ..trial },
        _ => trial,
    }
}

/// From what the rig says of itself instead: without the effect its parameters were refitted to
/// make up for it, and the way back may be longer than the way from the beginning.
pub(crate) fn afresh(subset: &Subset, trial: Trial) -> Trial {
    let model = &trial.model;
    let mut values = trial.point.values.clone();
    for (slot, written) in model.own() {
        values[slot] = written;
    }
    let from = subset.data.segments(&model.plant, &subset.intervals);
    let from = from.and_then(|mut segments| {
        let states = (subset.data).starts(&model.rig, &model.plant, &segments, &values)?;
        Ok(model.begun(
            subset.data,
            &mut segments,
            DecisionVariables { values, states },
        ))
    });
    let again = from.ok().and_then(|from| {
        let steps = CONFIG.screening.first_steps + CONFIG.screening.more_steps;
        subset.improved(trial.terms.clone(), model.clone(), from, steps)
    });
    match again {
        Some(again) if again.point.cost < trial.point.cost => again,
        _ => trial,
    }
}
