//! A learned force where no law of the vocabulary fits: one without a name is learned at the place
//! of the mismatch, as a spring and a damping in knots (docs/explanation/plant.md, eq. 12d;
//! docs/explanation/diagnosis.md, eq. 18).

use crate::diagnose::config::CONFIG;
use nalgebra::{DMatrix, DVector};
use sinew_sim::Rig;
use sinew_sim::effects::{Kind, Sign, learned_force};
use sinew_sim::rig::Site;

use crate::diagnose::case::Case;
use crate::diagnose::corrected::falls;
use crate::diagnose::details::Recovered;
use crate::diagnose::model::Model;
use crate::diagnose::residuals::Residuals;
use crate::diagnose::split::Roles;
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::fit::levenberg::DecisionVariables;
use crate::fit::{SensorError, score};
use crate::order;

/// The refitted rig with a learned force at `component`; none where that does not help on
/// recordings that it was not learned from, or where no force can sit there.
///
/// # Errors
/// A rig that cannot be compiled.
pub(crate) fn learn(
    refitted: &Rig,
    component: &str,
    recovered: &Recovered,
    case: &Case,
    roles: &Roles,
) -> Result<Option<Rig>> {
    let kind = Kind::Learned;
    let Ok(site) = refitted.site(kind, component) else {
        return Ok(None);
    };
    let Some(frame) = frame(rest(refitted, site), recovered) else {
        return Ok(None);
    };
    let (values, _) = from_recovered(frame, rest(refitted, site), recovered);
    let term = Term::at(refitted, kind, &[site]);
    let rig = term.apply(refitted, &values)?;
    let model =
        Model::new(&rig, refitted, &[term], case.settings)?.doubting(CONFIG.learned_force.width);
    let data = case.fit;
    let mut segments = data.segments(&model.plant, &case.fit_intervals)?;
    let values = model.plant.values();
    let from = DecisionVariables {
        states: data.starts(&rig, &model.plant, &segments, &values)?,
        values,
    };
    let Some(point) = model.improve(data, &mut segments, from, CONFIG.learned_force.steps, 1e-4)
    else {
        return Ok(None);
    };
    let learned = model.with(&point.values)?;
    let helps = falls(refitted, &learned, &roles.check, CONFIG.learned_force.worth)
        && in_stretches(refitted, &learned, case)?
        && everywhere(refitted, &learned, case.in_parts, roles)?;
    Ok(helps.then_some(learned))
}

