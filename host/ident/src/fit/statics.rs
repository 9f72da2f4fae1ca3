//! Fits to rests: a table of constant inputs and of what the sensors read once nothing moves
//! (docs/explanation/identification.md, eq. 17).
//!
//! The residuals are those of the rests (docs/explanation/plant.md, eq. 28), and the derivatives
//! those of the implicit function (eq. 30). Solver, intervals and result are those of
//! [`super::fit`]. Parameters that no rest depends on, such as inertias and dampings, are held as
//! written.

use std::time::Instant;

use sinew_sim::{Plant, Rig, Simulated};

use super::experiment::{Experiment, spreads};
use super::judge::Judge;
use super::levenberg::{DecisionVariables, Stop, StoppingCriteria, minimise};
use super::score::{FreeRun, FreeRunSensor};
use super::segment::{Problem, RestStarts, Segment};
use super::sizes::{rescale, sample_count, silent_scales};
use super::stages::{Apart, Ended, Found, conclude, fitted_slots, reweight};
use super::{Fit, FitOptions, Progress, local, moves};
use crate::error::{Error, Result};
use crate::parallel;
use crate::recording::Recording;

/// Searches, each with the weights that the one before left.
const ROUNDS: usize = 5;
/// Relative decrease of the cost below which a search ends.
const CONVERGED: f64 = 1e-6;

/// Readings of a rig at rest beside those of each table, row by row: `t` counts the rows. They are
/// NaN where the rig has no rest.
///
/// # Errors
/// As [`require_rests`], but for the rests.
pub fn rests(rig: &Rig, tables: &[Recording]) -> Result<Vec<FreeRun>> {
    let plant = Plant::new(rig)?;
    let tables = tables.iter().map(|table| Table::new(&plant, table));
    let tables = tables.collect::<Result<Vec<_>>>()?;
    let values = plant.values();
    Ok(tables.iter().map(|it| it.run(&plant, &values)).collect())
}

/// Finds what would keep a rig from being fitted to tables of rests, before any work.
///
/// # Errors
/// `File` with its line for a column that is missing, for an input without a value, and for a row
/// at which the rig as written has no rest or, for friction, hysteresis or play, more than one;
/// `Arguments` for a parameter with a value of its own in each recording; `Rig` for a rig that
/// cannot be compiled.
pub fn require_rests<'a>(rig: &Rig, tables: impl IntoIterator<Item = &'a Recording>) -> Result<()> {
    let plant = Plant::new(rig)?;
    let mut tables = tables.into_iter();
    tables.try_for_each(|table| Table::new(&plant, table)?.check(&plant, table))
}

