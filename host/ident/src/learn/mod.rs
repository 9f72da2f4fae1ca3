//! Learned laws of springs and dampers: found inside the simulator, of a shape that is physics for
//! any numbers (docs/explanation/identification.md, eq. 18; docs/explanation/plant.md, eq. 12e).
//!
//! The numbers of a law are parameters of the rig beside the rig's own. The fit's Levenberg solver
//! moves both by exact derivatives through the simulator. A Gaussian prior holds the bends of a law
//! near zero; the check recordings choose its width.

mod json;
mod law_file;
mod page;
mod prior;
mod target;

use sinew_sim::rig::LearnedLaw;
use sinew_sim::{Plant, Rig};

pub use self::json::{FORMAT, json};
pub use self::law_file::{Origin, law_file};
pub use self::page::page;
use self::prior::bends;
pub use self::target::Target;
use self::target::reaches;
use crate::error::{Error, Result};
use crate::fit::experiment::Experiment;
use crate::fit::score::relative;
use crate::fit::stages::{self, Apart};
use crate::fit::{Fit, FitOptions, SensorError, fit, pace, pool, score};
use crate::recording::Recording;

/// Standard deviations of a law's bends, as parts of its stiffness or damping, from smooth to
/// rough. The first one leaves a cubic spring, or quadratic drag.
const WIDTHS: [f64; 9] = [1e-4, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 10.0];

/// Part of the check error that a rougher law must save.
const WORTH: f64 = 0.005;

/// Rougher laws that are tried after the best one so far.
const PATIENCE: usize = 2;

/// Change of a reach, as a part of it, that asks for new places of the numbers.
const MOVED: f64 = 0.02;

/// Settings of the laws.
#[derive(Clone, Copy, Debug)]
pub struct LearnOptions {
    /// One list of numbers for both directions.
    pub odd: bool,
    /// A force that never falls. Dampings have no other.
    pub monotone: bool,
    /// Steps from rest to the reach.
    pub steps: usize,
}

impl Default for LearnOptions {
    fn default() -> Self {
        Self {
            odd: true,
            monotone: true,
            steps: 8,
        }
    }
}

/// One width of the prior and the errors that it leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tried {
    /// Standard deviation of the bends, as a part of the stiffness or damping.
    pub width: f64,
    /// Free-run error of the check recordings over the spread of their signals.
    pub check: f64,
}

/// Result of learning.
#[derive(Clone, Debug)]
pub struct Learned {
    /// The rig with its own parameters refitted and the laws in it as numbers.
    pub rig: Rig,
    /// The same rig with its straight lines, refitted: what a law has to beat.
    pub straight: Fit,
    /// One law a target, in their order.
    pub laws: Vec<LearnedLaw>,
    /// Places of the laws.
    pub targets: Vec<Target>,
    /// Width of the prior that the check recordings chose.
    pub width: f64,
    /// Every width that was tried, from smooth to rough.
    pub tried: Vec<Tried>,
    /// Errors of the check recordings with straight lines and with the laws, one entry a sensor.
    pub check: Vec<(SensorError, SensorError)>,
    /// Errors of the fit recordings, likewise.
    pub fit: Vec<(SensorError, SensorError)>,
}

/// Progress of learning.
#[derive(Clone, Debug)]
pub enum Progress {
    /// The rig with straight lines is fitted.
    Straight(crate::fit::Progress),
    /// A law is fitted with this width of the prior: index, count, and the fit's own progress.
    Law(usize, usize, crate::fit::Progress),
}

