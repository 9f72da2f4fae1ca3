//! Faults of sensors that a named effect imitates: a steady drift looks like a load on what nothing
//! holds, and sensors that are all late look like a late input.

use sinew_sim::effects::Family;

use crate::diagnose::acceptance::leaves_something;
use crate::diagnose::attribution::alone;
use crate::diagnose::candidate::Candidate;
use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::finding::{FoundEffect, Rival};
use crate::diagnose::pool::Pool;
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::report::quantity;

/// Kind of a check by which a rival is named that is a drift of a sensor.
pub(crate) const DRIFT: &str = "sensor_drift";

/// Kind of a check by which a rival is named that is a late sensor.
pub(crate) const LATE: &str = "sensor_lags";

/// Says of each effect which faults of sensors look the same. A drift lowers the confidence; a late
/// sensor does where the check of the recordings named it.
///
/// # Errors
/// A rig that cannot be compiled.
pub(crate) fn doubt(
    effects: &mut [FoundEffect],
    (found, index): (&Pool, usize),
    case: &Case,
) -> Result<Vec<String>> {
    let mut reasons = Vec::new();
    let named = &found.candidates[index];
    let single = case.written.actuators.len() == 1;
    for effect in effects {
        if effect.kind == "input_delay" && single {
            let names = case
                .written
                .sensors
                .iter()
                .map(|sensor| sensor.name.as_str());
            let names: Vec<&str> = names.collect();
            let (many, verb) = match names.len() {
                1 => ("", "is"),
                _ => ("s", "are"),
            };
            effect.sentence += &format!(
                " Sensor{many} {} that {verb} as late would look the same: these recordings do not \
                 tell them apart.",
                names.join(" and ")
            );
            effect
                .indistinguishable_from
                .push(fault(LATE, names.join("+")));
        }
        let is_named = |term: &&Term| {
            let sites = term.effect().map_or(&[][..], |(_, sites)| sites);
            term.kind() == effect.kind && sites.iter().any(|site| site.name == effect.component)
        };
        let Some(term) = named.terms().iter().find(is_named) else {
            continue;
        };
        if term.family() != Some(Family::Load) {
            continue;
        }
        for (sensor, rate) in drifts(found, named, term, case)? {
            let known = &named.trial.model.plant.sensors()[sensor];
            let name = &case.written.sensors[sensor].name;
            effect.sentence += &format!(
                " A drift of {name} by {} a second would look the same: these recordings do not \
                 tell them apart.",
                quantity(rate, &known.unit)
            );
            effect
                .indistinguishable_from
                .push(fault(DRIFT, name.clone()));
            effect.confidence *= CONFIG.calibration.doubt;
            reasons.push(format!("less sure: {name} may drift instead"));
        }
    }
    Ok(reasons)
}

/// A fault of a sensor as a rival without a share of the evidence.
fn fault(kind: &str, component: String) -> Rival {
    Rival {
        kind: kind.to_owned(),
        component,
        confidence: 0.0,
    }
}

/// Sensors of which a steady drift explains the recordings as well as a load does, each with its
/// rate, SI a second.
fn drifts(found: &Pool, named: &Candidate, load: &Term, case: &Case) -> Result<Vec<(usize, f64)>> {
    let mut alike = Vec::new();
    for sensor in 0..case.written.sensors.len() {
        if case.time.is_spent() {
            break;
        }
        let Some(rate) = first_rate(named, load, sensor, case)? else {
            continue;
        };
        if let Some(rate) = drifting(found, named, (load, sensor, rate), case)? {
            alike.push((sensor, rate));
        }
    }
    Ok(alike)
}