/// Fits the rig's free parameters to tables of rests.
///
/// ```
/// # use sinew_ident::{fit::{FitOptions, fit_rests}, recording::Recording};
/// let rig = sinew_sim::Rig::parse(r#"
/// format = "sinew-rig/1"
/// name = "balance"
/// [[body]]
/// name = "pan"
/// motion = "slide"
/// inertia = { value = 1.0 }
/// [[spring]]
/// name = "coil"
/// from = "ground"
/// to = "pan"
/// stiffness = { value = 50.0 }
/// [[actuator]]
/// name = "load"
/// drives = "pan"
/// input = "load_N"
/// gain = 1.0
/// [[sensor]]
/// name = "ruler"
/// reads = "pan.position"
/// signal = "q_m"
/// "#, "balance.toml").unwrap();
/// let table = Recording::parse_table(b"load_N,q_m\n0,0\n1,0.01\n2,0.02\n", "loads.csv")?;
/// let found = fit_rests(&rig, &[table], &FitOptions::default(), &mut |_| {})?;
/// assert!((found.parameters[1].value - 100.0).abs() < 1e-6);
/// assert_eq!(found.parameters[0].value, 1.0); // no rest depends on an inertia
/// # Ok::<(), sinew_ident::error::Error>(())
/// ```
///
/// # Errors
/// As [`require_rests`]; `Arguments` without a table, `File` where no sensor ever changes.
pub fn fit_rests(
    rig: &Rig,
    tables: &[Recording],
    options: &FitOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<Fit> {
    let begun = Instant::now();
    if tables.is_empty() {
        return Err(Error::arguments("a fit needs at least one table"));
    }
    require_rests(rig, tables)?;
    let plant = Plant::new(rig)?;
    let read = tables.iter().map(|table| Table::new(&plant, table));
    let read = read.collect::<Result<Vec<_>>>()?;
    let as_written_runs = read
        .iter()
        .map(|it| it.run(&plant, &plant.values()))
        .collect();
    let (experiments, starts): (Vec<_>, Vec<_>) = read
        .into_iter()
        .map(|it| (it.experiment, it.starts))
        .unzip();
    if !plant.free_slots().is_empty() {
        moves(&plant, &experiments, tables)?;
    }
    let mut over = |apart: Apart| {
        let data = (&plant, &experiments[..], &starts[..]);
        run(data, options, apart, progress)
    };
    let silent = |values: &[f64]| silent((&plant, &experiments[..], &starts[..]), values);
    let idle = silent(&plant.values())?;
    let mut first = over(Apart {
        held: &idle,
        ..Apart::default()
    })?;
    // A tendon that was slack everywhere may have become taut.
    let still = silent(&first.values)?;
    let still: Vec<usize> = idle
        .iter()
        .copied()
        .filter(|it| still.contains(it))
        .collect();
    if still.len() < idle.len() {
        first = over(Apart {
            held: &still,
            ..Apart::default()
        })?;
    }
    let judge = Judge {
        runs: &|rig| rests(rig, tables),
        runs_at: &|values| {
            let runs = tables.iter().map(|table| Table::new(&plant, table));
            runs.map(|it| Ok(it?.run(&plant, values))).collect()
        },
        at_rest: None,
        // Rows have no order in time that would show noise.
        noise: &|_, _| 0.0,
        begun,
    };
    judge.conclude(
        (rig, &plant, &experiments),
        (as_written_runs, first),
        &mut over,
    )
}

/// A table of rests, laid against the columns of a plant.
struct Table {
    experiment: Experiment,
    /// State from which the rest of each row is searched: the positions that sensors read.
    starts: Vec<Vec<f64>>,
}

impl Table {
    /// Takes the columns that the plant names.
    fn new(plant: &Plant, table: &Recording) -> Result<Self> {
        if let Some(name) = local::names(plant).next() {
            let message = format!("`{name}` has a value of its own in each recording (`per`)");
            return Err(Error::arguments(message)
                .expected("parameters that all rows share, with --static")
                .help("fit it to recordings first, or take `per` away"));
        }
        let place =
            |row: usize, message: String| Error::file(table.path(), message).at(table.line(row), 1);
        let mut inputs = Vec::new();
        for input in plant.inputs() {
            let column = table.si(&input.column, input.column_factor, &input.wanted_by())?;
            if let Some(row) = column.iter().position(|value| value.is_nan()) {
                let message = format!("`{}` has no value here", input.column);
                return Err(place(row, message)
                    .expected("the value of every input in every row of a table of rests"));
            }
            inputs.push(column);
        }
        let signals = plant.sensors().iter().map(|sensor| table.sensor(sensor));
        let signals = signals.collect::<Result<Vec<Vec<f64>>>>()?;
        if signals.iter().flatten().all(|value| value.is_nan()) {
            let message = "no sensor of the rig has a single reading here";
            return Err(Error::file(table.path(), message));
        }
        let values = plant.values();
        let start = |row: usize| {
            let read = signals.iter().map(|column| column[row]);
            let read: Vec<Option<f64>> = read.map(|y| y.is_finite().then_some(y)).collect();
            Ok(plant.initial_state(&values, &read)?)
        };
        let starts = (0..table.len()).map(start).collect::<Result<Vec<_>>>()?;
        Ok(Self {
            experiment: Experiment {
                name: table.name(),
                t: table.t().to_vec(),
                inputs,
                signals,
                held: Vec::new(),
            },
            starts,
        })
    }

    /// Checks that the plant as written has one rest at each row.
    fn check(&self, plant: &Plant, table: &Recording) -> Result<()> {
        let values = plant.values();
        let place =
            |row: usize, message: String| Error::file(table.path(), message).at(table.line(row), 1);
        for (row, start) in self.starts.iter().enumerate() {
            let inputs = inputs_at::<f64>(&self.experiment, row);
            let rest = plant.rest(&values, &inputs, start);
            let rest = rest.map_err(|error| {
                place(row, format!("the rig as written has no rest here: {error}"))
                    .expected("inputs under which the rig comes to rest")
            })?;
            let intervals = plant.rest_intervals(&values, &inputs, &rest.state)?;
            if let Some(interval) = intervals.first() {
                let message = format!(
                    "the rest here is not the only one: `{}` holds the rig in an interval",
                    interval.component
                );
                return Err(place(row, message)
                    .expected("a rig without friction, hysteresis and play")
                    .help("take the effect out of the rig for this fit"));
            }
        }
        Ok(())
    }

    /// Readings at rest with these values of the parameters; NaN where there is no rest.
    fn run(&self, plant: &Plant, values: &[f64]) -> FreeRun {
        let rows = self.starts.iter().enumerate();
        let rests: Vec<Option<Vec<f64>>> = rows
            .map(|(row, start)| {
                let inputs = inputs_at::<f64>(&self.experiment, row);
                Some(plant.rest(values, &inputs, start).ok()?.signals)
            })
            .collect();
        let sensors = plant.sensors().iter().zip(&self.experiment.signals);
        let sensors = sensors.enumerate().map(|(index, (sensor, measured))| {
            let read = |rest: &Option<Vec<f64>>| rest.as_ref().map_or(f64::NAN, |it| it[index]);
            FreeRunSensor {
                signal: sensor.column.clone(),
                unit: sensor.unit.clone(),
                measured: measured.clone(),
                simulated: rests.iter().map(read).collect(),
            }
        });
        FreeRun {
            recording: self.experiment.name.clone(),
            t: self.experiment.t.clone(),
            judged_from: 0,
            start: Vec::new(),
            own: Vec::new(),
            values: values.to_vec(),
            sensors: sensors.collect(),
        }
    }
}

/// Inputs of one row, SI.
fn inputs_at<S: Simulated>(experiment: &Experiment, row: usize) -> Vec<S> {
    let inputs = experiment.inputs.iter();
    inputs.map(|column| S::constant(column[row])).collect()
}

/// A plant with tables and the starts of their rests.
type Rows<'a> = (&'a Plant, &'a [Experiment], &'a RestStarts);

