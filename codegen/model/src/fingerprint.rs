//! A model's identity: what host and device compare before they exchange anything else.

use crate::spec::{ControlSpec, ModelSpec, Role, SoftSensorSpec, StateSpec};

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
    hash.network(spec);
    // Only where there is one: the fingerprint of a model without it is what it always was.
    if let Some(state) = &spec.state {
        hash.state(state);
    }
    if let Some(sensor) = &spec.soft_sensor {
        hash.soft_sensor(sensor);
    }
    hash.control(&spec.control);
    hash.0
}

struct Fnv(u32);

impl Fnv {
    /// Skip connection, layers and their weights.
    fn network(&mut self, spec: &ModelSpec) {
        if let Some(skip) = &spec.skip {
            self.text("shortcut");
            self.count(skip.len());
            self.floats(skip);
        }
        self.count(spec.layers.len());
        for layer in &spec.layers {
            self.text(layer.kind());
            if let Some(activation) = layer.activation() {
                self.text(activation.name());
            }
            self.count(layer.inputs());
            self.count(layer.outputs());
            for (_, _, values) in layer.tensors() {
                self.floats(values);
            }
        }
    }

    /// States, parameters and noise of the filter.
    fn state(&mut self, state: &StateSpec) {
        for state in &state.states {
            let signal = &state.signal;
            self.text(&signal.name);
            self.doubles(&[signal.span, signal.offset, state.deviation, state.noise]);
            self.doubles(&[state.rest, state.rest_deviation]);
        }
        for parameter in &state.parameters {
            self.text(&parameter.name);
            let [value, spread] = [parameter.value, parameter.spread];
            let [lower, upper] = [parameter.lower, parameter.upper];
            self.doubles(&[value, spread, parameter.noise, lower, upper]);
        }
        self.floats(
            state
                .measurement
                .weights
                .iter()
                .chain(&state.measurement.bias),
        );
        self.doubles(&state.measurement_noise);
        self.doubles(&[state.disturbance_deviation, state.gate]);
    }

    /// Weights of the soft sensor and of its watch.
    fn soft_sensor(&mut self, sensor: &SoftSensorSpec) {
        self.text("soft sensor");
        self.floats(
            [&sensor.bias, &sensor.linear, &sensor.quadratic]
                .into_iter()
                .flatten(),
        );
        // Only where there is one, as below.
        if let Some(watch) = &sensor.watch {
            self.text("watch");
            self.floats(
                [&watch.bias, &watch.weights, &watch.spread]
                    .into_iter()
                    .flatten(),
            );
        }
    }

    /// Control problem: horizons, weights, limits and cost-to-go.
    fn control(&mut self, control: &ControlSpec) {
        self.count(control.horizon);
        self.count(control.control_horizon);
        self.count(control.move_blocks.len());
        for length in &control.move_blocks {
            self.count(*length);
        }
        self.count(control.first_step);
        self.doubles(&control.tracking_weight);
        self.doubles(&control.move_suppression);
        // Only where there is one: the fingerprint of a model without it is what it always was.
        if control.command_weight != 0.0 {
            self.doubles(&[control.command_weight]);
        }
        if control.observer_gain != 1.0 {
            // Below zero, where no weight is: the one alone is another model than the other alone.
            self.doubles(&[-control.observer_gain]);
        }
        self.doubles(&control.lower);
        self.doubles(&control.upper);
        self.doubles(&control.rate_limit);
        self.doubles(&control.safe);
        self.doubles(&[control.disturbance_gain]);
        self.count(control.iterations.into());
        self.count(control.max_missing_samples.into());
        // Only where there is one, as above.
        if let Some(budget) = control.budget {
            self.text("budget");
            self.bytes(&budget.to_le_bytes());
        }
        if let Some(value) = &control.value {
            self.text("value");
            self.count(value.rows);
            self.count(value.ahead);
            self.count(value.points.len());
            for point in &value.points {
                self.doubles(point);
            }
        }
    }

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

    /// Weights, whose number the shapes before them fix.
    fn floats<'a>(&mut self, values: impl IntoIterator<Item = &'a f32>) {
        for value in values {
            self.bytes(&value.to_le_bytes());
        }
    }

    fn doubles(&mut self, values: &[f64]) {
        self.count(values.len());
        for value in values {
            self.bytes(&value.to_le_bytes());
        }
    }
}