/// Steady rate at which a load moves a sensor in the end: the slope of the second half of what it
/// does over the longest recording.
fn first_rate(named: &Candidate, load: &Term, sensor: usize, case: &Case) -> Result<Option<f64>> {
    let (model, values) = (&named.trial.model, &named.trial.point.values);
    let whole = case.fit.cut(1);
    let Some(longest) = whole.iter().max_by_key(|(_, rows)| rows.len()) else {
        return Ok(None);
    };
    let segments = case
        .fit
        .segments(&model.plant, std::slice::from_ref(longest))?;
    let starts = (case.fit).starts(&model.rig, &model.plant, &segments, values)?;
    let mut without = values.clone();
    for name in load.sizes().iter().flatten() {
        if let Some(slot) = model.plant.slot(name) {
            without[slot] = 0.0;
        }
    }
    let problem = case.fit.judging(&model.plant);
    let (Some(segment), Some(start)) = (segments.first(), starts.first()) else {
        return Ok(None);
    };
    let both = [values, &without].map(|values| problem.signals(segment, values, start));
    let [Some(with), Some(without)] = both else {
        return Ok(None);
    };
    let count = case.fit.sigma.len();
    let rows = segment.rows.len();
    let t = &case.fit.experiments[segment.experiment].t;
    let late = (rows / 2..rows).map(|at| {
        let moved = with[at * count + sensor] - without[at * count + sensor];
        (t[segment.rows.start + at], moved)
    });
    let late: Vec<(f64, f64)> = late.collect();
    Ok(slope(&late).filter(|rate| rate.is_finite() && *rate != 0.0))
}

/// The rate at which a drift of a sensor explains the recordings as well as the load does; `None`
/// where none does.
fn drifting(
    found: &Pool,
    named: &Candidate,
    (load, sensor, mut rate): (&Term, usize, f64),
    case: &Case,
) -> Result<Option<f64>> {
    let others: Vec<Term> = (named.terms().iter())
        .filter(|term| *term != load)
        .cloned()
        .collect();
    for _ in 0..CONFIG.imitations.rounds {
        let fit = case.fit.without_drift(sensor, rate);
        let check = case.check.without_drift(sensor, rate);
        let still = case.over(&fit, &check);
        let again = alone(&still, &named.trial, &found.baseline.trial, &others)?;
        let Some(again) = again else {
            return Ok(None);
        };
        let sensors = 0..case.check.noise.len();
        let as_small = sensors.clone().all(|s| {
            let named = named.check.rms(s).max(case.check.noise[s]);
            again.check.rms(s) <= CONFIG.imitations.as_small * named
        });
        if as_small || !leaves_something(&still, &again) {
            return Ok(Some(rate));
        }
        let missed = left_slope(&again, sensor, &still);
        let Some(missed) = missed.filter(|missed| missed.is_finite()) else {
            return Ok(None);
        };
        rate += missed;
    }
    Ok(None)
}

/// Mean slope of what a candidate leaves of a sensor over the intervals that it was fitted to.
fn left_slope(candidate: &Candidate, sensor: usize, case: &Case) -> Option<f64> {
    let origin = candidate.fit.origin[sensor].iter();
    let left = candidate.fit.series[sensor].iter().flatten();
    let mut parts: Vec<Vec<(f64, f64)>> = vec![Vec::new(); case.fit.experiments.len()];
    for ((recording, row), residual) in origin.zip(left) {
        parts[*recording].push((case.fit.experiments[*recording].t[*row], *residual));
    }
    let slopes: Vec<f64> = parts.iter().filter_map(|part| slope(part)).collect();
    let count = slopes.len();
    (count > 0).then(|| slopes.into_iter().sum::<f64>() / count as f64)
}

/// Slope of a line through points, by least squares.
fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let count = points.len() as f64;
    let sums = points
        .iter()
        .fold((0.0, 0.0), |(t, y), point| (t + point.0, y + point.1));
    let (t, y) = (sums.0 / count, sums.1 / count);
    let (along, square) = points.iter().fold((0.0, 0.0), |(along, square), point| {
        let from = point.0 - t;
        (along + from * (point.1 - y), square + from * from)
    });
    (square > 0.0).then(|| along / square)
}