/// Problem over whole tables, nothing free yet.
fn problem<'a>((plant, experiments, starts): Rows<'a>) -> Result<(Problem<'a>, Vec<Segment>)> {
    let sigma = spreads(experiments)
        .iter()
        .map(|spread| 1e-3 * spread)
        .collect();
    let states = vec![1.0; plant.state_len()];
    let problem = Problem {
        rests: Some(starts),
        ..Problem::of_states(plant, experiments, sigma, states)
    };
    let whole = |(index, it): (usize, &Experiment)| problem.segment(index, 0..it.rows());
    let segments = experiments.iter().enumerate().map(whole);
    let segments = segments.collect::<Result<Vec<_>>>()?;
    Ok((problem, segments))
}

/// Decision variables with these values of the parameters. Starts of rests are no variables: the
/// states are placeholders.
fn variables(plant: &Plant, segments: &[Segment], values: &[f64]) -> DecisionVariables {
    DecisionVariables {
        values: values.to_vec(),
        states: vec![vec![0.0; plant.state_len()]; segments.len()],
    }
}

/// Fitted parameters on which no rest depends.
fn silent(rows: Rows, values: &[f64]) -> Result<Vec<usize>> {
    let (mut problem, segments) = problem(rows)?;
    problem.free(&FitOptions::default(), Apart::default());
    let variables = variables(rows.0, &segments, values);
    let scales = silent_scales(&problem, &segments, &variables);
    let slots = fitted_slots(rows.0).into_iter().zip(scales);
    let slots = slots.filter(|(_, scale)| scale.is_none());
    Ok(slots.map(|(slot, _)| slot).collect())
}

