//! Estimate of the work of an optimisation, in instructions of a Cortex-M4F: what a budget counts
//! (docs/explanation/controller.md, section 5).
//!
//! Multiply-adds are counted from the shapes, and turned into instructions by factors that were
//! fitted to counts in QEMU. Every machine counts with the same numbers, so all stop at the same
//! place.

use crate::spec::{Activation, Layer, ModelSpec};

/// Instructions of the parts of an optimisation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PartWork {
    /// An evaluation of J.
    pub rollout: u32,
    /// A gradient with Hessian.
    pub derivative: u32,
    /// A factorisation with all around it.
    pub factorisation: u32,
}

impl PartWork {
    /// Least budget that optimises anything: an evaluation of J, a gradient, a factorisation.
    #[must_use]
    pub fn least(&self) -> u32 {
        (self.rollout)
            .saturating_add(self.derivative)
            .saturating_add(self.factorisation)
    }
}

/// Instructions of a multiply-add: in a prediction, in its Jacobian, in sensitivities and Hessian.
const FORWARD: f64 = 2.6;
const BACKWARD: f64 = 2.6;
const SENSITIVITY: f64 = 2.75;
/// Instructions of a tanh, of a ReLU, and of the gates of a recurrent unit.
const TANH: f64 = 24.0;
const RELU: f64 = 4.0;
const GATES: f64 = 100.0;
/// Instructions around a prediction, and for each value of the regressor that is moved.
const AROUND: f64 = 40.0;
const VALUE: f64 = 3.0;
/// Instructions around a part.
const PART: f64 = 250.0;

/// Estimate for a validated model.
#[must_use]
pub fn parts(spec: &ModelSpec) -> PartWork {
    let control = &spec.control;
    let (n_u, n_y) = (spec.inputs.len() as f64, spec.outputs.len() as f64);
    let blocks = control.blocks();
    let n_v = n_u * blocks.len() as f64;
    let steps = control.horizon as f64;
    let network = Network::of(spec);
    // Rows of a cost-to-go are products with the regressor at the end.
    let rows = control
        .value
        .as_ref()
        .map_or(0.0, |value| value.rows as f64);
    let to_go = rows * (spec.point_len() as f64 + 2.0);

    let rollout = steps * network.prediction + FORWARD * to_go + 10.0 * n_v + PART / 10.0;
    let mut sensitivities = 0.0;
    let mut jacobians = network.first_jacobian;
    for (step, active) in active_blocks(&blocks, control.horizon).enumerate() {
        let pairs = 0.5 * active * (active + 1.0) * n_u * n_u * n_y;
        sensitivities += active * n_u * network.along + network.inputs + pairs;
        if step > 0 {
            jacobians += network.jacobian;
        }
    }
    let derivative = BACKWARD * jacobians
        + SENSITIVITY * (sensitivities + to_go * n_v + rows * n_v * n_v)
        + PART;
    let factorisation = 156.0 + 72.0 * n_v + 5.6 * n_v.powi(2) + 4.14 * n_v.powi(3);
    PartWork {
        rollout: whole(rollout),
        derivative: whole(derivative),
        factorisation: whole(factorisation),
    }
}

/// Work of one step of the horizon: instructions, then multiply-adds.
struct Network {
    /// Instructions of a prediction.
    prediction: f64,
    /// Its Jacobian.
    jacobian: f64,
    /// That of the first step, by u(k) alone.
    first_jacobian: f64,
    /// Sensitivity by one decision variable.
    along: f64,
    /// Effect of the commands on the sensitivities.
    inputs: f64,
}

