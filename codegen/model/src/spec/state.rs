//! Transition, measurement and filter of a model with a state
//! (docs/explanation/controller.md, sections 9 and 10).

use super::validate::check;
use super::{Dense, Signal, SpecError};

/// Most states of a model: a filter's work grows with their cube.
pub const MAX_STATES: usize = 8;
/// Most parameters that a filter estimates.
pub const MAX_PARAMETERS: usize = 4;

/// A model with a state. The layers then take (u(k), x(k), theta) and give the change of the state
/// (docs/explanation/controller.md, eq. 20).
#[derive(Clone, Debug, PartialEq)]
pub struct StateSpec {
    /// States, in the order of the last layer's outputs.
    pub states: Vec<State>,
    /// Parameters that the filter estimates.
    pub parameters: Vec<Parameter>,
    /// Outputs and channels as a linear function of the state.
    pub measurement: Dense,
    /// Standard deviation of each measurement, model units.
    pub measurement_noise: Vec<f64>,
    /// Standard deviation of each input's disturbance before any reading, model units.
    pub disturbance_deviation: f64,
    /// Largest innovation that is believed, in its standard deviations.
    pub gate: f64,
}

/// One state and what the filter assumes of it.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Name, unit and scaling.
    pub signal: Signal,
    /// Value at rest, model units; where rest says nothing, the middle.
    pub rest: f64,
    /// Standard deviation at a start at rest, model units.
    pub rest_deviation: f64,
    /// Standard deviation after a gap, when the plant may move, model units.
    pub deviation: f64,
    /// Standard deviation of what a period adds and the model does not know, model units.
    pub noise: f64,
}

/// One parameter; theta = (physical / value - 1) / spread.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name in the rig.
    pub name: String,
    /// Physical value of the usual device.
    pub value: f64,
    /// Standard deviation over the devices, as a part of the value.
    pub spread: f64,
    /// Standard deviation of the change of theta over a period.
    pub noise: f64,
    /// Least theta.
    pub lower: f64,
    /// Largest theta.
    pub upper: f64,
}

impl StateSpec {
    pub(super) fn validate(&self, measurements: usize) -> Result<(), SpecError> {
        let range = format!("1 to {MAX_STATES} states");
        check("state", self.states.len(), range, |n| {
            (1..=MAX_STATES).contains(&n)
        })?;
        let range = format!("at most {MAX_PARAMETERS} parameters");
        check("parameter", self.parameters.len(), range, |n| {
            n <= MAX_PARAMETERS
        })?;
        let positive = |v: f64| v > 0.0 && (v as f32).is_normal();
        let noise = |v: f64| v >= 0.0 && (v as f32).is_finite();
        let (a_noise, a_deviation) = ("a finite number, 0 or more", "a positive number");
        for (i, state) in self.states.iter().enumerate() {
            let key = |name: &str| format!("state.{i}.{name}");
            check(key("span"), state.signal.span, a_deviation, positive)?;
            let finite = |v: f64| (v as f32).is_finite();
            check(
                key("offset"),
                state.signal.offset,
                "a finite number",
                finite,
            )?;
            check(key("rest"), state.rest, "a finite number", finite)?;
            check(key("rest_deviation"), state.rest_deviation, a_noise, noise)?;
            check(key("deviation"), state.deviation, a_deviation, positive)?;
            check(key("noise"), state.noise, a_noise, noise)?;
        }
        for (i, parameter) in self.parameters.iter().enumerate() {
            let key = |name: &str| format!("parameter.{i}.{name}");
            check(key("spread"), parameter.spread, a_deviation, positive)?;
            check(key("noise"), parameter.noise, a_noise, noise)?;
            let below = |v: f64| v < 0.0 && v.is_finite();
            check(key("lower"), parameter.lower, "a number below 0", below)?;
            check(key("upper"), parameter.upper, a_deviation, positive)?;
        }
        check(
            "filter.measurement_noise",
            self.measurement_noise.len(),
            format!("{measurements} values, one for each output and channel"),
            |n| n == measurements,
        )?;
        for (i, value) in self.measurement_noise.iter().enumerate() {
            let key = format!("filter.measurement_noise.{i}");
            check(key, *value, a_deviation, positive)?;
        }
        let key = "filter.disturbance_deviation";
        check(key, self.disturbance_deviation, a_deviation, positive)?;
        check("filter.gate", self.gate, "more than 0", |gate| gate > 0.0)?;
        let shape = (self.measurement.outputs, self.measurement.inputs);
        if shape != (measurements, self.states.len()) {
            return Err(SpecError::Value {
                key: "state".into(),
                value: format!("a measurement of {} by {}", shape.0, shape.1),
                expected: format!(
                    "{measurements} measurements of {} states",
                    self.states.len()
                ),
            });
        }
        let numbers = self.measurement.weights.iter();
        if numbers.chain(&self.measurement.bias).all(|v| v.is_finite()) {
            return Ok(());
        }
        Err(SpecError::Value {
            key: String::new(),
            value: "a measurement that is not finite".into(),
            expected: "finite numbers".into(),
        })
    }
}