/// Fits with some parameters apart.
fn run(
    rows: Rows,
    options: &FitOptions,
    apart: Apart,
    progress: &mut dyn FnMut(Progress),
) -> Result<Found> {
    let (plant, experiments, _) = rows;
    let (mut problem, segments) = problem(rows)?;
    let belief = problem.free(options, apart);
    let spreads = spreads(experiments);
    let mut unknowns = variables(plant, &segments, &plant.values());
    let silent = silent_scales(&problem, &segments, &unknowns);
    let samples = sample_count(&problem, &segments);
    let horizon = experiments.iter().map(Experiment::rows).max().unwrap_or(0);
    let (mut stop, mut steps) = (Stop::Converged, 0);
    for stage in 1..=ROUNDS {
        rescale(&mut problem, &belief, &unknowns, &silent);
        let effort = StoppingCriteria {
            iterations: options.iterations,
            relative: CONVERGED,
        };
        let sizes = problem.sigma.iter().zip(&spreads);
        let relative = sizes.map(|(a, b)| a / b).fold(0.0, f64::max);
        let mut tell = |step, cost: f64| {
            let error = (2.0 * cost / samples as f64).sqrt() * relative;
            progress(Progress {
                stage,
                horizon,
                step,
                error,
            });
        };
        let found = minimise(
            &problem,
            &belief,
            &segments,
            &mut unknowns,
            &effort,
            &mut tell,
        );
        let (ended, taken) = found
            .ok_or_else(|| Error::failed("the rests of the rig as written have no derivatives"))?;
        stop = ended;
        steps += taken;
        if !reweight(&mut problem, &segments, &unknowns, &spreads) {
            break;
        }
    }
    let ended = Ended {
        silent: &silent,
        stop,
        steps,
        runaway: None,
    };
    Ok(conclude(
        &mut problem,
        &belief,
        &segments,
        unknowns,
        (apart, &spreads),
        ended,
    ))
}

impl Problem<'_> {
    /// Readings at the rests of a segment's rows, row-major; `None` where one has no rest.
    pub(super) fn signals_at_rest<S: Simulated>(
        &self,
        starts: &RestStarts,
        segment: &Segment,
        values: &[S],
    ) -> Option<Vec<S>> {
        let experiment = &self.experiments[segment.experiment];
        let starts = &starts[segment.experiment];
        let mut signals = Vec::with_capacity(segment.rows.len() * experiment.signals.len());
        for row in segment.rows.clone() {
            let inputs = inputs_at(experiment, row);
            let rest = self.plant.rest(values, &inputs, &starts[row]).ok()?;
            signals.extend(rest.signals);
        }
        Some(signals)
    }

    /// Half the sum of squared residuals of the rests of all segments; infinite where one has none.
    pub(super) fn cost_of_rests(
        &self,
        starts: &RestStarts,
        segments: &[Segment],
        values: &[f64],
    ) -> f64 {
        let cost = |segment: &Segment| {
            let signals = self.signals_at_rest(starts, segment, values)?;
            let measured = &self.experiments[segment.experiment].signals;
            let mut sum = 0.0;
            for (row, read) in segment.rows.clone().zip(signals.chunks(measured.len())) {
                for ((column, signal), sigma) in measured.iter().zip(read).zip(&self.sigma) {
                    if column[row].is_finite() {
                        sum += ((column[row] - signal) / sigma).powi(2);
                    }
                }
            }
            Some(0.5 * sum)
        };
        let costs = parallel::all(segments.len(), &|index| cost(&segments[index]));
        costs.map_or(f64::INFINITY, |costs| costs.iter().sum())
    }

    /// Number of start states of a segment that are fitted: those of a rest are not.
    pub(super) fn start_states(&self, state: &[f64]) -> usize {
        match self.rests {
            Some(_) => 0,
            None => state.len(),
        }
    }
}
