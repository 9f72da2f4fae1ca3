//! Rests of a rig under constant inputs: one, or one for each value of a swept input.

pub mod json;
pub mod page;
pub mod text;

use sinew_ident::error::{Error, Result};
use sinew_ident::report::exact;
use sinew_sim::{Dual, Plant, Rest, RestInterval, Scalar, SensorChannel, SimulationError};

/// Derivatives that one implicit solve gives.
const SEEDS: usize = 8;

/// An input that takes a value for each rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    /// Index of the input.
    pub input: usize,
    /// First and last value, in the unit of the column.
    pub ends: [f64; 2],
    /// Number of values, 2 or more.
    pub count: usize,
}

impl Sweep {
    /// The `k`th value, from 0.
    fn value(&self, k: usize) -> f64 {
        let [from, to] = self.ends;
        let share = k as f64 / (self.count - 1) as f64;
        if (to - from).is_finite() {
            from + share * (to - from)
        } else {
            (1.0 - share) * from + share * to
        }
    }
}

/// One rest. Inputs and signals are in the units of their columns.
#[derive(Clone, Debug)]
pub struct Row {
    /// Value of each input.
    pub inputs: Vec<f64>,
    /// Reading of each sensor.
    pub signals: Vec<f64>,
    /// The rest in SI.
    pub rest: Rest<f64>,
    /// Intervals that friction, hysteresis and play leave.
    pub intervals: Vec<RestInterval>,
    /// Derivative of each signal, by input.
    pub by_input: Vec<Vec<f64>>,
    /// Derivative of each signal, by free parameter in SI.
    pub by_parameter: Vec<(usize, Vec<f64>)>,
}

/// Rests of a rig, in the order of the swept input.
#[derive(Clone, Debug)]
pub struct Rests {
    /// The rig compiled.
    pub plant: Plant,
    /// The swept input, where there is one.
    pub sweep: Option<Sweep>,
    /// One rest, or one for each value.
    pub rows: Vec<Row>,
}

impl Rests {
    /// Finds them; `inputs` are in the units of the columns. Each search starts at the rest before.
    ///
    /// # Errors
    /// An input under which the rig does not rest, with the input.
    pub fn find(plant: Plant, inputs: &[f64], sweep: Option<Sweep>) -> Result<Self> {
        let none = vec![None; plant.sensors().len()];
        let mut start = plant.initial_state(&plant.values(), &none)?;
        let count = sweep.as_ref().map_or(1, |sweep| sweep.count);
        let mut rows = Vec::with_capacity(count);
        for k in 0..count {
            let mut inputs = inputs.to_vec();
            if let Some(sweep) = &sweep {
                inputs[sweep.input] = sweep.value(k);
            }
            let row = Row::find(&plant, inputs, &start)?;
            start.clone_from(&row.rest.state);
            rows.push(row);
        }
        Ok(Self { plant, sweep, rows })
    }
}

impl Row {
    fn find(plant: &Plant, inputs: Vec<f64>, start: &[f64]) -> Result<Self> {
        let values = plant.values();
        let columns = inputs.iter().zip(plant.inputs());
        let si: Vec<f64> = columns.map(|(u, input)| u * input.column_factor).collect();
        let rest = plant.rest(&values, &si, start);
        let rest = rest.map_err(|error| Error::refused(Unsettled::new(plant, &inputs, error)))?;
        let intervals = plant.rest_intervals(&values, &si, &rest.state)?;
        let unknowns = [values.as_slice(), &si].concat();
        let (free, first_input) = (plant.free_slots(), values.len());
        let seeds: Vec<usize> = (first_input..unknowns.len()).chain(free.clone()).collect();
        let mut slopes = slopes(plant, &unknowns, &seeds, &rest.state)?;
        let by_parameter = slopes.split_off(si.len());
        for (slopes, input) in slopes.iter_mut().zip(plant.inputs()) {
            slopes
                .iter_mut()
                .for_each(|slope| *slope *= input.column_factor);
        }
        Ok(Self {
            signals: in_columns(plant, &rest.signals),
            inputs,
            rest,
            intervals,
            by_input: slopes,
            by_parameter: free.into_iter().zip(by_parameter).collect(),
        })
    }

    /// Lowest and highest reading of a sensor over all intervals; the reading where there is none.
    pub fn range(&self, plant: &Plant, sensor: usize) -> [f64; 2] {
        let factor = plant.sensors()[sensor].column_factor;
        let ends = self
            .intervals
            .iter()
            .flat_map(|interval| interval.ends.iter().flatten());
        let reading = self.signals[sensor];
        ends.map(|end| end.signals[sensor] / factor)
            .fold([reading; 2], |[low, high], end| {
                [low.min(end), high.max(end)]
            })
    }
}

/// A rig that does not rest, with the inputs.
#[derive(Debug)]
struct Unsettled {
    error: SimulationError,
    inputs: String,
}

impl Unsettled {
    fn new(plant: &Plant, inputs: &[f64], error: SimulationError) -> Self {
        Self {
            error,
            inputs: setting(plant, inputs),
        }
    }
}

impl std::fmt::Display for Unsettled {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.error.fmt(f)?;
        if self.inputs.is_empty() {
            Ok(())
        } else {
            write!(f, "\n  at: {}", self.inputs)
        }
    }
}

impl std::error::Error for Unsettled {}

/// Inputs as a person writes them: `u_N = 2, v_V = 0`.
pub fn setting(plant: &Plant, inputs: &[f64]) -> String {
    let columns = plant.inputs().iter().zip(inputs);
    let columns = columns.map(|(input, value)| format!("{} = {}", input.column, exact(*value)));
    columns.collect::<Vec<_>>().join(", ")
}

/// Readings in the units of their columns.
fn in_columns(plant: &Plant, signals: &[f64]) -> Vec<f64> {
    let scaled = |(signal, sensor): (&f64, &SensorChannel)| signal / sensor.column_factor;
    signals.iter().zip(plant.sensors()).map(scaled).collect()
}

/// Derivatives of the readings by numbers in SI: parameters, and behind them the inputs.
fn slopes(
    plant: &Plant,
    unknowns: &[f64],
    seeds: &[usize],
    state: &[f64],
) -> Result<Vec<Vec<f64>>> {
    let mut slopes = Vec::with_capacity(seeds.len());
    for seeds in seeds.chunks(SEEDS) {
        let mut numbers: Vec<Dual<SEEDS>> = unknowns.iter().map(|&x| Dual::constant(x)).collect();
        for (seed, &index) in seeds.iter().enumerate() {
            numbers[index] = Dual::variable(unknowns[index], seed);
        }
        let (values, inputs) = numbers.split_at(plant.parameters().len());
        let rest = plant.rest(values, inputs, state)?;
        for seed in 0..seeds.len() {
            let by_seed: Vec<f64> = rest.signals.iter().map(|s| s.derivative[seed]).collect();
            slopes.push(in_columns(plant, &by_seed));
        }
    }
    Ok(slopes)
}
