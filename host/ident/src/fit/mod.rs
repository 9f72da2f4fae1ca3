//! Identification: the rig's free parameters from recordings (docs/explanation/identification.md).
//!
//! An output-error fit by progressive-horizon multiple shooting. The decision variables are the
//! parameters and one initial state per shooting segment. They minimise the free-run (simulation)
//! error: the rig, driven by the recorded inputs alone, against the measured signals. The optimiser
//! is Levenberg–Marquardt with exact derivatives. The segments are short at first, each with its
//! own initial state, and grow to whole recordings. A device that drifts and a poor first guess do
//! no harm.

mod belonging;
mod beyond;
pub(crate) mod bounds;
pub(crate) mod derivatives;
pub(crate) mod experiment;
mod horizons;
pub mod json;
mod judge;
pub(crate) mod levenberg;
pub(crate) mod local;
pub(crate) mod pace;
mod runaway;
pub(crate) mod score;
mod second_start;
pub(crate) mod segment;
mod sizes;
pub(crate) mod stages;
pub(crate) mod start;
mod statics;
pub(crate) mod uncertainty;
mod undetermined;

use sinew_sim::{Plant, Rig};

pub use self::beyond::{BeyondBound, BeyondBounds};
use self::experiment::Experiment;
pub(crate) use self::experiment::START_ROWS;
use self::horizons::Continuation;
pub(crate) use self::horizons::USUAL;
use self::judge::Judge;
pub use self::levenberg::Stop;
pub use self::runaway::Runaway;
pub use self::score::{
    FreeRun, FreeRunSensor, OwnValue, SensorError, fit_text, free_run, free_runs, pool, require,
    score,
};
use self::stages::Apart;
pub use self::statics::{fit_rests, require_rests, rests};
#[cfg(feature = "cli")]
pub(crate) use self::uncertainty::student_95;
pub(crate) use self::undetermined::fitted;
use crate::error::{Error, Result};
use crate::noise::most_of_noise;
use crate::population::Fleet;
use crate::recording::Recording;
use crate::report::quantity;

/// Settings of a fit. The default serves; nothing here depends on the device.
#[derive(Debug, Clone)]
pub struct FitOptions {
    /// Most steps a stage.
    pub iterations: usize,
    /// Standard deviation of the prior around the rig's values, as a multiple of each value. Wide:
    /// it decides only where the data do not.
    pub prior_width: f64,
    /// The rig's values are near: whole recordings at once, where short stretches would lead away
    /// first.
    pub near: bool,
    /// The search alone: no second start, and no look at what the recordings leave undetermined or
    /// at what lies beyond bounds. Several times as quick.
    pub search_only: bool,
    /// The fleet that the device is of: the prior is its distribution, and the search begins at
    /// its mean. Its parameters are the rig's free ones.
    pub fleet: Option<Fleet>,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            iterations: 60,
            prior_width: 3.0,
            near: false,
            search_only: false,
            fleet: None,
        }
    }
}

/// Progress of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Stage, from 1.
    pub stage: usize,
    /// Rows simulated in one go in this stage, of the longest recording.
    pub horizon: usize,
    /// Steps taken in this stage.
    pub step: usize,
    /// Error over this stage's stretches, as a part of the signals' own spread.
    pub error: f64,
}

/// Result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The rig with the fitted values, comments kept.
    pub rig: Rig,
    /// The fitted parameters in the rig's order.
    pub parameters: Vec<FittedParameter>,
    /// Covariance of the errors of fitted parameters, SI.
    pub covariance: Covariance,
    /// Free-run error on the recordings of the fit, rig as written and refitted, one entry a
    /// sensor.
    pub sensors: Vec<SensorFit>,
    /// Free run of the rig as written over each recording of the fit, in their order.
    pub as_written_runs: Vec<FreeRun>,
    /// Free run of the refitted rig over each recording of the fit, in their order.
    pub runs: Vec<FreeRun>,
    /// Inputs with missing samples, which held their last value.
    pub held: Vec<HeldInput>,
    /// Better values beyond the bounds that parameters rest at.
    pub beyond: Option<BeyondBounds>,
    /// The plant runs away by itself: free-run errors of long recordings say nothing.
    pub runaway: Option<Runaway>,
    /// Reason for which the last stage ended.
    pub stop: Stop,
    /// Steps of all stages.
    pub steps: usize,
    /// Wall-clock time.
    pub seconds: f64,
}

