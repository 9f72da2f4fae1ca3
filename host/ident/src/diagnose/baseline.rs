//! The baseline model: the rig without any added effect, which every candidate is compared with.

use crate::diagnose::config::CONFIG;
use std::ops::Range;

use sinew_sim::{Rig, SimulationSettings};

use crate::diagnose::acceptance::stands_out;
use crate::diagnose::candidate::{Candidate, Trial};
use crate::diagnose::case::Case;
use crate::diagnose::data::Data;
use crate::diagnose::model::Model;
use crate::diagnose::pool::Pool;
use crate::diagnose::residuals::Residuals;
use crate::diagnose::share::{beside_noise, share_left};
use crate::diagnose::split::Roles;
use crate::error::Result;
use crate::fit::levenberg::DecisionVariables;
use crate::fit::pace::pace;
use crate::fit::start;
use crate::fit::{Fit, FitOptions, fit};

/// Tells whether the rig as it came leaves nothing but noise.
///
/// # Errors
/// A rig that cannot be compiled.
pub(crate) fn explains_as_written(case: &Case, rig: &Rig) -> Result<bool> {
    let model = Model::new(rig, rig, &[], SimulationSettings::default())?;
    let values = model.plant.values();
    for (data, intervals) in [
        (case.fit, &case.fit_intervals),
        (case.check, &case.check_intervals),
    ] {
        match Residuals::of(&model, &values, data, intervals, None)? {
            Some(residuals) if !stands_out(&residuals, data) => {}
            _ => return Ok(false),
        }
    }
    Ok(true)
}

/// Parameters of the rig as written, where it leaves less of the check recordings than the refitted
/// one does: a refit to one recording may spoil the others.
///
/// # Errors
/// A rig that cannot be compiled.
pub(crate) fn leaves_less_as_written(case: &Case, base: &Candidate) -> Result<Option<Vec<f64>>> {
    let model = Model::new(case.written, case.written, &[], case.settings)?;
    let values = model.plant.values();
    let left = Residuals::of(&model, &values, case.check, &case.check_intervals, None)?;
    let less = left.is_some_and(|left| {
        beside_noise(&left, case.check) < beside_noise(&base.check, case.check)
    });
    Ok(less.then_some(values))
}

/// The baseline rig with the benefit of the doubt: fitted to the check recordings too, so that
/// nothing is called missing because a parameter was not known well enough.
pub(crate) fn fit_baseline(case: &Case, start: &Trial) -> Result<Option<Candidate>> {
    fit_baseline_from(case, start, &start.point.values)
}

/// The same, from other values of the rig's parameters.
pub(crate) fn fit_baseline_from(
    case: &Case,
    start: &Trial,
    values: &[f64],
) -> Result<Option<Candidate>> {
    let model = &start.model.integrated(case.settings);
    let mut intervals = case.fit_intervals.clone();
    let own = case.fit.experiments.len();
    let of_check = case.check_intervals.iter();
    intervals.extend(of_check.map(|(index, rows)| (own + index, rows.clone())));
    let mut segments = case.both.segments(&model.plant, &intervals)?;
    let states = case
        .both
        .starts(&model.rig, &model.plant, &segments, values)?;
    let problem = case.both.judging(&model.plant);
    let states = start::near(&problem, &segments, values, states);
    let from = DecisionVariables {
        values: values.to_vec(),
        states,
    };
    let Some(point) = model.improve(case.both, &mut segments, from, CONFIG.refit.steps, 1e-4)
    else {
        return Ok(None);
    };
    let left = |data: &Data, intervals: &[(usize, Range<usize>)]| {
        Residuals::of(model, &point.values, data, intervals, None)
    };
    let fit = left(case.fit, &case.fit_intervals)?;
    let check = left(case.check, &case.check_intervals)?;
    Ok(fit.zip(check).map(|(fit, check)| Candidate {
        trial: Trial {
            model: model.clone(),
            point,
            ..start.clone()
        },
        fit,
        check,
        all_rows: false,
    }))
}

/// The rig alone from the numbers of an explanation, where it leaves much less there than after its
/// own refit. A bare number stays what the rig says: with another one it would be another rig.
pub(crate) fn restart_baseline(
    case: &Case,
    start: &Trial,
    best: &Trial,
    base: &Candidate,
) -> Result<Option<Candidate>> {
    (case.progress)("the rig alone from the best one's numbers", 0, 1);
    let found = best.values_for(&start.model.plant, &start.point.values);
    let mut values = start.point.values.clone();
    for &slot in &start.model.slots {
        values[slot] = found[slot];
    }
    let again = fit_baseline_from(case, start, &values)?;
    Ok(again.filter(|again| share_left(case, again, base) < CONFIG.baseline.stopped_short))
}

/// The rig refitted to whole recordings from where the search took it, where the first refit had
/// stopped short and this one leaves less.
pub(crate) fn refit_again(
    pool: &Pool,
    refitted: &Fit,
    values: &[f64],
    case: &Case,
    roles: &Roles,
) -> Result<Option<Fit>> {
    if !pool.stopped_short {
        return Ok(None);
    }
    let base = &pool.baseline.trial;
    let pace_at = |values: &[f64]| pace(&base.model.plant, values, &case.fit.experiments);
    // Not where the rig got so stiff on the way that a fit to whole recordings takes minutes.
    let affordable = pace_at(&base.point.values) < CONFIG.baseline.slowest * pace_at(values);
    if !affordable {
        return Ok(None);
    }
    let nearer = base.model.with(&base.point.values)?;
    let options = FitOptions {
        iterations: CONFIG.baseline.again_steps,
        near: true,
        ..FitOptions::default()
    };
    let again = fit(&nearer, &roles.fit, &options, &mut |_| {}).ok();
    Ok(again.filter(|again| error(again) < error(refitted)))
}

/// Error that a fit leaves of the recordings that it saw, all sensors together.
fn error(fitted: &Fit) -> f64 {
    let signals = fitted.sensors.iter();
    signals.map(|s| s.rms.max(f64::MIN_POSITIVE).ln()).sum()
}
