//! Full refits: what the halving found, fitted to everything (docs/explanation/diagnosis.md,
//! "Successive halving").

use crate::diagnose::candidate::{Candidate, Trial};
use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::data::Starts;
use crate::diagnose::residuals::Residuals;
use crate::diagnose::search::halving::successive_halving;
use crate::diagnose::search::subset::{Subset, pieces_of};
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::fit::levenberg::DecisionVariables;
use crate::parallel;

/// Fits what a screening found to all of the fit recordings and looks at what it leaves of both
/// roles.
pub(crate) fn refit(
    case: &Case,
    subset: &Subset,
    trial: &Trial,
    steps: usize,
) -> Result<Option<Candidate>> {
    let model = &trial.model.integrated(case.settings);
    let segments = case.fit.segments(&model.plant, &case.fit_intervals)?;
    let found = Starts {
        data: subset.data,
        intervals: &subset.intervals,
        states: &trial.point.states,
    };
    let states = (case.fit).carried(
        (&model.rig, &model.plant),
        &trial.point.values,
        &segments,
        found,
    )?;
    let from = DecisionVariables {
        values: trial.point.values.clone(),
        states,
    };
    let direct = refit_from(case, trial, from, steps)?;
    let explained = |cost: f64, samples: f64| cost < CONFIG.refit.explained * 0.5 * samples;
    let lost = explained(trial.point.cost, subset.samples())
        && !direct.as_ref().is_some_and(|direct| {
            let samples = case.fit.samples(&case.fit_intervals);
            explained(direct.trial.point.cost, samples)
        });
    if !lost {
        return Ok(direct);
    }
    let joined = refit_in_pieces(case, trial, found, steps)?;
    let cost = |one: &Candidate| one.trial.point.cost;
    Ok([direct, joined]
        .into_iter()
        .flatten()
        .min_by(|a, b| cost(a).total_cmp(&cost(b))))
}

/// As [`refit`], in pieces that are joined step by step: over a whole recording a friction that is
/// a little off stops the device where it slid on, and no step from there leads back.
fn refit_in_pieces(
    case: &Case,
    trial: &Trial,
    found: Starts,
    steps: usize,
) -> Result<Option<Candidate>> {
    let model = &trial.model.integrated(case.settings);
    let mut values = trial.point.values.clone();
    let mut intervals = found.intervals.to_vec();
    let mut states = found.states.to_vec();
    let mut data = found.data;
    for pieces in CONFIG.refit.pieces {
        let next = pieces_of(&case.fit_intervals, pieces);
        let mut segments = case.fit.segments(&model.plant, &next)?;
        let known = Starts {
            data,
            intervals: &intervals,
            states: &states,
        };
        let starts = (case.fit).along((&model.rig, &model.plant), &values, &segments, known)?;
        let from = DecisionVariables {
            values,
            states: starts,
        };
        if pieces == 1 {
            return refit_from(case, trial, from, steps);
        }
        let Some(point) =
            model.improve(case.fit, &mut segments, from, steps, CONFIG.refit.tolerance)
        else {
            return Ok(None);
        };
        (values, states) = (point.values, point.states);
        (intervals, data) = (next, case.fit);
    }
    Ok(None)
}

/// As [`refit`], from here.
pub(crate) fn refit_from(
    case: &Case,
    trial: &Trial,
    from: DecisionVariables,
    steps: usize,
) -> Result<Option<Candidate>> {
    let model = &trial.model.integrated(case.settings);
    let mut segments = case.fit.segments(&model.plant, &case.fit_intervals)?;
    let Some(mut point) =
        model.improve(case.fit, &mut segments, from, steps, CONFIG.refit.tolerance)
    else {
        return Ok(None);
    };
    crate::diagnose::canonical::settle(model, &trial.terms, &mut point);
    // A number that the data leave near zero may end on the wrong side of it.
    let signed: Vec<String> = (trial.terms.iter())
        .flat_map(Term::not_below_zero)
        .collect();
    let signed = model.clone().signed(&signed);
    let values = signed.within(&point.values);
    let model = if values == point.values {
        model
    } else {
        &signed
    };
    if values != point.values {
        let states = point.states.clone();
        let from = DecisionVariables { values, states };
        let within = model.improve(case.fit, &mut segments, from, steps, CONFIG.refit.tolerance);
        let Some(within) = within else {
            return Ok(None);
        };
        point = within;
    }
    with_residuals(
        case,
        Trial {
            model: model.clone(),
            point,
            ..trial.clone()
        },
    )
}

/// Residuals of both roles.
fn with_residuals(case: &Case, trial: Trial) -> Result<Option<Candidate>> {
    let (model, point) = (&trial.model, &trial.point);
    let left =
        |data, intervals, states| Residuals::of(model, &point.values, data, intervals, states);
    let fit = left(case.fit, &case.fit_intervals, Some(&point.states[..]))?;
    let check = left(case.check, &case.check_intervals, None)?;
    Ok(fit.zip(check).map(|(fit, check)| Candidate {
        trial,
        fit,
        check,
        all_rows: false,
    }))
}

/// An explanation with these parameters, its start states fitted, and what it leaves.
pub(crate) fn with_values(
    case: &Case,
    trial: &Trial,
    values: Vec<f64>,
) -> Result<Option<Candidate>> {
    let model = &trial.model.integrated(case.settings);
    let mut segments = case.fit.segments(&model.plant, &case.fit_intervals)?;
    let states = trial.point.states.clone();
    let from = DecisionVariables { values, states };
    let Some(point) = model
        .held()
        .improve(case.fit, &mut segments, from, CONFIG.refit.steps, 1e-4)
    else {
        return Ok(None);
    };
    with_residuals(
        case,
        Trial {
            model: model.clone(),
            point,
            ..trial.clone()
        },
    )
}

/// One screening and its final.
pub(crate) fn screen_and_refit(
    case: &Case,
    subset: &Subset,
    parent: &Trial,
    all: &[Term],
    what: &str,
) -> Result<Vec<Candidate>> {
    let trial = screened(case, subset, parent, all, what)?;
    refit_best(case, subset, &trial, what)
}

/// One screening, its progress told.
pub(crate) fn screened(
    case: &Case,
    subset: &Subset,
    parent: &Trial,
    all: &[Term],
    what: &str,
) -> Result<Vec<Trial>> {
    successive_halving(subset, parent, all, case.progress_of(what))
}

/// The best of a screening, fitted to everything.
pub(crate) fn refit_best(
    case: &Case,
    subset: &Subset,
    trial: &[Trial],
    what: &str,
) -> Result<Vec<Candidate>> {
    // Where the time is over, the best is fitted all the same: the answer is the best so far.
    let most = if case.time.is_spent() {
        1
    } else {
        CONFIG.refit.candidates
    };
    let most = trial.len().min(most);
    let count = case.progress_of(what).count("fitted to everything", most);
    let refits = parallel::map(&trial[..most], |trial| {
        let candidate = refit(case, subset, trial, CONFIG.refit.steps)
            .ok()
            .flatten();
        count.one();
        candidate
    });
    Ok(refits.into_iter().flatten().collect())
}
