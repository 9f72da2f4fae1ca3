//! Error of a rig on a recording: the free-run simulation error
//! (docs/explanation/identification.md, eq. 14).

use serde::Serialize;
use sinew_sim::{Parameter, Plant, Rig};

use super::experiment::{Experiment, START_ROWS, Views, spreads, start_rows};
use super::segment::Problem;
use super::uncertainty::{Width, interval};
use super::{local, start};
use crate::error::{Error, Result};
use crate::recording::Recording;

/// A rig driven by nothing but a recording's inputs, beside what was measured.
#[derive(Debug, Clone)]
pub struct FreeRun {
    /// Name of the recording's file.
    pub recording: String,
    /// Times of the rows, s.
    pub t: Vec<f64>,
    /// The error counts from this row on; the rows before gave the start state.
    pub judged_from: usize,
    /// Initial state, in the order of [`Plant::state_names`].
    pub start: Vec<f64>,
    /// Every parameter of the plant, SI: those that differ by recording as this one shows them.
    pub values: Vec<f64>,
    /// Own values of this recording, estimated from it alone; empty where the rig has none.
    pub own: Vec<OwnValue>,
    /// One entry a sensor of the rig, in file order.
    pub sensors: Vec<FreeRunSensor>,
}

/// A parameter's own value in one recording, SI.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OwnValue {
    /// Name of the recording's file.
    pub recording: String,
    /// `load_cell.offset`.
    #[serde(skip)]
    pub name: String,
    /// Its unit.
    #[serde(skip)]
    pub unit: String,
    /// The value.
    pub value: f64,
    /// 95 % confidence interval; `None` where the recording does not determine it or where it
    /// rests at a bound.
    pub ci95: Option<[f64; 2]>,
    /// It rests at a bound, and the recording leaves it no way back.
    #[serde(skip)]
    pub at_bound: bool,
}

impl OwnValue {
    /// The value of a parameter in a recording, with its certainty.
    pub(super) fn new(
        parameter: &Parameter,
        recording: &str,
        (value, width): (f64, Width),
    ) -> Self {
        Self {
            recording: recording.to_owned(),
            name: parameter.name.clone(),
            unit: parameter.unit.clone(),
            value,
            ci95: width.half().map(|half| interval(value, half)),
            at_bound: width == Width::AtBound,
        }
    }
}

/// One sensor of a [`FreeRun`], SI.
#[derive(Debug, Clone)]
pub struct FreeRunSensor {
    /// Its column.
    pub signal: String,
    /// Its unit.
    pub unit: String,
    /// NaN where missing.
    pub measured: Vec<f64>,
    /// NaN throughout where the rig cannot be simulated with these parameters.
    pub simulated: Vec<f64>,
}

/// The error of one sensor, pooled over recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorError {
    /// Its column.
    pub signal: String,
    /// Its unit.
    pub unit: String,
    /// Root of the mean squared error, SI; infinite where the rig could not be simulated, NaN
    /// without a sample.
    pub rms: f64,
    /// Standard deviation of what was measured, to hold it against.
    pub spread: f64,
    /// Number of samples that were scored.
    pub samples: usize,
}

impl SensorError {
    /// Fit in per cent, eq. 14a: 100 is a perfect one, 0 as good as the mean, below that worse.
    /// `None` of a signal that does not move and where nothing could be simulated.
    pub fn fit_percent(&self) -> Option<f64> {
        fit_percent(self.rms, self.spread)
    }

    /// `97.3 %`; empty where there is none.
    pub fn fit_text(&self) -> String {
        fit_text(self.fit_percent())
    }
}

/// 100 (1 - |y - yhat| / |y - mean(y)|).
pub(super) fn fit_percent(rms: f64, spread: f64) -> Option<f64> {
    let percent = 100.0 * (1.0 - rms / spread);
    (spread > 0.0 && percent.is_finite()).then_some(percent)
}

/// Fit in per cent as text: a digit behind the point, two near 100.
pub fn fit_text(percent: Option<f64>) -> String {
    match percent {
        None => String::new(),
        Some(percent) if percent < -999.0 => "below −999 %".into(),
        Some(percent) if (99.0..100.0).contains(&percent) => {
            // 100 would say that nothing is left.
            format!("{:.2} %", (100.0 * percent).floor() / 100.0)
        }
        Some(percent) => format!("{percent:.1} %"),
    }
}

/// Simulates a rig over a recording: only inputs given, the start state estimated from the first 5
/// % of the rows (at least 20) with the parameters as they are.
///
/// # Errors
/// `File` for a column that is missing and for a recording of 20 rows or fewer; `Rig` for a rig
/// that cannot be compiled.
pub fn free_run(rig: &Rig, recording: &Recording) -> Result<FreeRun> {
    let plant = Plant::new(rig)?;
    run_at(rig, &plant, &plant.values(), recording)
}

/// Finds what would keep a rig from being judged by recordings, before any work.
///
/// # Errors
/// As [`free_run`].
pub fn require<'a>(rig: &Rig, recordings: impl IntoIterator<Item = &'a Recording>) -> Result<()> {
    let plant = Plant::new(rig)?;
    let recordings = recordings.into_iter();
    // A column that is missing first: no length would mend that.
    let read = recordings.map(|it| Ok((it, Experiment::new(&plant, it)?)));
    let read = read.collect::<Result<Vec<_>>>()?;
    let mut all = read.iter();
    all.try_for_each(|(recording, experiment)| long_enough(recording, experiment))
}