/// Tells whether no recording speaks against it, those that it was learned from among them: in
/// intervals with start states of their own a force may help that carries a whole recording away.
/// All together fall where one that both lose falls, and that says nothing of those that only the
/// refitted rig follows.
fn everywhere(before: &Rig, after: &Rig, in_parts: bool, roles: &Roles) -> Result<bool> {
    for recording in roles.fit.iter().chain(&roles.check).chain(&roles.test) {
        let of = |rig: &Rig| score(rig, std::slice::from_ref(recording));
        let pairs = of(before)?.into_iter().zip(of(after)?);
        if !pairs
            .into_iter()
            .all(|(before, after)| keeps_up(&before, &after, in_parts))
        {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Tells whether a free run gets no worse, and does not lose the device: its error stays below the
/// signal's own spread, unless the device drifts by itself.
fn keeps_up(before: &SensorError, after: &SensorError, in_parts: bool) -> bool {
    let lost = after.rms.is_nan() || after.rms > after.spread;
    after.rms <= before.rms && (in_parts || !lost)
}

/// Tells whether the error over the check intervals falls as well: over a whole recording, that of
/// a body which nothing holds in place is mostly how far it has drifted.
fn in_stretches(before: &Rig, after: &Rig, case: &Case) -> Result<bool> {
    let of = |rig: &Rig| -> Result<f64> {
        let model = Model::new(rig, rig, &[], case.settings)?;
        let values = model.plant.values();
        let residuals = Residuals::of(&model, &values, case.check, &case.check_intervals, None)?;
        let sensors = case.check.noise.len();
        let logs = |residuals: Residuals| {
            (0..sensors)
                .map(|s| residuals.rms(s).max(f64::MIN_POSITIVE).ln())
                .sum()
        };
        Ok(residuals.map_or(f64::INFINITY, logs) / sensors as f64)
    };
    Ok(of(after)? < of(before)? + CONFIG.learned_force.worth.ln())
}

/// Middle and reach of the position, and the largest speed, that the place has met but rarely.
fn frame(rest: f64, recovered: &Recovered) -> Option<[f64; 3]> {
    let all = |of: fn(&crate::diagnose::ForceTrace) -> &Vec<f64>| -> Vec<f64> {
        let mut all: Vec<f64> = recovered
            .traces
            .iter()
            .flat_map(|t| of(t).clone())
            .collect();
        order::sort(&mut all);
        all
    };
    let position = all(|trace| &trace.position);
    let mut speed: Vec<f64> = all(|trace| &trace.velocity)
        .iter()
        .map(|v| v.abs())
        .collect();
    order::sort(&mut speed);
    let at = |sorted: &[f64], part: f64| -> Option<f64> {
        let last = sorted.len().checked_sub(1)?;
        Some(sorted[(part * last as f64).round() as usize])
    };
    let (low, high) = (
        at(&position, CONFIG.learned_force.rare)?,
        at(&position, 1.0 - CONFIG.learned_force.rare)?,
    );
    let frame = [
        0.5 * (low + high) - rest,
        0.5 * (high - low),
        at(&speed, 1.0 - CONFIG.learned_force.rare)?,
    ];
    (frame.iter().all(|x| x.is_finite()) && frame[1] > 0.0 && frame[2] > 0.0).then_some(frame)
}

/// Rest length, which a law at a place does not count as extension.
fn rest(rig: &Rig, site: Site) -> f64 {
    match site {
        Site::Spring(spring) => rig.springs[spring].rest.value,
        _ => 0.0,
    }
}

/// The knots that follow the recovered force best, dampings not below zero, where the fit begins;
/// and the slopes over position and velocity that the refitted rig has wrong. Coordinate by
/// coordinate on the normal equations, each knot held a little to none.
fn from_recovered(frame: [f64; 3], rest: f64, recovered: &Recovered) -> (Vec<f64>, [f64; 2]) {
    let parameters = Kind::Learned.description().parameters;
    // A refitted stiffness and damping make up for what is missing, and two more
    // columns give that back: a damping that was fitted too large would else leave nothing for one
    // that takes energy out.
    let knots = parameters.len() - frame.len();
    let columns = knots + 2;
    let mut normal = DMatrix::<f64>::zeros(columns, columns);
    let mut right = DVector::<f64>::zeros(columns);
    let mut unit = vec![0.0; parameters.len()];
    unit[..frame.len()].copy_from_slice(&frame);
    for trace in &recovered.traces {
        let rows = trace.force.iter().zip(&trace.position).zip(&trace.velocity);
        for ((force, position), velocity) in rows {
            let x = position - rest;
            let mut row = DVector::zeros(columns);
            for knot in 0..knots {
                unit[frame.len() + knot] = 1.0;
                row[knot] = learned_force(&unit, x, *velocity);
                unit[frame.len() + knot] = 0.0;
            }
            row[knots] = (x - frame[0]) / frame[1];
            row[knots + 1] = velocity / frame[2];
            right += &row * *force;
            normal += &row * row.transpose();
        }
    }
    let mut found = vec![0.0; columns];
    for _ in 0..CONFIG.learned_force.sweeps {
        for knot in 0..columns {
            let others: f64 = (0..columns).map(|k| normal[(knot, k)] * found[k]).sum();
            let own = normal[(knot, knot)];
            let best = (right[knot] - others + own * found[knot])
                / (own * (1.0 + CONFIG.learned_force.shrinkage));
            let low = match parameters.get(frame.len() + knot).map(|spec| spec.sign) {
                Some(Sign::NonNegative) => 0.0,
                _ => f64::NEG_INFINITY,
            };
            found[knot] = if own > 0.0 { best.max(low) } else { 0.0 };
        }
    }
    unit[frame.len()..].copy_from_slice(&found[..knots]);
    let implausible = [found[knots] / frame[1], found[knots + 1] / frame[2]];
    (unit, implausible)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::ForceTrace;

    /// Free runs over two of the servo's four check recordings go round, by six turns and by one. A
    /// force brought their pooled error from 7.8 to 4.3 rad, and was thirteen times worse on the
    /// test recordings.
    #[test]
    fn a_force_that_loses_a_recording_or_spoils_one_is_not_trusted() {
        let error = |rms: f64| SensorError {
            signal: "q_rad".into(),
            unit: "rad".into(),
            rms,
            spread: 0.8,
            samples: 1000,
        };
        let trusted = |before: f64, after: f64| keeps_up(&error(before), &error(after), false);
        assert!(trusted(0.2, 0.1) && trusted(0.2, 0.2) && trusted(3.0, 0.7));
        assert!(!trusted(0.2, 0.201));
        assert!(!trusted(15.0, 8.0) && !trusted(15.0, f64::NAN));
        assert!(keeps_up(&error(15.0), &error(8.0), true));
    }

    /// The demo's recordings, and its rig with and without the friction that is in them.
    #[test]
    fn a_force_is_not_trusted_where_it_spoils_what_it_was_learned_from() -> Result<()> {
        use crate::recording::Recording;
        let rigs = concat!(env!("CARGO_MANIFEST_DIR"), "/../../rigs/mass-spring-damper");
        let own = Rig::load(format!("{rigs}.toml"))?;
        let dry = Kind::named("coulomb_friction").expect("the effect is in the vocabulary");
        let rubs = own.with_effect(dry, own.site(dry, "mass")?, &[0.58])?;
        let roles = Roles {
            fit: vec![Recording::read(format!("{rigs}.fit.csv"))?],
            check: Vec::new(),
            test: Vec::new(),
            set_aside: None,
            by_itself: false,
        };
        assert!(everywhere(&own, &rubs, false, &roles)?);
        assert!(!everywhere(&rubs, &own, false, &roles)?);
        Ok(())
    }

    /// A damping by the root of speed and a wavy spring: neither is in the vocabulary.
    #[test]
    fn knots_follow_a_recovered_force_and_dampings_stay_above_zero() {
        let law = |x: f64, v: f64| -3.0 * v.signum() * v.abs().sqrt() - (4.0 * x).sin();
        let t: Vec<f64> = (0..4000).map(|k| 0.01 * f64::from(k)).collect();
        let position: Vec<f64> = t.iter().map(|t| t.sin() * (0.37 * t).cos()).collect();
        let velocity: Vec<f64> = t
            .iter()
            .map(|t| t.cos() * (0.37 * t).cos() - 0.37 * t.sin() * (0.37 * t).sin())
            .collect();
        let pairs = || position.iter().zip(&velocity);
        let recovered = Recovered {
            component: "mass".into(),
            unit: "N".into(),
            position_unit: "m".into(),
            traces: vec![ForceTrace {
                recording: "a.csv".into(),
                force: pairs().map(|(x, v)| law(*x, *v)).collect(),
                t,
                position: position.clone(),
                velocity: velocity.clone(),
                law: Vec::new(),
            }],
        };
        let frame = frame(0.0, &recovered).expect("the mass moves");
        let (found, implausible) = from_recovered(frame, 0.0, &recovered);
        assert!(found[12..].iter().all(|damping| *damping >= 0.0));
        let squares =
            |of: &dyn Fn(f64, f64) -> f64| pairs().map(|(x, v)| of(*x, *v).powi(2)).sum::<f64>();
        let left = squares(&|x, v| {
            let straight = implausible[0] * (x - frame[0]) + implausible[1] * v;
            learned_force(&found, x, v) + straight - law(x, v)
        }) / squares(&law);
        assert!(left < 0.01, "{left}");
        // A law that would drive: nothing of it can be learned as a damping.
        let mut driving = recovered;
        driving.traces[0].force = driving.traces[0].velocity.clone();
        let (found, _) = from_recovered(frame, 0.0, &driving);
        assert!(found[12..].iter().all(|damping| *damping == 0.0));
    }
}
