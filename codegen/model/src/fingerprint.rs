//! A model's identity: what host and device compare before they exchange anything else.

use crate::spec::{ModelSpec, Role};

/// 32-bit FNV-1a of everything that changes what the controller computes: shapes, scalings,
/// weights, control problem, and the name. Units and golden vectors are left out.
///
/// Stable: the same model has the same fingerprint on every machine and in every later version,
/// since boards in the field report it.
#[must_use]
pub fn fingerprint(spec: &ModelSpec) -> u32 {
    let mut hash = Fnv(0x811c_9dc5);
    hash.text(&spec.name);
    hash.doubles(&[spec.period_s]);
    for role in Role::ALL {
        hash.count(spec.signals(role).len());
        for signal in spec.signals(role) {
            hash.text(&signal.name);
            hash.doubles(&[signal.span, signal.offset]);
        }
    }
    hash.count(spec.past_inputs);
    hash.count(spec.past_outputs);
    hash.text(spec.form.name());
    if let Some(skip) = &spec.skip {
        hash.text("shortcut");
        hash.count(skip.len());
        for value in skip {
            hash.bytes(&value.to_le_bytes());
        }
    }
    hash.count(spec.layers.len());
    for layer in &spec.layers {
        hash.text(layer.kind());
        if let Some(activation) = layer.activation() {
            hash.text(activation.name());
        }
        hash.count(layer.inputs());
        hash.count(layer.outputs());
        for (_, _, values) in layer.tensors() {
            for value in values {
                hash.bytes(&value.to_le_bytes());
            }
        }
    }
    // Only where there is one: the fingerprint of a model without it is what it always was.
    if let Some(state) = &spec.state {
        for state in &state.states {
            let signal = &state.signal;
            hash.text(&signal.name);
            hash.doubles(&[signal.span, signal.offset, state.deviation, state.noise]);
            hash.doubles(&[state.rest, state.rest_deviation]);
        }
        for parameter in &state.parameters {
            hash.text(&parameter.name);
            let [value, spread] = [parameter.value, parameter.spread];
            let [lower, upper] = [parameter.lower, parameter.upper];
            hash.doubles(&[value, spread, parameter.noise, lower, upper]);
        }
        for value in state
            .measurement
            .weights
            .iter()
            .chain(&state.measurement.bias)
        {
            hash.bytes(&value.to_le_bytes());
        }
        hash.doubles(&state.measurement_noise);
        hash.doubles(&[state.disturbance_deviation, state.gate]);
    }
    if let Some(sensor) = &spec.soft_sensor {
        hash.text("soft sensor");
        for value in [&sensor.bias, &sensor.linear, &sensor.quadratic]
            .into_iter()
            .flatten()
        {
            hash.bytes(&value.to_le_bytes());
        }
        // Only where there is one, as below.
        if let Some(watch) = &sensor.watch {
            hash.text("watch");
            for value in [&watch.bias, &watch.weights, &watch.spread]
                .into_iter()
                .flatten()
            {
                hash.bytes(&value.to_le_bytes());
            }
        }
    }
    let control = &spec.control;
    hash.count(control.horizon);
    hash.count(control.control_horizon);
    hash.count(control.move_blocks.len());
    for length in &control.move_blocks {
        hash.count(*length);
    }
    hash.count(control.first_step);
    hash.doubles(&control.tracking_weight);
    hash.doubles(&control.move_suppression);
    // Only where there is one: the fingerprint of a model without it is what it always was.
    if control.command_weight != 0.0 {
        hash.doubles(&[control.command_weight]);
    }
    if control.observer_gain != 1.0 {
        // Below zero, where no weight is: the one alone is another model than the other alone.
        hash.doubles(&[-control.observer_gain]);
    }
    hash.doubles(&control.lower);
    hash.doubles(&control.upper);
    hash.doubles(&control.rate_limit);
    hash.doubles(&control.safe);
    hash.doubles(&[control.disturbance_gain]);
    hash.count(control.iterations.into());
    hash.count(control.max_missing_samples.into());
    // Only where there is one, as above.
    if let Some(budget) = control.budget {
        hash.text("budget");
        hash.bytes(&budget.to_le_bytes());
    }
    if let Some(value) = &control.value {
        hash.text("value");
        hash.count(value.rows);
        hash.count(value.ahead);
        hash.count(value.points.len());
        for point in &value.points {
            hash.doubles(point);
        }
    }
    hash.0
}

struct Fnv(u32);

impl Fnv {
    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u32::from(byte)).wrapping_mul(0x0100_0193);
        }
    }

    /// Lists begin with their length, so that two lists cannot run into each other unseen.
    fn count(&mut self, count: usize) {
        self.bytes(&(count as u64).to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.count(text.len());
        self.bytes(text.as_bytes());
    }

    fn doubles(&mut self, values: &[f64]) {
        self.count(values.len());
        for value in values {
            self.bytes(&value.to_le_bytes());
        }
    }
}
