//! Diagnosis: where a simulation and a recording differ, and which physics was left out (docs/explanation/diagnosis.md).

mod acceptance;
mod calibration;
mod candidate;
mod canonical;
mod corrected;
mod data;
mod details;
mod evidence;
#[cfg(test)]
mod example;
mod finding;
mod identical;
mod locate;
mod model;
mod next_experiment;
mod noise;
pub mod output;
mod progress;
mod report;
mod residuals;
mod search;
mod split;
#[cfg(test)]
mod tests;
mod verify;

use sinew_sim::{Plant, Rig};

use self::data::Data;
pub use self::details::{Details, Finalist, ForceTrace, Recovered};
pub use self::finding::{
    Diagnosis, Errors, Estimate, FORMAT, FoundEffect, Interval, Location, Rival, SignalFit, Verdict,
};
use self::search::Case;
use self::split::Roles;
use crate::error::Result;
use crate::fit::pace::pace;
use crate::fit::{Fit, FitOptions, fit};
use crate::recording::Recording;

/// Recordings by role.
#[derive(Clone, Debug, Default)]
pub struct Recordings {
    /// These estimate parameters.
    pub fit: Vec<Recording>,
    /// These decide what is believed; where there are none, part of `fit` is set aside.
    pub check: Vec<Recording>,
    /// These are only scored, once, at the end.
    pub test: Vec<Recording>,
}

/// How to diagnose.
#[derive(Clone, Debug)]
pub struct Options {
    /// Seed of the resampling.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { seed: 1 }
    }
}

/// Stretches that a recording is judged in at first where something integrates; fewer where nothing is left in any of them.
const PARTS: usize = 8;

/// Steps of a refit that begins where an explanation ended, and how many times as fast the rig may have become there.
const AGAIN: usize = 15;
const DEAREST: f64 = 4.0;

/// Finds out what a rig lacks. `told` hears what is being done, how much of it, and of how much.
///
/// ```
/// use sinew_ident::diagnose::{Options, Recordings, Verdict, diagnose};
/// use sinew_ident::recording::Recording;
/// let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../rigs/");
/// let rig = sinew_sim::Rig::load(format!("{folder}mass-spring-damper.toml"))?;
/// let recordings = Recordings {
///     fit: vec![Recording::read(format!("{folder}mass-spring-damper.fit.csv"))?],
///     check: vec![Recording::read(format!("{folder}mass-spring-damper.test.csv"))?],
///     test: vec![],
/// };
/// let found = diagnose(&rig, &recordings, &Options::default(), &|_, _, _| {})?;
/// assert_eq!(found.verdict, Verdict::MissingPhysics);
/// assert_eq!(found.effects[0].kind, "coulomb_friction");
/// assert!(diagnose(&rig, &Recordings::default(), &Options::default(), &|_, _, _| {}).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`fit`]; `Arguments` without a recording to fit.
pub fn diagnose(
    rig: &Rig,
    recordings: &Recordings,
    options: &Options,
    progress: &(dyn Fn(&str, usize, usize) + Sync),
) -> Result<Diagnosis> {
    let begun = std::time::Instant::now();
    let roles = Roles::new(&recordings.fit, &recordings.check, &recordings.test)?;
    let plant = Plant::new(rig)?;
    let mut fit_data = Data::new(rig, &plant, &roles.fit)?;
    let mut check_data = Data::new(rig, &plant, &roles.check)?;
    let all: Vec<Recording> = roles.fit.iter().chain(&roles.check).cloned().collect();
    let both_data = Data::new(rig, &plant, &all)?;
    fit_data.learn_steps(&both_data);
    check_data.learn_steps(&both_data);
    progress("refitting the rig", 0, 1);
    let mut refitted = fit(rig, &roles.fit, &FitOptions::default(), &mut |_| {})?;
    let in_parts = integrates(rig);
    let mut parts = if in_parts { PARTS } else { 1 };
    let values = Plant::new(&refitted.rig)?.values();
    let (settings, budget) =
        search::finals(&Plant::new(&refitted.rig)?, &values, &fit_data, &both_data);
    let mut case = Case {
        written: rig,
        in_parts,
        settings,
        fit_intervals: fit_data.select(parts, budget),
        check_intervals: check_data.select(parts, budget),
        fit: &fit_data,
        check: &check_data,
        both: &both_data,
        seed: options.seed,
        trust: if roles.by_itself { 0.7 } else { 1.0 },
        progress,
    };
    let mut found = case.search(&refitted.rig, &values)?;
    // Start states of its own in every stretch may follow what the rig misses: then fewer and longer ones, from where the rig
    // ended on the shorter ones.
    while parts > 1
        && let Some(nothing) = found.as_ref().filter(|found| case.nothing_in(found))
    {
        parts /= 2;
        let longer = [&fit_data, &check_data].map(|data| data.select(parts, budget));
        if longer == [&case.fit_intervals, &case.check_intervals].map(Clone::clone) {
            break;
        }
        let values = nothing.base.trial.point.values.clone();
        [case.fit_intervals, case.check_intervals] = longer;
        found = case.search(&refitted.rig, &values)?;
    }
    if let Some(short) = found.as_ref().filter(|found| found.stopped_short) {
        let base = &short.base.trial;
        let of = |values: &[f64]| pace(&base.model.plant, values, &fit_data.experiments);
        // Not where the rig got so stiff on the way that a fit to whole recordings takes minutes.
        if of(&base.point.values) < DEAREST * of(&values) {
            let nearer = base.model.with(&base.point.values)?;
            let options = FitOptions {
                iterations: AGAIN,
                near: true,
                ..FitOptions::default()
            };
            let again = fit(&nearer, &roles.fit, &options, &mut |_| {});
            if let Some(again) = again.ok().filter(|again| error(again) < error(&refitted)) {
                refitted = again;
            }
        }
    }
    let named = match &mut found {
        Some(found) => verify::settle(found, &refitted, &case, &roles)?,
        None => None,
    };
    let mut diagnosis = report::conclude(rig, &refitted, &case, found.as_ref(), named, &roles)?;
    diagnosis.seconds = begun.elapsed().as_secs_f64();
    Ok(diagnosis)
}

/// What a fit leaves of the recordings that it saw, all sensors together.
fn error(fitted: &Fit) -> f64 {
    let signals = fitted.sensors.iter();
    signals.map(|s| s.rms.max(f64::MIN_POSITIVE).ln()).sum()
}

/// Some body is held in place by nothing: it integrates what pushes it, and a whole recording's error is
/// mostly drift.
fn integrates(rig: &Rig) -> bool {
    use sinew_sim::effects::Motion;
    use sinew_sim::rig::End;
    let mut held = vec![false; rig.bodies.len()];
    for gravity in &rig.gravities {
        held[gravity.body] |= rig.bodies[gravity.body].motion == Motion::Hinge;
    }
    for tendon in &rig.tendons {
        for (body, _) in &tendon.path {
            held[*body] = true;
        }
    }
    for _ in 0..=rig.bodies.len() {
        for spring in &rig.springs {
            let is = |end: End, held: &[bool]| match end {
                End::Ground => true,
                End::Body(body) => held[body],
            };
            if is(spring.from, &held) || is(spring.to, &held) {
                for end in [spring.from, spring.to] {
                    if let End::Body(body) = end {
                        held[body] = true;
                    }
                }
            }
        }
    }
    held.contains(&false)
}