impl Network {
    fn of(spec: &ModelSpec) -> Self {
        let (n_u, n_y) = (spec.inputs.len() as f64, spec.outputs.len() as f64);
        let weights: f64 = spec.layers.iter().map(|l| l.parameters() as f64).sum();
        let skip = spec.skip.as_ref().map_or(0.0, |skip| skip.len() as f64);
        let curved: f64 = spec.layers.iter().map(curved).sum();
        let point = spec.point_len() as f64;
        let measurement = spec.state.as_ref().map_or(0.0, |state| {
            (state.measurement.weights.len() + state.measurement.bias.len()) as f64
        });
        let prediction = FORWARD * (weights + skip + measurement) + curved + VALUE * point + AROUND;
        let rows = spec.predicted_len() as f64;
        // The product from the output side: every weight behind the first layer once a row, then
        // the first layer by its arguments.
        let (mut behind, mut first, mut units, mut cell) = (0.0, 0.0, 0.0, 0.0);
        for (index, layer) in spec.layers.iter().enumerate() {
            let (inputs, outputs) = (layer.inputs() as f64, layer.outputs() as f64);
            match layer {
                // The direction of each decision variable goes through the cell.
                Layer::Recurrent(_) => cell = layer.parameters() as f64,
                Layer::Dense(_) if index == 0 => (first, units) = (outputs * inputs, outputs),
                // The last layer's rows are the seed.
                Layer::Dense(_) if index + 1 == spec.layers.len() => behind += inputs * outputs,
                Layer::Dense(_) => behind += rows * inputs * outputs,
            }
        }
        if let Some(state) = &spec.state {
            let states = state.states.len() as f64;
            return Self {
                prediction,
                jacobian: behind + states * units * (states + n_u),
                first_jacobian: behind + states * units * (states + n_u),
                along: states * (states + n_y),
                inputs: states * n_u,
            };
        }
        let past_outputs = n_y * spec.past_outputs as f64;
        Self {
            prediction,
            jacobian: behind + rows * first + skip,
            first_jacobian: behind + rows * units * n_u,
            along: n_y * past_outputs + cell,
            inputs: 1.6 * spec.past_inputs as f64 * n_u * n_y,
        }
    }
}

/// Instructions as they are printed.
fn whole(instructions: f64) -> u32 {
    // Saturates; a model of that size is refused elsewhere.
    instructions.ceil() as u32
}

/// Instructions of a layer's activation.
fn curved(layer: &Layer) -> f64 {
    match layer {
        Layer::Dense(dense) => {
            let each = match dense.activation {
                Activation::Linear => 0.0,
                Activation::Tanh => TANH,
                Activation::Relu => RELU,
            };
            each * dense.outputs as f64
        }
        Layer::Recurrent(layer) => GATES * layer.units as f64,
    }
}

/// Blocks that have an effect after each predicted step.
fn active_blocks(blocks: &[usize], horizon: usize) -> impl Iterator<Item = f64> + '_ {
    let begins = |block: usize| blocks.iter().take(block).sum::<usize>();
    (0..horizon).map(move |step| {
        (0..blocks.len())
            .filter(|block| begins(*block) <= step)
            .count() as f64
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// Counts in QEMU (`sinew size`), the longest of 400 random states. Not every unit of a ReLU
    /// layer is open there, so P is estimated as more.
    #[test]
    fn parts_are_those_that_were_counted() {
        for (model, counted, over) in [
            ("reference-s", [7429, 15_203, 3196], 1.1),
            ("reference-s-n1", [763, 675, 338], 1.1),
            ("reference-s-n5", [3734, 5889, 808], 1.1),
            ("reference-l", [61_085, 136_623, 3196], 1.1),
            ("reference-p", [7396, 17_688, 3138], 1.35),
            ("demo-state", [9076, 5116, 836], 1.1),
        ] {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("../../models")
                .join(model);
            let spec = crate::store::load(&folder).expect("the model is committed");
            let PartWork {
                rollout,
                derivative,
                factorisation,
            } = parts(&spec);
            for (estimate, counted) in [rollout, derivative, factorisation].iter().zip(counted) {
                let ratio = f64::from(*estimate) / f64::from(counted);
                assert!(
                    (0.92..over).contains(&ratio),
                    "{model}: {estimate} for {counted}"
                );
            }
        }
    }
}
