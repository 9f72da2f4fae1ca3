//! The search for missing terms: a pool of candidates and a list of moves that add to it
//! (docs/explanation/diagnosis.md).

pub(crate) mod all_rows;
pub(crate) mod context;
pub(crate) mod family;
pub(crate) mod halving;
pub(crate) mod moves;
pub(crate) mod refit;
mod refocus;
mod screen;
pub(crate) mod simpler;
pub(crate) mod start;
pub(crate) mod subset;

use crate::diagnose::config::CONFIG;
use sinew_sim::{Plant, Rig};

use self::context::Context;
use self::moves::MOVES;
use self::subset::Subset;
use crate::diagnose::acceptance::{leaves_something, ranking};
use crate::diagnose::baseline::{
    fit_baseline, fit_baseline_from, leaves_less_as_written, restart_baseline,
};
use crate::diagnose::by_signal::BySignal;
use crate::diagnose::candidate::{Candidate, Trial};
use crate::diagnose::case::Case;
use crate::diagnose::one_way::can_be_told;
use crate::diagnose::pool::Pool;
use crate::diagnose::possible_terms::{depending_terms, terms};
use crate::diagnose::search::refocus::refocused;
use crate::diagnose::share::share_left;
use crate::diagnose::term::Term;
use crate::error::Result;

/// Searches over the intervals of the case; then over fewer and longer ones, from where the rig
/// ended on the shorter ones, while the rig alone leaves nothing: start states of its own in every
/// interval may follow what the rig misses.
///
/// # Errors
/// As [`search`].
pub(crate) fn search_in_parts(
    case: &mut Case,
    rig: &Rig,
    values: &[f64],
    budget: usize,
) -> Result<Option<Pool>> {
    let mut pool = search(case, rig, values)?;
    let mut parts = if case.in_parts { CONFIG.split.parts } else { 1 };
    while parts > 1
        && !case.time.is_spent()
        && let Some(nothing) = pool.as_ref().filter(|pool| pool.needs_nothing(case))
    {
        parts /= 2;
        let longer = [case.fit, case.check].map(|data| data.select(parts, budget));
        if longer == [&case.fit_intervals, &case.check_intervals].map(Clone::clone) {
            break;
        }
        let values = nothing.baseline.trial.point.values.clone();
        [case.fit_intervals, case.check_intervals] = longer;
        pool = search(case, rig, &values)?;
    }
    Ok(pool)
}

/// Searches the terms that `rig` lacks, its parameters beginning at `values`. `None` where it
/// cannot be simulated.
///
/// # Errors
/// None that reading the recordings has not excluded.
pub(crate) fn search(case: &Case, rig: &Rig, values: &[f64]) -> Result<Option<Pool>> {
    let plant = Plant::new(rig)?;
    let thinned = Subset::thinned(case, rig, &plant, values);
    let mut subset = Subset::new(case, thinned.as_ref().unwrap_or(case.fit), &plant, values);
    let Some(start) = subset.first(rig, values, CONFIG.screening.baseline_steps)? else {
        return Ok(None);
    };
    // The rig may have run along the bound, and nothing may be added to it there.
    subset.settings.max_substeps *= CONFIG.model.more_substeps;
    let Some(baseline) = baseline(case, &start, &plant, values)? else {
        return Ok(None);
    };
    let mut pool = Pool::new(baseline);
    if !leaves_something(case, &pool.baseline) {
        return Ok(Some(pool));
    }
    let (subset, start) = match refocused(&subset, &start)? {
        Some(own) => match own.first(rig, values, CONFIG.screening.baseline_steps)? {
            Some(moved) => (own, moved),
            None => (subset, start),
        },
        None => (subset, start),
    };
    let mut all = terms(rig, &plant, case.effects);
    all.extend(depending_terms(rig, case.effects, &signals(case, &plant)));
    let (refinements, terms) = (can_be_told(case, all).into_iter()).partition(Term::is_refinement);
    let context = Context {
        case,
        subset,
        start,
        rig,
        terms,
        refinements,
    };
    improve(&context, &mut pool)?;
    let best = pool.chosen.or_else(|| {
        let order = ranking(case, &pool.baseline, &pool.candidates);
        order.first().copied()
    });
    if let Some(index) = best.filter(|_| !case.time.is_spent()) {
        let best = &pool.candidates[index].trial;
        if let Some(again) = restart_baseline(case, &context.start, best, &pool.baseline)? {
            pool.rebase(case, again)?;
        }
    }
    if case.time.is_spent() {
        simpler::add_simpler(&context, &mut pool)?;
    }
    pool.conclude(case);
    Ok(Some(pool))
}

/// Signals of the rig that vary in the fit recordings.
fn signals(case: &Case, plant: &Plant) -> Vec<BySignal> {
    let inputs = plant.inputs().iter().enumerate();
    let signals = inputs.filter(|(_, input)| input.exogenous);
    let ranges = signals.map(|(index, input)| {
        let experiments = case.fit.experiments.iter();
        let values = experiments.flat_map(|experiment| experiment.inputs[index].iter().copied());
        let wider = |[low, high]: [f64; 2], value: f64| [low.min(value), high.max(value)];
        BySignal {
            name: input.actuator.clone(),
            unit: input.unit().to_owned(),
            range: values.fold([f64::INFINITY, f64::NEG_INFINITY], wider),
        }
    });
    ranges
        .filter(|signal| signal.range[0] < signal.range[1])
        .collect()
}

/// Makes every move that applies, in their order.
fn improve(context: &Context, pool: &mut Pool) -> Result<()> {
    for step in MOVES {
        if context
            .case
            .without_moves
            .iter()
            .any(|name| name == step.name())
        {
            continue;
        }
        for _ in 0..step.rounds() {
            if !step.applies(context, pool) {
                break;
            }
            if context.case.time.is_spent() {
                context.case.untried.note(step.name());
                break;
            }
            let Some(proposal) = step.propose(context, pool)? else {
                break;
            };
            if context.case.time.is_spent() {
                context.case.untried.note(step.name());
            }
            let before = pool.best_terms();
            pool.take(proposal);
            pool.choose(context.case, step.selection())?;
            if before.is_some() && pool.best_terms() == before {
                break;
            }
        }
    }
    Ok(())
}

/// The rig alone. What shorter intervals made of it may lie in a local minimum in which the refit
/// to whole recordings does not; and where the rig as written leaves less of the check recordings,
/// the refit begins there.
fn baseline(
    case: &Case,
    start: &Trial,
    plant: &Plant,
    values: &[f64],
) -> Result<Option<Candidate>> {
    let Some(base) = fit_baseline(case, start)? else {
        return Ok(None);
    };
    if !leaves_something(case, &base) {
        return Ok(Some(base));
    }
    let refitted = plant.values();
    if refitted != values
        && let Some(again) = fit_baseline_from(case, start, &refitted)?
        && !leaves_something(case, &again)
    {
        return Ok(Some(again));
    }
    if let Some(written) = leaves_less_as_written(case, &base)?
        && let Some(again) = fit_baseline_from(case, start, &written)?
        && share_left(case, &again, &base) < 1.0
    {
        return Ok(Some(again));
    }
    Ok(Some(base))
}
