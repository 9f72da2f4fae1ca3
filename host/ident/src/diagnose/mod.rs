//! Diagnosis: where a simulation and a recording differ, and which physics was left out
//! (docs/explanation/diagnosis.md).

mod acceptance;
mod attribution;
mod baseline;
mod blurred;
mod by_signal;
mod calibration;
mod candidate;
mod canonical;
mod case;
pub mod config;
mod corrected;
mod data;
mod details;
mod differing;
mod doubt;
mod errors;
mod evidence;
#[cfg(test)]
mod example;
mod faulty;
mod finalists;
mod finding;
mod identical;
mod imitated_numbers;
mod imitated_sensors;
mod imitated_starts;
mod locate;
mod model;
mod next_experiment;
mod noise;
mod one_way;
pub mod output;
mod pool;
mod possible_terms;
mod progress;
mod remainder;
mod report;
mod residuals;
mod search;
mod share;
mod split;
mod term;
#[cfg(test)]
mod tests;
mod time_budget;
mod verify;
mod whole_recordings;
mod wording;

use crate::diagnose::config::CONFIG;
use std::time::Duration;

use sinew_sim::effects::Kind;
use sinew_sim::{Plant, Rig};

use self::baseline::refit_again;
use self::case::{Case, Untried, refit_settings};
pub use self::details::{Details, Finalist, ForceTrace, Recovered};
pub use self::finding::{
    Diagnosis, Errors, Estimate, FORMAT, FoundEffect, Interval, Location, Remainder, Rival,
    SignalFit, Verdict, WRONG_NUMBER,
};
pub use self::locate::regime::{Axis, ForceSample, Regime, acting, agreement, force_along};
use self::search::search_in_parts;
use self::split::Roles;
pub use self::time_budget::Stop;
use self::time_budget::TimeBudget;
use crate::check::Check;
use crate::error::Result;
use crate::fit::{FitOptions, fit, require};
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

/// Options of a diagnosis.
#[derive(Clone, Debug)]
pub struct DiagnoseOptions {
    /// Seed of the resampling.
    pub seed: u64,
    /// Effects that may be missing from the rig.
    pub effects: Vec<Kind>,
    /// Names of moves that the search leaves out (`search/moves`), to see what they are worth.
    pub without_moves: Vec<String>,
    /// Time after which nothing more is tried and the best so far is judged; judging it takes a
    /// little longer. Without it the search goes to its end, and an answer is reproducible.
    pub time_limit: Option<Duration>,
    /// Request to end the search as if its time were over.
    pub stop: Stop,
    /// Faults of the recordings that [`crate::check::check`] named. Samples of a clipped sensor are
    /// left out, what is named is less sure beside a fault that may look the same, and both are
    /// said.
    pub checks: Vec<Check>,
}

impl Default for DiagnoseOptions {
    fn default() -> Self {
        Self {
            seed: 1,
            effects: Kind::ALL.to_vec(),
            without_moves: Vec::new(),
            time_limit: None,
            stop: Stop::default(),
            checks: Vec::new(),
        }
    }
}

/// Finds out what a rig lacks. `told` hears what is being done, how much of it, and of how much.
///
/// ```
/// use sinew_ident::diagnose::{DiagnoseOptions, Recordings, Verdict, diagnose};
/// use sinew_ident::recording::Recording;
/// let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../rigs/");
/// let rig = sinew_sim::Rig::load(format!("{folder}mass-spring-damper.toml"))?;
/// let recordings = Recordings {
///     fit: vec![Recording::read(format!("{folder}mass-spring-damper.fit.csv"))?],
///     check: vec![Recording::read(format!("{folder}mass-spring-damper.test.csv"))?],
///     test: vec![],
/// };
/// let found = diagnose(&rig, &recordings, &DiagnoseOptions::default(), &|_, _, _| {})?;
/// assert_eq!(found.verdict, Verdict::MissingPhysics);
/// assert_eq!(found.effects[0].kind, "coulomb_friction");
/// assert!(diagnose(&rig, &Recordings::default(), &DiagnoseOptions::default(), &|_, _, _| {}).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`fit`]; `Arguments` without a recording to fit.
pub fn diagnose(
    rig: &Rig,
    recordings: &Recordings,
    options: &DiagnoseOptions,
    progress: &(dyn Fn(&str, usize, usize) + Sync),
) -> Result<Diagnosis> {
    let begun = std::time::Instant::now();
    let cleared = faulty::without_cut_samples(rig, recordings, &options.checks);
    let mut diagnosis = match cleared {
        None => search_and_conclude(rig, recordings, options, progress)?,
        Some((cleared, note)) => {
            let mut found = search_and_conclude(rig, &cleared, options, progress)?;
            if stopped_by_an_end(rig, recordings, (options, &found), progress)? {
                search_and_conclude(rig, recordings, options, progress)?
            } else {
                found.sentence += &format!(" {note}.");
                found
            }
        }
    };
    faulty::judge(&mut diagnosis, rig, recordings, &options.checks);
    diagnosis.checks.clone_from(&options.checks);
    diagnosis.seconds = begun.elapsed().as_secs_f64();
    Ok(diagnosis)
}

