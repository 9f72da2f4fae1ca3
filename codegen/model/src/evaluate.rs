//! The network in double precision: what emitted code is held against.
//!
//! Weights are the f32 of the specification, everything else is f64. Sums run in one fixed order,
//! so that the same model gives the same bits on every machine.

use crate::spec::{Activation, Dense, Layer, ModelSpec, OutputForm};
use crate::to_network;
use sinew_nn::evaluate::{self as recurrent, Call};
use sinew_nn::math;

/// The next output and its derivatives (docs/reference/model-files.md, eq. 4 and 5).
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// `y(k+1)`, model units.
    pub y: Vec<f64>,
    /// A row for each output; a column for each value of the regressor, channels included, then for
    /// each of the hidden state.
    pub jacobian: Vec<Vec<f64>>,
    /// Hidden state after it.
    pub hidden_state: Vec<f64>,
    /// A row for each value of `hidden_state`, the columns of `jacobian`.
    pub hidden_state_jacobian: Vec<Vec<f64>>,
}

/// The next output `y(k+1)` in model units for the flattened regressor and hidden state, `x`, in
/// model units.
///
/// # Panics
/// If `x` is not as long as these, or the layers do not fit each other: the specification
/// is to be validated first.
#[must_use]
pub fn predict(spec: &ModelSpec, x: &[f64]) -> Vec<f64> {
    advance(spec, x).0
}

/// As [`predict`], and the hidden state afterwards.
///
/// # Panics
/// As [`predict`].
#[must_use]
pub fn advance(spec: &ModelSpec, x: &[f64]) -> (Vec<f64>, Vec<f64>) {
    check(spec, x);
    if spec.hidden_state_len() > 0 {
        let (x, hidden_state) = x.split_at(spec.regressor_len());
        let Call { y, state } = recurrent::call(&unscaled(spec), x, hidden_state);
        return (y, state);
    }
    let mut a = x.to_vec();
    for layer in &spec.layers {
        if let Layer::Dense(dense) = layer {
            a = dense_forward(dense, &a).0;
        }
    }
    add_skip(spec, x, &mut a);
    add_present_output(spec, x, &mut a);
    (a, Vec::new())
}

/// A recurrent model as a network of model units.
fn unscaled(spec: &ModelSpec) -> sinew_nn::Network {
    to_network::unscaled(spec).expect("a validated specification is a network")
}

/// The next output and its exact derivatives with respect to the whole regressor, by the chain
/// rule from the first layer on.
///
/// # Panics
/// As [`predict`].
#[must_use]
pub fn predict_with_jacobian(spec: &ModelSpec, x: &[f64]) -> Evaluation {
    check(spec, x);
    if spec.hidden_state_len() > 0 {
        let (y, hidden_state) = advance(spec, x);
        let (x, state) = x.split_at(spec.regressor_len());
        let mut jacobian = recurrent::jacobian(&unscaled(spec), x, state);
        let hidden_state_jacobian = jacobian.split_off(y.len());
        return Evaluation {
            y,
            jacobian,
            hidden_state,
            hidden_state_jacobian,
        };
    }
    let mut a = x.to_vec();
    let mut jacobian: Vec<Vec<f64>> = (0..x.len()).map(|i| unit(x.len(), i)).collect();
    for layer in &spec.layers {
        let Layer::Dense(dense) = layer else {
            continue;
        };
        let (next, slope) = dense_forward(dense, &a);
        jacobian = dense
            .rows()
            .zip(&slope)
            .map(|(row, slope)| chain(row, *slope, &jacobian))
            .collect();
        a = next;
    }
    add_skip(spec, x, &mut a);
    if let Some(weights) = &spec.skip {
        for (row, weights) in jacobian.iter_mut().zip(weights.chunks(x.len().max(1))) {
            for (slope, weight) in row.iter_mut().zip(weights) {
                *slope += f64::from(*weight);
            }
        }
    }
    add_present_output(spec, x, &mut a);
    if spec.form != OutputForm::Absolute {
        for (output, row) in jacobian.iter_mut().enumerate() {
            row[present_output(spec) + output] += 1.0;
        }
    }
    Evaluation {
        y: a,
        jacobian,
        hidden_state: Vec::new(),
        hidden_state_jacobian: Vec::new(),
    }
}

/// Place of y(k) in the flattened regressor.
fn present_output(spec: &ModelSpec) -> usize {
    spec.past_inputs * spec.inputs.len()
}

fn add_skip(spec: &ModelSpec, x: &[f64], y: &mut [f64]) {
    let Some(weights) = &spec.skip else {
        return;
    };
    for (y, row) in y.iter_mut().zip(weights.chunks(x.len().max(1))) {
        *y = row
            .iter()
            .zip(x)
            .fold(*y, |sum, (&w, x)| sum + f64::from(w) * x);
    }
}

fn add_present_output(spec: &ModelSpec, x: &[f64], y: &mut [f64]) {
    if spec.form != OutputForm::Absolute {
        for (y, now) in y.iter_mut().zip(&x[present_output(spec)..]) {
            *y += now;
        }
    }
}

/// `a = activation(W x + b)` and the activation's slope at each output.
fn dense_forward(dense: &Dense, x: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let z = dense.rows().zip(&dense.bias).map(|(row, &bias)| {
        row.iter()
            .zip(x)
            .fold(f64::from(bias), |sum, (&w, x)| sum + f64::from(w) * x)
    });
    z.map(|z| match dense.activation {
        Activation::Linear => (z, 1.0),
        Activation::Tanh => {
            let a = math::tanh(z);
            (a, 1.0 - a * a)
        }
        Activation::Relu if z <= 0.0 => (0.0, 0.0),
        // Not max(0, z), which would hide a NaN.
        Activation::Relu => (z, 1.0),
    })
    .unzip()
}

/// One row of `diag(slope) W J`.
fn chain(row: &[f32], slope: f64, jacobian: &[Vec<f64>]) -> Vec<f64> {
    let mut product = vec![0.0; jacobian[0].len()];
    for (&w, inner) in row.iter().zip(jacobian) {
        for (sum, d) in product.iter_mut().zip(inner) {
            *sum += f64::from(w) * d;
        }
    }
    for value in &mut product {
        *value *= slope;
    }
    product
}

fn unit(length: usize, place: usize) -> Vec<f64> {
    let mut row = vec![0.0; length];
    row[place] = 1.0;
    row
}

fn check(spec: &ModelSpec, x: &[f64]) {
    assert_eq!(
        x.len(),
        spec.point_len(),
        "length of regressor and hidden state"
    );
}
