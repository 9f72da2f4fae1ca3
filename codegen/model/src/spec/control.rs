//! The control problem of a model (docs/explanation/controller.md).

use super::ValueSpec;
use super::limits::{MAX_BUDGET, MAX_DECISION_VARIABLES, MAX_HORIZON, MAX_ITERATIONS, MIN_BUDGET};
use super::validate::check;
use super::{Role, SpecError};

/// Control problem of the emitted controller. One entry per input or output.
#[derive(Clone, Debug, PartialEq)]
pub struct ControlSpec {
    /// Steps that are predicted, N2.
    pub horizon: usize,
    /// Steps that are decided, the last one held after that, Nc.
    pub control_horizon: usize,
    /// Move blocking: lengths of blocks of equal moves that make up the control horizon. Empty:
    /// every step is decided by itself.
    pub move_blocks: Vec<usize>,
    /// The first predicted step whose error counts, N1, from 1.
    pub first_step: usize,
    /// Diagonal of Q, per output, model units.
    pub tracking_weight: Vec<f64>,
    /// Diagonal of Lambda, per input, model units.
    pub move_suppression: Vec<f64>,
    /// R, on the square of every planned command in model units: what inputs that can do each
    /// other's work share it by. 0: off.
    pub command_weight: f64,
    /// Smallest command, physical units; minus infinity for none.
    pub lower: Vec<f64>,
    /// Largest command, physical units; infinity for none.
    pub upper: Vec<f64>,
    /// Largest change of the command, physical units per second; infinity for none.
    pub rate_limit: Vec<f64>,
    /// The command held when there is nothing to go by, physical units.
    pub safe: Vec<f64>,
    /// Gain of the output-disturbance estimate, 0 (off) to 1.
    pub disturbance_gain: f64,
    /// L of the observer: how much of a measurement enters the history, over 0 to 1; the rest is
    /// the prediction. 1: all of it.
    pub observer_gain: f64,
    /// Newton iterations in one step.
    pub iterations: u8,
    /// Most instructions of the optimisation of one step, as [`work::parts`](crate::work::parts)
    /// counts them; `None`: the iterations alone end it.
    pub budget: Option<u32>,
    /// Missing samples in a row that are predicted before the safe command is given.
    pub max_missing_samples: u16,
    /// Cost-to-go at the end of the horizon; `None`: the horizon is all that counts.
    pub value: Option<ValueSpec>,
}

const WEIGHT: &str = "a finite number, 0 or more";
const FINITE: &str = "a finite number";
const NUMBER: &str = "a number, or inf with its sign for none";
const RATE: &str = "a positive number of physical units per second, or inf for none";

impl ControlSpec {
    pub(super) fn validate(&self, inputs: usize, outputs: usize) -> Result<(), SpecError> {
        self.validate_horizons(inputs)?;
        // A command is narrowed to f32, so a number beyond its range is no number there.
        let finite = |x: f64| (x as f32).is_finite();
        let weight = |w: f64| w >= 0.0 && (w as f32).is_finite();
        let rate = |r: f64| r > 0.0;
        let (of_inputs, of_outputs) = ((Role::Input, inputs), (Role::Output, outputs));
        list(
            "tracking_weight",
            &self.tracking_weight,
            of_outputs,
            WEIGHT,
            weight,
        )?;
        list(
            "move_suppression",
            &self.move_suppression,
            of_inputs,
            WEIGHT,
            weight,
        )?;
        check(
            "control.command_weight",
            self.command_weight,
            WEIGHT,
            weight,
        )?;
        let number = |x: f64| !x.is_nan();
        list("lower", &self.lower, of_inputs, NUMBER, number)?;
        list("upper", &self.upper, of_inputs, NUMBER, number)?;
        list("rate_limit", &self.rate_limit, of_inputs, RATE, rate)?;
        list("safe", &self.safe, of_inputs, FINITE, finite)?;
        if self.tracking_weight.iter().all(|&w| w == 0.0) {
            return Err(SpecError::Value {
                key: "control.tracking_weight".into(),
                value: "all zero".into(),
                expected: "a positive weight on at least one output".into(),
            });
        }
        for index in 0..inputs {
            self.validate_range(index)?;
        }
        check(
            "control.disturbance_gain",
            self.disturbance_gain,
            "0 to 1",
            |g| (0.0..=1.0).contains(&g),
        )?;
        check(
            "control.observer_gain",
            self.observer_gain,
            "more than 0 and at most 1",
            |gain| gain as f32 > 0.0 && gain <= 1.0,
        )?;
        check(
            "control.iterations",
            self.iterations,
            format!("1 to {MAX_ITERATIONS}"),
            |n| (1..=MAX_ITERATIONS).contains(&n),
        )?;
        if let Some(budget) = self.budget {
            check(
                "control.budget",
                budget,
                format!("{MIN_BUDGET} to {MAX_BUDGET} instructions"),
                |n| (MIN_BUDGET..=MAX_BUDGET).contains(&n),
            )?;
        }
        match &self.value {
            Some(value) => value.validate(self.horizon, outputs),
            None => Ok(()),
        }
    }

