//! Lags that only the start of a recording tells apart.
//!
//! A lag of a sensor and one of an actuator are the same in a linear rig, but for what stood before
//! the first row. An actuator's lag is at rest at the first command (docs/explanation/plant.md). A
//! recording that begins with a step, as a script makes it that logs and commands at once, refutes
//! that rest and not the actuator. So the rival is fitted again with no command before the first.

use sinew_sim::effects::Kind;
use sinew_sim::rig::Site;

use crate::diagnose::acceptance::leaves_something;
use crate::diagnose::attribution::alone_from;
use crate::diagnose::candidate::Candidate;
use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::finding::{FoundEffect, Rival};
use crate::diagnose::pool::Pool;
use crate::diagnose::term::Term;
use crate::error::Result;

/// Says of each lag of a sensor which lags of actuators look the same once nothing was commanded
/// before the first row, and lowers its confidence.
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
    let known = Kind::SensorLag.description().kind;
    for effect in effects.iter_mut().filter(|effect| effect.kind == known) {
        let is_it = |term: &&Term| term.kind() == known && term.component() == effect.component;
        let Some(lag) = named.terms().iter().find(is_it) else {
            continue;
        };
        for (actuator, described) in case.written.actuators.iter().enumerate() {
            if case.time.is_spent() {
                break;
            }
            let term = Term::at(case.written, Kind::ActuatorLag, &[Site::Actuator(actuator)]);
            if !looks_the_same(found, named, (lag, &term), case)? {
                continue;
            }
            effect.sentence += &format!(
                " A lag of {} would look the same if nothing was commanded before the first row: \
                 these recordings do not tell them apart.",
                described.name
            );
            effect.indistinguishable_from.push(Rival {
                kind: term.kind().to_owned(),
                component: described.name.clone(),
                confidence: 0.0,
            });
            effect.confidence *= CONFIG.calibration.doubt;
            reasons.push(format!("less sure: {} may lag instead", described.name));
        }
    }
    Ok(reasons)
}

/// Tells whether the rival, in the place of the lag, explains recordings as well before which
/// nothing was commanded.
fn looks_the_same(
    found: &Pool,
    named: &Candidate,
    (lag, rival): (&Term, &Term),
    case: &Case,
) -> Result<bool> {
    let others = named.terms().iter().filter(|term| *term != lag);
    let terms: Vec<Term> = others.chain([rival]).cloned().collect();
    let plant = &found.baseline.trial.model.plant;
    let [fit, check] = [case.fit, case.check].map(|data| data.after_no_command(plant));
    let mut begun = case.over(&fit, &check);
    for intervals in [&mut begun.fit_intervals, &mut begun.check_intervals] {
        for (_, rows) in intervals.iter_mut() {
            *rows = rows.start + 1..rows.end + 1;
        }
    }
    // It lags by as much.
    let by = lag.parameters().first().cloned().unwrap_or_default();
    let by = named.trial.model.plant.slot(&by);
    let by = by.map_or(0.0, |slot| named.trial.point.values[slot]);
    let base = &found.baseline.trial;
    let Some(again) = alone_from(&begun, &named.trial, base, &terms, by)? else {
        return Ok(false);
    };
    let as_small = (0..case.check.noise.len()).all(|s| {
        let named = named.check.rms(s).max(case.check.noise[s]);
        again.check.rms(s) <= CONFIG.imitations.as_small * named
    });
    Ok(as_small || !leaves_something(&begun, &again))
}
