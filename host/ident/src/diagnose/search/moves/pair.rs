//! Two effects: which firsts a second one is looked for on, what is exchanged, and what does
//! without (docs/lab/0037-exchange-of-paired-effects.md).

use crate::diagnose::acceptance::{leaves_something, ranking};
use crate::diagnose::candidate::{Candidate, Trial};
use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::data::Starts;
use crate::diagnose::pool::{Pool, Proposal, Selection};
use crate::diagnose::search::context::{Context, Move};
use crate::diagnose::search::moves::short_horizon::pairs_on_short_intervals;
use crate::diagnose::search::refit::screen_and_refit;
use crate::diagnose::search::refocus::{affordable, refocused};
use crate::diagnose::search::subset::Subset;
use crate::diagnose::share::{share_fitted, share_left};
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::fit::levenberg::DecisionVariables;

/// Adds a second term to the best single ones.
pub(crate) struct Pair;

impl Move for Pair {
    fn name(&self) -> &'static str {
        "pair"
    }

    fn applies(&self, context: &Context, pool: &Pool) -> bool {
        let case = context.case;
        !pool.is_explained(case) && case.has_rows_for_two() && !pool.candidates.is_empty()
    }

    fn propose(&self, context: &Context, pool: &Pool) -> Result<Option<Proposal>> {
        let Context {
            case,
            subset,
            start,
            terms,
            ..
        } = context;
        let (base, singles) = (&pool.baseline, &pool.candidates);
        let order = ranking(case, base, singles);
        let leader = order
            .first()
            .and_then(|&index| singles[index].terms().first());
        let short = pairs_on_short_intervals(case, subset, &pool.short, leader, terms)?;
        let Some(short) = short else {
            return Ok(None);
        };
        Ok(Some(Proposal {
            candidates: pairs(case, subset, start, base, singles, short, terms)?,
            short: None,
            undivided: true,
        }))
    }

    fn selection(&self) -> Selection {
        Selection::Unchanged
    }
}

/// A second effect on top of the best single ones, unless one of the pairs that were found on
/// `short` intervals explains everything. Once something leaves no more than noise, only what came
/// close to the best is tried as well. Then the best pair's newcomer is kept and its parent
/// exchanged: once in any case, for something simpler may do beside it, and again as long as
/// nothing explains all.
pub(crate) fn pairs(
    case: &Case,
    subset: &Subset,
    start: &Trial,
    base: &Candidate,
    singles: &[Candidate],
    short: Vec<Candidate>,
    all: &[Term],
) -> Result<Vec<Candidate>> {
    let left = |index: usize| share_left(case, &singles[index], base);
    let order = ranking(case, base, singles);
    let least = order.iter().map(|&index| left(index)).fold(1.0, f64::min);
    let leads =
        |rank: usize, trial: &Trial| matches!(&trial.terms[..], [one] if one.may_lead(rank));
    let beam = (order.into_iter().enumerate())
        .filter(|&(rank, index)| leads(rank, &singles[index].trial))
        .map(|(_, index)| index)
        .filter(|&index| {
            let fitted = share_fitted(case, &singles[index], base);
            left(index) < CONFIG.pair.hopeless.min(CONFIG.pair.behind * least)
                || fitted < CONFIG.pair.fitted
        })
        .take(CONFIG.pair.parents);
    if short.iter().any(|pair| !leaves_something(case, pair)) {
        return Ok(short);
    }
    let mut parents: Vec<Term> = Vec::new();
    let mut pairs = short;
    for index in beam {
        if case.time.is_spent() {
            break;
        }
        let done = pairs.iter().any(|pair| !leaves_something(case, pair));
        if done && left(index) > CONFIG.pair.close * least {
            continue;
        }
        let found = Starts {
            data: case.fit,
            intervals: &case.fit_intervals,
            states: &singles[index].trial.point.states,
        };
        if let Some(parent) = on_track(subset, &singles[index].trial, found)? {
            parents.extend(parent.terms.clone());
            pairs.extend(with_second(case, subset, &parent, all)?);
        }
    }
    for exchange in 0..CONFIG.pair.exchanges {
        let explained = || pairs.iter().any(|pair| !leaves_something(case, pair));
        if case.time.is_spent() || exchange > 0 && explained() {
            break;
        }
        let Some(&best) = ranking(case, base, &pairs).first() else {
            break;
        };
        let pair = &pairs[best].trial;
        let fresh = |term: &&Term| !parents.contains(term);
        let Some(kept) = pair.terms.iter().find(fresh).cloned() else {
            break;
        };
        parents.push(kept.clone());
        if let Some(parent) = subset.alone(start, pair, &kept, CONFIG.screening.more_steps)? {
            pairs.extend(with_second(case, subset, &parent, all)?);
        }
    }
    Ok(pairs)
}

/// Every other effect on top of one.
fn with_second(
    case: &Case,
    subset: &Subset,
    parent: &Trial,
    all: &[Term],
) -> Result<Vec<Candidate>> {
    let second = |term: &&Term| term.may_join(&parent.terms);
    let rest: Vec<Term> = all.iter().filter(second).cloned().collect();
    // Where the parent explains the whole subset, what it lacks lies between the intervals of the
    // subset.
    let own = match refocused(subset, parent)? {
        Some(own) => own,
        None => affordable(subset, parent)?,
    };
    if own.intervals == subset.intervals {
        return screen_and_refit(case, subset, parent, &rest, "two effects");
    }
    let found = Starts {
        data: subset.data,
        intervals: &subset.intervals,
        states: &parent.point.states,
    };
    match on_track(&own, parent, found)? {
        Some(parent) => screen_and_refit(case, &own, &parent, &rest, "two effects"),
        None => Ok(Vec::new()),
    }
}

/// A trial that was fitted elsewhere, taken to a subset; `found` are its start states there.
fn on_track(subset: &Subset, trial: &Trial, found: Starts) -> Result<Option<Trial>> {
    let model = trial.model.integrated(subset.settings);
    let mut segments = subset.data.segments(&model.plant, &subset.intervals)?;
    let values = trial.point.values.clone();
    let states = (subset.data).along((&model.rig, &model.plant), &values, &segments, found)?;
    let from = DecisionVariables { values, states };
    let (steps, tolerance) = (CONFIG.pair.parent_steps, CONFIG.refit.tolerance);
    let point = model.improve(subset.data, &mut segments, from, steps, tolerance);
    Ok(point.map(|point| Trial {
        model,
        point,
        ..trial.clone()
    }))
}
