//! Input trajectory of a plant over a recording: its input columns, without gaps.

use crate::error::SimulationError;
use crate::input_history::InputHistory;
use crate::plant::Plant;

/// The inputs of a plant at every row of a recording, SI.
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n\
/// # [[actuator]]\nname='a'\ndrives='m'\ninput='u_N'\ngain=1.0\n";
/// use sinew_sim::{InputTrajectory, Plant, Rig};
/// let plant = Plant::new(&Rig::parse(text, "x.toml")?)?;
/// let inputs = InputTrajectory::new(&plant, 4, &[&[1.0, f64::NAN, f64::NAN, 2.0]])?;
/// assert_eq!(inputs.column(0), [1.0, 1.0, 1.0, 2.0]); // missing samples hold the last
/// assert_eq!(inputs.held(), [2]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct InputTrajectory {
    columns: Vec<Vec<f64>>,
    rows: usize,
    held: Vec<usize>,
    past: InputHistory,
}

impl InputTrajectory {
    /// From one column an input, in the order of [`Plant::inputs`]. A missing sample (NaN) holds
    /// the last value, and before the first valid one that one; [`InputTrajectory::held`] counts
    /// them.
    ///
    /// # Errors
    /// [`SimulationError::Shape`] for a wrong number of columns or rows,
    /// [`SimulationError::NoInput`] for a column without one valid sample.
    pub fn new(plant: &Plant, rows: usize, columns: &[&[f64]]) -> Result<Self, SimulationError> {
        plant.expect("input columns", plant.inputs().len(), columns.len())?;
        let mut drive = Self {
            columns: Vec::with_capacity(columns.len()),
            rows,
            held: Vec::with_capacity(columns.len()),
            past: InputHistory::default(),
        };
        for (input, column) in plant.inputs().iter().zip(columns) {
            let what = format!("input column `{}`", input.column);
            plant.expect(&what, rows, column.len())?;
            let valid = column.iter().copied().find(|sample| sample.is_finite());
            let Some(mut last) = valid.or((rows == 0).then_some(0.0)) else {
                return Err(SimulationError::NoInput {
                    column: input.column.clone(),
                });
            };
            let mut missing = 0;
            let filled = column.iter().map(|&sample| {
                if sample.is_finite() {
                    last = sample;
                } else {
                    missing += 1;
                }
                last
            });
            drive.columns.push(filled.collect());
            drive.held.push(missing);
        }
        Ok(drive)
    }

    /// With what the inputs did before: rows of the same columns at `times`, all of them before
    /// `now`, when the first row of the drive is. Delays, plays and lags of actuators then begin
    /// where that leaves them; a lag is taken to have settled 64 rows before. Costs next to nothing
    /// where no actuator has any.
    ///
    /// # Errors
    /// [`SimulationError::Shape`] for a wrong number of columns or rows,
    /// [`SimulationError::NotFinite`] for a missing sample, [`SimulationError::Time`] for times
    /// that do not increase.
    pub fn after(
        mut self,
        plant: &Plant,
        times: &[f64],
        now: f64,
        columns: &[&[f64]],
    ) -> Result<Self, SimulationError> {
        plant.expect("past input columns", plant.inputs().len(), columns.len())?;
        for (input, column) in plant.inputs().iter().zip(columns) {
            let what = format!("the past of input column `{}`", input.column);
            plant.expect(&what, times.len(), column.len())?;
        }
        if !plant.topology.has_memory() || self.rows == 0 {
            return Ok(self);
        }
        let next = times.iter().skip(1).chain([&now]);
        if let Some(row) = times.iter().zip(next).position(|(t, next)| t >= next) {
            return Err(SimulationError::Time { row: row + 1 });
        }
        for (input, column) in plant.inputs().iter().zip(columns) {
            if column.iter().any(|value| !value.is_finite()) {
                let what = format!("the past of input column `{}`", input.column);
                return Err(SimulationError::NotFinite { what });
            }
        }
        self.past = InputHistory::new(times, now, columns);
        Ok(self)
    }

    /// History of the inputs before the first row; empty where that is not known.
    pub(crate) fn past(&self) -> &InputHistory {
        &self.past
    }

    /// Rows of the recording.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Missing samples of each input, which held their last value.
    pub fn held(&self) -> &[usize] {
        &self.held
    }

    /// One input, gaps filled.
    pub fn column(&self, input: usize) -> &[f64] {
        &self.columns[input]
    }

    /// One input at one row.
    #[inline]
    pub(crate) fn at(&self, row: usize, input: usize) -> f64 {
        self.columns[input][row]
    }
}