/// Learns the laws of these springs and dampers.
///
/// # Errors
/// Those of [`fit`]; `Arguments` without a check recording or a target; `Failed` where no law
/// explains the check recordings better than straight lines do.
pub fn learn(
    rig: &Rig,
    names: &[String],
    (recordings, check): (&[Recording], &[Recording]),
    options: LearnOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<Learned> {
    let targets = target::find(rig, names, options)?;
    if check.is_empty() {
        return Err(Error::arguments("a law needs a check recording").help(
            "--check RECORDING.csv decides how smooth it is; take one that was not learned from",
        ));
    }
    let straight = fit(rig, recordings, &FitOptions::default(), &mut |p| {
        progress(Progress::Straight(p));
    })?;
    let straight_check = score(&straight.rig, check)?;

    let mut begun = Search::new(&straight.rig, &targets, recordings, options)?;
    let mut found = begun.fit(WIDTHS[0], false, &mut |p| {
        progress(Progress::Law(1, WIDTHS.len(), p));
    })?;
    // A law moves the rig, and so the range that its numbers have to cover.
    let reached = reaches(&found, &targets, recordings)?;
    let moved = |(new, old): (&f64, &f64)| (new / old - 1.0).abs() > MOVED;
    if reached.iter().zip(&begun.reaches).any(moved) {
        begun = Search::with_reaches(&straight.rig, &targets, reached, recordings, options)?;
        found = begun.fit(WIDTHS[0], false, &mut |p| {
            progress(Progress::Law(1, WIDTHS.len(), p));
        })?;
    }

    let mut tried: Vec<Tried> = Vec::new();
    let mut best: Option<(f64, f64, Rig)> = None;
    let mut since = 0;
    for (index, &width) in WIDTHS.iter().enumerate() {
        if index > 0 {
            let from = begun.from(&found)?;
            let next = from.fit(width, true, &mut |p| {
                progress(Progress::Law(index + 1, WIDTHS.len(), p));
            });
            // A rough law that cannot be simulated ends the search, and a smooth one stays.
            let Ok(next) = next else { break };
            found = next;
        }
        let error = relative(&score(&found, check)?);
        tried.push(Tried {
            width,
            check: error,
        });
        let better = |(_, least, _): &(f64, f64, Rig)| error < (1.0 - WORTH) * least;
        if best.as_ref().is_none_or(better) {
            best = Some((width, error, found.clone()));
            since = 0;
        } else {
            since += 1;
            if since == PATIENCE {
                break;
            }
        }
    }
    let (width, error, rig) = best.ok_or_else(|| Error::failed("no law could be simulated"))?;
    let without = relative(&straight_check);
    if !error.is_finite() || error > (1.0 - WORTH) * without {
        return Err(not_a_law(names, error, without));
    }
    let laws = targets
        .iter()
        .filter_map(|target| rig.laws.iter().find(|law| law.name == target.name()))
        .cloned();
    let laws: Vec<LearnedLaw> = laws.collect();
    let rig = target::as_numbers(&rig)?;
    let fitted = score(&rig, recordings)?;
    let checked = score(&rig, check)?;
    Ok(Learned {
        fit: pool(&straight.runs).into_iter().zip(fitted).collect(),
        check: straight_check.into_iter().zip(checked).collect(),
        rig,
        straight,
        laws,
        targets,
        width,
        tried,
    })
}

/// The refusal of a law that does not help on recordings that it was not learned from.
fn not_a_law(names: &[String], with: f64, without: f64) -> Error {
    Error::failed(format!(
        "no law of {} explains the check recordings: {:.3} % of the signal with one, {:.3} % with \
         a straight line",
        names.join(" and "),
        100.0 * with,
        100.0 * without
    ))
    .help(
        "either the line is straight, or what is missing follows the time, an input or another \
         place: `sinew diagnose` looks there",
    )
}

/// A rig with free laws, and what fits them.
struct Search<'a> {
    rig: Rig,
    targets: &'a [Target],
    recordings: &'a [Recording],
    reaches: Vec<f64>,
    /// Size of a bend: stiffness or damping of the straight line.
    sizes: Vec<f64>,
}

impl<'a> Search<'a> {
    fn new(
        straight: &Rig,
        targets: &'a [Target],
        recordings: &'a [Recording],
        options: LearnOptions,
    ) -> Result<Self> {
        let reaches = reaches(straight, targets, recordings)?;
        Self::with_reaches(straight, targets, reaches, recordings, options)
    }

    fn with_reaches(
        straight: &Rig,
        targets: &'a [Target],
        reaches: Vec<f64>,
        recordings: &'a [Recording],
        options: LearnOptions,
    ) -> Result<Self> {
        let lines = targets.iter().map(|target| target.line(straight));
        Ok(Self {
            rig: target::with_free_laws(straight, targets, &reaches, options)?,
            targets,
            recordings,
            sizes: lines.collect(),
            reaches,
        })
    }

    /// The same search from another rig of the same laws.
    fn from(&self, rig: &Rig) -> Result<Self> {
        Ok(Self {
            rig: rig.clone(),
            targets: self.targets,
            recordings: self.recordings,
            reaches: self.reaches.clone(),
            sizes: self.sizes.clone(),
        })
    }

    /// The rig fitted with bends of this width; `near` where it starts from a fitted law.
    fn fit(
        &self,
        width: f64,
        near: bool,
        progress: &mut dyn FnMut(crate::fit::Progress),
    ) -> Result<Rig> {
        let plant = Plant::new(&self.rig)?;
        let experiments = self.recordings.iter();
        let experiments = experiments.map(|recording| Experiment::new(&plant, recording));
        let experiments = experiments.collect::<Result<Vec<_>>>()?;
        let step = plant.settings().rate_step;
        let settings = pace::settings(&plant, &plant.values(), &experiments, step);
        let plant = plant.with_settings(settings);
        let sums: Vec<Vec<(usize, f64)>> = self
            .targets
            .iter()
            .zip(&self.sizes)
            .filter_map(|(target, size)| {
                let law = self.rig.laws.iter().find(|law| law.name == target.name())?;
                Some(bends(&plant, law, width * size))
            })
            .flatten()
            .collect();
        let options = FitOptions {
            near,
            ..FitOptions::default()
        };
        let apart = Apart {
            sums: &sums,
            ..Apart::default()
        };
        let continuation = &crate::fit::USUAL;
        let found = stages::run(
            &self.rig,
            &plant,
            &experiments,
            (&options, continuation, apart),
            progress,
        )?;
        crate::fit::fitted(&self.rig, &plant, &found)
    }
}