/// Covariance of the errors of those fitted parameters that have an interval, eq. 12: an interval
/// is 1.96 roots of its diagonal to either side.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    /// Their names.
    pub names: Vec<String>,
    /// Its rows, SI.
    pub rows: Vec<Vec<f64>>,
}

/// One fitted parameter, SI.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedParameter {
    /// `carriage.inertia`.
    pub name: String,
    /// `kg`.
    pub unit: String,
    /// Value in the rig file.
    pub as_written: f64,
    /// Fitted value.
    pub value: f64,
    /// 95 % confidence interval; `None` where the recordings do not determine it, so that it
    /// stays near what the rig said, or where it rests at a bound.
    pub ci95: Option<[f64; 2]>,
    /// It rests at a bound of the rig's, or at zero where the sign is fixed.
    pub at_bound: bool,
    /// Own value of each recording, where they differ by recording (`per`): `value` is their mean.
    pub recordings: Vec<OwnValue>,
}

/// Error of one sensor over the recordings of the fit, SI.
///
/// ```
/// use sinew_ident::fit::SensorFit;
///
/// let encoder = SensorFit {
///     signal: "q_m".into(),
///     unit: "m".into(),
///     as_written_rms: 0.05,
///     rms: 0.01,
///     spread: 0.1,
///     noise: 1e-4,
///     samples: 2_000,
/// };
/// assert!(encoder.is_explained());
/// let [as_written, refitted] = encoder.fit_percent().map(Option::unwrap);
/// assert!(as_written < refitted && refitted < 100.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SensorFit {
    /// Its column.
    pub signal: String,
    /// Its unit.
    pub unit: String,
    /// Free-run error of the rig as written; infinite where it cannot be simulated.
    pub as_written_rms: f64,
    /// Free-run error of the refitted rig.
    pub rms: f64,
    /// Standard deviation of the measurement itself.
    pub spread: f64,
    /// Standard deviation of the measurement's white noise.
    pub noise: f64,
    /// Samples judged.
    pub samples: usize,
}

/// Largest free-run error, as a part of the signal's standard deviation, that still explains it.
const POOR: f64 = 0.3;

/// Largest free-run error, as a multiple of the noise, that leaves nothing but noise: the start of
/// a free run is only known as well as a few rows show it.
const NEAR_NOISE: f64 = 2.0;

impl SensorFit {
    /// Fit of the rig as written and refitted in per cent, eq. 14a; `None` of a signal that does
    /// not move and where nothing could be simulated.
    pub fn fit_percent(&self) -> [Option<f64>; 2] {
        [self.as_written_rms, self.rms].map(|rms| score::fit_percent(rms, self.spread))
    }

    /// Returns true where the refitted rig explains the signal: its free-run error is at most 0.3
    /// of the signal's standard deviation or twice its noise. Of a signal that is noise alone
    /// there is nothing to explain.
    pub fn is_explained(&self) -> bool {
        let still = self.spread <= most_of_noise(self.samples) * self.noise;
        still && self.rms.is_finite()
            || self.rms <= (POOR * self.spread).max(NEAR_NOISE * self.noise)
    }
}

/// An input with missing samples.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HeldInput {
    /// Name of the recording's file.
    pub recording: String,
    /// Its column.
    pub column: String,
    /// Number of missing samples.
    pub missing: usize,
}

