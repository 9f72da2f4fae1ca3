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

/// Instructions of a multiply-add of a network's layers, and of other products.
const LAYER: f64 = 4.4;
const PRODUCT: f64 = 5.0;
/// Instructions of an activation that is no identity, and of a gate.
const CURVED: f64 = 30.0;
/// Instructions around the layers of one prediction, for each value of the regressor and at all.
const VALUE: f64 = 9.0;
const PREDICTION: f64 = 90.0;

/// Estimate for a validated model.
#[must_use]
pub fn parts(spec: &ModelSpec) -> PartWork {
    let control = &spec.control;
    let (n_u, n_y) = (spec.inputs.len() as f64, spec.outputs.len() as f64);
    let blocks = control.blocks();
    let n_v = n_u * blocks.len() as f64;
    let steps = control.horizon as f64;
    let regressor = spec.point_len() as f64;

    let weights: f64 = spec.layers.iter().map(|l| l.parameters() as f64).sum();
    let skip = spec.skip.as_ref().map_or(0.0, |skip| skip.len() as f64);
    let measured = spec.state.as_ref().map_or(0.0, |state| {
        (state.measurement.weights.len() + state.measurement.bias.len()) as f64
    });
    let curved: f64 = spec.layers.iter().map(curved).sum();
    let prediction =
        LAYER * (weights + skip + measured) + CURVED * curved + VALUE * regressor + PREDICTION;
    let value = value_rows(spec) * (regressor + n_y) * PRODUCT;
    let rollout = steps * prediction + 12.0 * n_v + value + 60.0;

    // From the output side, each layer costs its weights for every predicted value.
    let rows = spec.predicted_len() as f64 + spec.hidden_state_len() as f64;
    let jacobian = rows * (weights + skip) + curved * rows;
    let history = match &spec.state {
        Some(state) => state.states.len() as f64,
        None => n_y * spec.past_outputs as f64 + spec.hidden_state_len() as f64,
    };
    let mut derivative = 0.0;
    for active in active_blocks(&blocks, control.horizon) {
        let recursion = active * n_u * rows * history;
        let pairs = 0.5 * active * (active + 1.0) * n_u * n_u * n_y;
        derivative += PRODUCT * (recursion + pairs) + 40.0 * active;
    }
    derivative += steps * (LAYER * jacobian + PREDICTION);
    derivative += value * n_v + 8.0 * n_v * n_v + 60.0;

    let factorisation = PRODUCT * (n_v.powi(3) / 6.0 + 3.0 * n_v * n_v) + 60.0 * n_v + 100.0;
    PartWork {
        rollout: whole(rollout),
        derivative: whole(derivative),
        factorisation: whole(factorisation),
    }
}

/// Instructions as they are printed.
fn whole(instructions: f64) -> u32 {
    // Saturates; a model of that size is refused elsewhere.
    instructions.ceil() as u32
}

/// Values of a layer that go through a function.
fn curved(layer: &Layer) -> f64 {
    match layer {
        Layer::Dense(dense) => match dense.activation {
            Activation::Linear => 0.0,
            Activation::Tanh => dense.outputs as f64,
            Activation::Relu => 0.2 * dense.outputs as f64,
        },
        // Gates, and the state itself.
        Layer::Recurrent(layer) => 5.0 * layer.units as f64,
    }
}

/// Rows of the cost-to-go.
fn value_rows(spec: &ModelSpec) -> f64 {
    spec.control
        .value
        .as_ref()
        .map_or(0.0, |value| value.rows as f64)
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