    /// Rows of the reference that a step sees: those of the horizon, and those ahead of it.
    #[must_use]
    pub fn preview(&self) -> usize {
        self.horizon + self.value.as_ref().map_or(0, |value| value.ahead)
    }

    fn validate_horizons(&self, inputs: usize) -> Result<(), SpecError> {
        check(
            "control.horizon",
            self.horizon,
            format!("1 to {MAX_HORIZON}"),
            |n| (1..=MAX_HORIZON).contains(&n),
        )?;
        let horizon = self.horizon;
        check(
            "control.first_step",
            self.first_step,
            format!("1 to {horizon}, the horizon"),
            |n| (1..=horizon).contains(&n),
        )?;
        let most = MAX_DECISION_VARIABLES / inputs;
        if self.move_blocks.is_empty() {
            let longest = self.horizon.min(most);
            return check(
                "control.control_horizon",
                self.control_horizon,
                format!(
                    "1 to {longest}: no longer than the horizon, \
                     and at most {MAX_DECISION_VARIABLES} decision variables"
                ),
                |n| (1..=longest).contains(&n),
            );
        }
        check(
            "control.control_horizon",
            self.control_horizon,
            format!("1 to {horizon}, the horizon"),
            |n| (1..=horizon).contains(&n),
        )?;
        let steps = self.control_horizon;
        let blocks = &self.move_blocks;
        let sum = blocks
            .iter()
            .try_fold(0_usize, |sum, n| sum.checked_add(*n));
        if sum != Some(steps) || blocks.contains(&0) || blocks.len() > most {
            return Err(SpecError::Value {
                key: "control.move_blocks".into(),
                value: format!("{blocks:?}"),
                expected: format!(
                    "at most {most} lengths, each 1 or more, that add up to \
                     control_horizon = {steps}"
                ),
            });
        }
        Ok(())
    }

    /// Lengths of the blocks of equal moves, in steps: [`ControlSpec::move_blocks`], or ones.
    pub fn blocks(&self) -> Vec<usize> {
        if self.move_blocks.is_empty() {
            vec![1; self.control_horizon]
        } else {
            self.move_blocks.clone()
        }
    }

    /// The range of one command, and the safe command within it.
    fn validate_range(&self, index: usize) -> Result<(), SpecError> {
        let (lower, upper) = (self.lower[index], self.upper[index]);
        // Limits are narrowed to f32 inwards (emit::control), which must leave a value between.
        check(
            format!("control.upper.{index}"),
            upper,
            format!("more than control.lower.{index}, which is {lower}"),
            |upper| (upper as f32) > (lower as f32).next_up(),
        )?;
        check(
            format!("control.safe.{index}"),
            self.safe[index],
            format!("{lower} to {upper}, the range of the command"),
            |safe| (lower..=upper).contains(&safe),
        )
    }
}

/// One value for each signal of a role, each of them accepted.
fn list(
    key: &'static str,
    values: &[f64],
    (role, expected): (Role, usize),
    accepted: &str,
    accepts: impl Fn(f64) -> bool,
) -> Result<(), SpecError> {
    if values.len() != expected {
        return Err(SpecError::ControlLength {
            key,
            found: values.len(),
            expected,
            role,
        });
    }
    for (index, &value) in values.iter().enumerate() {
        check(format!("control.{key}.{index}"), value, accepted, &accepts)?;
    }
    Ok(())
}