/// Fits the rig's free parameters to recordings.
///
/// ```
/// # use sinew_ident::{fit::{FitOptions, fit}, recording::{Column, Recording}};
/// let rig = sinew_sim::Rig::parse(r#"
/// format = "sinew-rig/1"
/// name = "cart"
/// [[body]]
/// name = "cart"
/// motion = "slide"
/// inertia = { value = 5.0 }
/// [[actuator]]
/// name = "motor"
/// drives = "cart"
/// input = "u_N"
/// gain = 1.0
/// [[sensor]]
/// name = "encoder"
/// reads = "cart.position"
/// signal = "q_m"
/// "#, "cart.toml").unwrap();
/// // 2 kg under 1 N from rest: q = t^2 / 4.
/// let t: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
/// let column = |name: &str, values| Column { name: name.into(), values };
/// let q = t.iter().map(|t| t * t / 4.0).collect();
/// let columns = vec![column("u_N", vec![1.0; 200]), column("q_m", q)];
/// let recording = Recording::new("cart.csv", t, columns)?;
/// let fitted = fit(&rig, &[recording], &FitOptions::default(), &mut |_| {})?;
/// assert!((fitted.parameters[0].value - 2.0).abs() < 1e-4);
/// # Ok::<(), sinew_ident::error::Error>(())
/// ```
///
/// # Errors
/// `File` for a recording that lacks a column of the rig, has no sample of any sensor, or is too
/// short, for recordings in which no sensor ever changes, and for a fleet of other parameters;
/// `Arguments` without a recording; `Failed` where the rig cannot be simulated even over short
/// stretches.
pub fn fit(
    rig: &Rig,
    recordings: &[Recording],
    options: &FitOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<Fit> {
    let begun = std::time::Instant::now();
    if recordings.is_empty() {
        return Err(Error::arguments("a fit needs at least one recording"));
    }
    let plant = Plant::new(rig)?;
    if let Some(fleet) = &options.fleet {
        let slots = stages::fitted_slots(&plant).into_iter();
        let names = slots.map(|slot| plant.parameters()[slot].name.as_str());
        fleet.is_of(&rig.file, &names.collect::<Vec<_>>())?;
    }
    let as_written_runs = free_runs(rig, recordings)?;
    let experiments = recordings
        .iter()
        .map(|recording| Experiment::new(&plant, recording))
        .collect::<Result<Vec<_>>>()?;
    if !plant.free_slots().is_empty() {
        moves(&plant, &experiments, recordings)?;
    }
    let step = plant.settings().rate_step;
    let settings = pace::settings(&plant, &plant.values(), &experiments, step);
    let plant = plant.with_settings(settings);
    let mut over = |continuation: &Continuation, apart: Apart| {
        stages::run(
            rig,
            &plant,
            &experiments,
            (options, continuation, apart),
            progress,
        )
    };
    let (continuation, first) =
        second_start::better((rig, &plant, recordings), options, &mut over)?;
    let judge = Judge {
        runs: &|rig| free_runs(rig, recordings),
        runs_at: &|values| {
            let run = |recording| score::run_at(rig, &plant, values, recording);
            recordings.iter().map(run).collect()
        },
        // Where the recordings show nothing a fleet still does.
        at_rest: match options.fleet {
            Some(_) => None,
            None => undetermined::noise_beside_spread(&plant, recordings),
        },
        noise: &judge::white_noise,
        begun,
    };
    let first = (as_written_runs, first);
    let of = (rig, &plant, &experiments[..]);
    if options.search_only {
        return judge.searched(of, first);
    }
    judge.conclude(of, first, &mut |apart| over(continuation, apart))
}

/// Refuses recordings in which no sensor ever changes: an immovable device explains them best.
fn moves(plant: &Plant, experiments: &[Experiment], recordings: &[Recording]) -> Result<()> {
    let first = |sensor: usize| {
        let all = experiments.iter().flat_map(|it| &it.signals[sensor]);
        let mut valid = all.copied().filter(|y| y.is_finite());
        let first = valid.next();
        (first, first.is_none_or(|first| valid.all(|y| y == first)))
    };
    let sensors = plant.sensors().iter().enumerate();
    let mut constant = Vec::new();
    for (index, sensor) in sensors {
        let (value, never_changes) = first(index);
        if !never_changes {
            return Ok(());
        }
        let value = value.map(|value| format!(" ({})", quantity(value, &sensor.unit)));
        constant.push(format!("`{}`{}", sensor.column, value.unwrap_or_default()));
    }
    let message = format!("no sensor ever changes: {}", constant.join(", "));
    Err(Error::file(recordings[0].path(), message)
        .expected("readings of a device that moves, or their noise")
        .help("is the sensor connected and read? `sinew excite` writes an experiment that moves"))
}

#[cfg(test)]
mod tests;