/// Tells whether a device that runs against its ends explains recordings that look clipped, where
/// something is left without the flat samples.
fn stopped_by_an_end(
    rig: &Rig,
    recordings: &Recordings,
    (options, found): (&DiagnoseOptions, &Diagnosis),
    progress: &(dyn Fn(&str, usize, usize) + Sync),
) -> Result<bool> {
    let explained = matches!(found.verdict, Verdict::Consistent | Verdict::Parameters);
    let asked = options.effects.contains(&Kind::EndStop);
    if explained || !asked {
        return Ok(false);
    }
    let ends = DiagnoseOptions {
        effects: vec![Kind::EndStop],
        ..options.clone()
    };
    let found = search_and_conclude(rig, recordings, &ends, progress)?;
    Ok(found.verdict == Verdict::MissingPhysics)
}

/// One search over recordings as they are, and what it found.
fn search_and_conclude(
    rig: &Rig,
    recordings: &Recordings,
    options: &DiagnoseOptions,
    progress: &(dyn Fn(&str, usize, usize) + Sync),
) -> Result<Diagnosis> {
    let time = TimeBudget::new(options.time_limit, options.stop.clone());
    let roles = Roles::new(&recordings.fit, &recordings.check, &recordings.test)?;
    require(rig, &recordings.test)?;
    let plant = Plant::new(rig)?;
    let mut data = roles.data(rig, &plant)?;
    progress("refitting the rig", 0, 1);
    let mut refitted = fit(rig, &roles.fit, &FitOptions::default(), &mut |_| {})?;
    let levels = blurred::levels(&refitted, &data[0].noise);
    data.iter_mut().for_each(|data| data.correct_noise(&levels));
    let [fit_data, check_data, both_data] = data;
    let believed = Plant::new(&refitted.rig)?;
    let values = believed.values();
    let (settings, budget) = refit_settings(&believed, &values, &fit_data, &both_data);
    let in_parts = case::integrates(rig) || case::runs_away(&refitted, &roles.check);
    let parts = if in_parts { CONFIG.split.parts } else { 1 };
    let mut case = Case {
        written: rig,
        in_parts,
        settings,
        fit_intervals: fit_data.select(parts, budget),
        check_intervals: check_data.select(parts, budget),
        fit: &fit_data,
        check: &check_data,
        both: &both_data,
        effects: &options.effects,
        without_moves: &options.without_moves,
        seed: options.seed,
        trust: roles.trust(),
        progress,
        time,
        untried: Untried::default(),
    };
    // Free runs over recordings that are longer than the fit could use would judge noise.
    let runs_away = (refitted.runaway).is_some_and(|runaway| !runaway.whole);
    let mut pool = if runs_away {
        None
    } else {
        search_in_parts(&mut case, &refitted.rig, &values, budget)?
    };
    if let Some(pool) = &pool
        && let Some(again) = refit_again(pool, &refitted, &values, &case, &roles)?
    {
        refitted = again;
    }
    let named = match &mut pool {
        Some(pool) => verify::verify(pool, &refitted, &case, &roles)?,
        None => None,
    };
    let mut found = report::conclude(rig, &refitted, &case, pool.as_ref(), named, &roles)?;
    let explained = matches!(found.verdict, Verdict::Consistent | Verdict::Parameters);
    if explained && let Some(warning) = blurred::warning(&refitted, &levels) {
        let claim = "; no physics is missing";
        found.sentence = found.sentence.replace(claim, "") + " " + &warning;
    }
    Ok(found)
}