/// Refuses a recording that is too short to judge a rig by.
fn long_enough(recording: &Recording, experiment: &Experiment) -> Result<()> {
    let rows = experiment.rows();
    if start_rows(rows) < rows {
        return Ok(());
    }
    Err(Error::file(
        recording.path(),
        format!("{rows} rows are too few to judge a rig by"),
    )
    .expected(format!(
        "more than {START_ROWS}: the first {START_ROWS} give the start state"
    )))
}

/// As [`free_run`], with these values of the parameters.
///
/// # Errors
/// As [`free_run`].
pub(super) fn run_at(
    rig: &Rig,
    plant: &Plant,
    values: &[f64],
    recording: &Recording,
) -> Result<FreeRun> {
    let experiment = Experiment::new(plant, recording)?;
    long_enough(recording, &experiment)?;
    let judged_from = start_rows(experiment.rows());
    let experiments = [experiment];
    let found = local::estimate(rig, plant, &experiments, values)?;
    let values = &found.values;
    let own = local::slots(plant).into_iter().zip(&found.widths);
    let own = own.map(|(slot, width)| {
        let parameter = &plant.parameters()[slot];
        OwnValue::new(parameter, &experiments[0].name, (values[slot], *width))
    });
    let own = own.collect();
    let start = estimate_start(rig, plant, &experiments, values)?;
    let [experiment] = experiments;
    let drive = experiment.drive(plant, 0..experiment.rows())?;
    let run = plant.simulate(values, &start, &drive, &experiment.t).ok();
    let sensors = plant
        .sensors()
        .iter()
        .zip(experiment.signals)
        .enumerate()
        .map(|(index, (sensor, measured))| {
            let simulated = match &run {
                Some(run) => run.column(index),
                None => vec![f64::NAN; measured.len()],
            };
            FreeRunSensor {
                signal: sensor.column.clone(),
                unit: sensor.unit.clone(),
                measured,
                simulated,
            }
        });
    let sensors = sensors.collect();
    Ok(FreeRun {
        recording: experiment.name,
        t: experiment.t,
        judged_from,
        start,
        own,
        values: found.values,
        sensors,
    })
}

/// Simulates a rig over each recording, in their order.
///
/// # Errors
/// As [`free_run`].
pub fn free_runs(rig: &Rig, recordings: &[Recording]) -> Result<Vec<FreeRun>> {
    recordings
        .iter()
        .map(|recording| free_run(rig, recording))
        .collect()
}

/// The free-run error of a rig, pooled over the samples of all recordings.
///
/// # Errors
/// As [`free_run`].
pub fn score(rig: &Rig, recordings: &[Recording]) -> Result<Vec<SensorError>> {
    Ok(pool(&free_runs(rig, recordings)?))
}

/// The errors of several runs of one rig, pooled; empty without any run.
pub fn pool(runs: &[FreeRun]) -> Vec<SensorError> {
    let Some(first) = runs.first() else {
        return Vec::new();
    };
    (0..first.sensors.len())
        .map(|index| {
            let mut squares = 0.0;
            let mut measured = Vec::new();
            for run in runs {
                let sensor = &run.sensors[index];
                for row in run.judged_from..run.t.len() {
                    if sensor.measured[row].is_finite() {
                        let error = sensor.measured[row] - sensor.simulated[row];
                        squares += if error.is_nan() {
                            f64::INFINITY
                        } else {
                            error * error
                        };
                        measured.push(sensor.measured[row]);
                    }
                }
            }
            let samples = measured.len();
            let mean = measured.iter().sum::<f64>() / samples as f64;
            let variance = measured
                .iter()
                .map(|value| (value - mean).powi(2))
                .sum::<f64>()
                / samples as f64;
            SensorError {
                signal: first.sensors[index].signal.clone(),
                unit: first.sensors[index].unit.clone(),
                rms: (squares / samples as f64).sqrt(),
                spread: variance.sqrt(),
                samples,
            }
        })
        .collect()
}

/// Free-run error over the spread of the signals, root of the sum of the squares of all sensors.
pub(crate) fn relative(sensors: &[SensorError]) -> f64 {
    let judged = sensors.iter().filter(|s| s.spread > 0.0 && s.samples > 0);
    let squares = judged.map(|s| (s.rms / s.spread).powi(2));
    squares.sum::<f64>().sqrt()
}

/// The start state that the first 5 % of a recording show.
fn estimate_start(
    rig: &Rig,
    plant: &Plant,
    experiments: &[Experiment],
    values: &[f64],
) -> Result<Vec<f64>> {
    let views = Views::new(rig, plant);
    let sigma = spreads(experiments).into_iter();
    let problem = Problem::of_states(
        plant,
        experiments,
        sigma.map(|spread| 1e-3 * spread).collect(),
        start::scales(experiments, &views, values),
    );
    let window = [problem.segment(0, 0..start_rows(experiments[0].rows()))?];
    let guess = start::states(&problem, &views, &window, values)?.swap_remove(0);
    Ok(start::estimate(&problem, 0, values, guess)?.0)
}
