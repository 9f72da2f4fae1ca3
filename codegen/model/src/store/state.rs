//! The tables `[[state]]`, `[[parameter]]` and `[filter]` of a model with a state.

use std::fmt::Write;

use serde::Deserialize;

use super::quote::string;
use crate::spec::{Activation, Dense, Parameter, Signal, State, StateSpec};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StateTable {
    name: String,
    unit: String,
    span: f64,
    offset: f64,
    /// Files without it begin at the middle.
    #[serde(default)]
    rest: f64,
    /// Files without it begin as after a gap.
    rest_deviation: Option<f64>,
    deviation: f64,
    noise: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ParameterTable {
    name: String,
    value: f64,
    spread: f64,
    noise: f64,
    lower: f64,
    upper: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FilterTable {
    measurement_noise: Vec<f64>,
    disturbance_deviation: f64,
    gate: f64,
}

/// The description without the measurement's weights.
pub(super) fn spec(
    states: Vec<StateTable>,
    parameters: Vec<ParameterTable>,
    filter: FilterTable,
    measurements: usize,
) -> StateSpec {
    let states = states.into_iter().map(|table| State {
        signal: Signal {
            name: table.name,
            unit: table.unit,
            span: table.span,
            offset: table.offset,
        },
        rest: table.rest,
        rest_deviation: table.rest_deviation.unwrap_or(table.deviation),
        deviation: table.deviation,
        noise: table.noise,
    });
    let states: Vec<State> = states.collect();
    let parameters = parameters.into_iter().map(|table| Parameter {
        name: table.name,
        value: table.value,
        spread: table.spread,
        noise: table.noise,
        lower: table.lower,
        upper: table.upper,
    });
    StateSpec {
        measurement: Dense {
            inputs: states.len(),
            outputs: measurements,
            weights: Vec::new(),
            bias: Vec::new(),
            activation: Activation::Linear,
        },
        states,
        parameters: parameters.collect(),
        measurement_noise: filter.measurement_noise,
        disturbance_deviation: filter.disturbance_deviation,
        gate: filter.gate,
    }
}

pub(super) fn write(text: &mut String, spec: &StateSpec) -> std::fmt::Result {
    for state in &spec.states {
        writeln!(text, "\n[[state]]")?;
        writeln!(text, "name = {}", string(&state.signal.name))?;
        writeln!(text, "unit = {}", string(&state.signal.unit))?;
        writeln!(text, "span = {:?}", state.signal.span)?;
        writeln!(text, "offset = {:?}", state.signal.offset)?;
        writeln!(text, "rest = {:?}", state.rest)?;
        writeln!(text, "rest_deviation = {:?}", state.rest_deviation)?;
        writeln!(text, "deviation = {:?}", state.deviation)?;
        writeln!(text, "noise = {:?}", state.noise)?;
    }
    for parameter in &spec.parameters {
        writeln!(text, "\n[[parameter]]")?;
        writeln!(text, "name = {}", string(&parameter.name))?;
        writeln!(text, "value = {:?}", parameter.value)?;
        writeln!(text, "spread = {:?}", parameter.spread)?;
        writeln!(text, "noise = {:?}", parameter.noise)?;
        writeln!(text, "lower = {:?}", parameter.lower)?;
        writeln!(text, "upper = {:?}", parameter.upper)?;
    }
    writeln!(text, "\n[filter]")?;
    writeln!(text, "measurement_noise = {:?}", spec.measurement_noise)?;
    let deviation = spec.disturbance_deviation;
    writeln!(text, "disturbance_deviation = {deviation:?}")?;
    writeln!(text, "gate = {:?}", spec.gate)
}
