//! The network in double precision, with exact derivatives: what emitted code is held against.
//!
//! Written for clarity, loop by loop, apart from the kernels that it judges. Derivatives come from
//! dual numbers, pushed forward; the kernels take them backward: two ways to one matrix.

mod real;
mod recurrent;
mod window;

pub use real::{Dual, Real};

use super::{Activation, Network, Node, Op};

/// Results of one call.
pub struct Call<T> {
    /// The output.
    pub y: Vec<T>,
    /// The state after it.
    pub state: Vec<T>,
}

/// One call, generic over the number.
///
/// # Panics
/// If `x` or `state` has not the network's length; the network is to be validated first.
#[must_use]
pub fn call<T: Real>(network: &Network, x: &[T], state: &[T]) -> Call<T> {
    call_through(network, x, state, &mut |_, _| {})
}

/// As [`call`], the place and the values of every layer passed to `each` before others read them.
fn call_through<T: Real>(
    network: &Network,
    x: &[T],
    state: &[T],
    each: &mut impl FnMut(usize, &mut [T]),
) -> Call<T> {
    assert_eq!(x.len(), network.inputs(), "length of the input");
    assert_eq!(state.len(), network.state(), "length of the state");
    let mut values: Vec<Vec<T>> = Vec::new();
    let (mut before, mut after) = (state, Vec::new());
    for (place, node) in network.nodes.iter().enumerate() {
        let (own, rest) = before.split_at(node.op.state());
        before = rest;
        let mut value = match &node.op {
            Op::Input => x.to_vec(),
            Op::Recurrent(layer) => {
                let (value, state) = recurrent::run(layer, &values[node.from[0]], own);
                if layer.streaming {
                    after.extend(state);
                }
                value
            }
            _ => stateless(network, node, &values),
        };
        each(place, &mut value);
        values.push(value);
    }
    Call {
        y: values.pop().unwrap_or_default(),
        state: after,
    }
}

fn stateless<T: Real>(network: &Network, node: &Node, values: &[Vec<T>]) -> Vec<T> {
    let x = &values[node.from[0]];
    let shape = &network.nodes[node.from[0]].shape;
    match &node.op {
        Op::Dense(dense) => (dense.weights.chunks(x.len()).zip(&dense.bias))
            .map(|(row, &bias)| dot(row, x) + T::of(f64::from(bias)))
            .collect(),
        Op::Convolution(layer) => window::convolve(layer, shape, &node.shape, x),
        Op::Pool(layer) => window::pool(layer, shape, &node.shape, x),
        Op::Reshape(_) => x.clone(),
        Op::Permute(axes) => permute(axes, shape, x),
        Op::Scale { gain, offset } => (x.iter().zip(gain.iter().zip(offset).cycle()))
            .map(|(x, (&gain, &offset))| {
                x.clone() * T::of(f64::from(gain)) + T::of(f64::from(offset))
            })
            .collect(),
        Op::Activation(g) => x.iter().map(|z| apply(*g, z.clone())).collect(),
        Op::Softmax => {
            let last = node.shape.last().copied().unwrap_or(1);
            x.chunks(last).flat_map(softmax).collect()
        }
        Op::LogSoftmax => {
            let last = node.shape.last().copied().unwrap_or(1);
            x.chunks(last).flat_map(log_softmax).collect()
        }
        Op::Maximum | Op::Minimum => {
            let largest = node.op == Op::Maximum;
            let pairs = x.iter().zip(&values[node.from[1]]);
            pairs.map(|(a, b)| extreme(largest, a, b)).collect()
        }
        Op::Add => node.from[1..].iter().fold(x.clone(), |sum, &other| {
            sum.into_iter()
                .zip(&values[other])
                .map(|(a, b)| a + b.clone())
                .collect()
        }),
        Op::Multiply => x
            .iter()
            .zip(&values[node.from[1]])
            .map(|(a, b)| a.clone() * b.clone())
            .collect(),
        Op::Select(selection) => {
            let value = |place: &Option<usize>| place.map_or(T::of(0.0), |place| x[place].clone());
            selection.places.iter().map(value).collect()
        }
        Op::Normalise { epsilon } => {
            let last = node.shape.last().copied().unwrap_or(1);
            x.chunks(last)
                .flat_map(|x| normalise(x, f64::from(*epsilon)))
                .collect()
        }
        Op::Concatenate(axis) => concatenate(network, node, *axis, values),
        Op::Input | Op::Recurrent(_) => Vec::new(),
    }
}

/// The output after calls with each input in turn, from rest.
///
/// ```
/// use sinew_nn::{evaluate, import};
///
/// let network = import::read("examples/mlp.onnx".as_ref())?;
/// assert_eq!(evaluate::run(&network, &[0.1; 12]).len(), 3);
/// # Ok::<(), sinew_nn::NetworkError>(())
/// ```
///
/// # Panics
/// As [`call`].
#[must_use]
pub fn run(network: &Network, x: &[f64]) -> Vec<f64> {
    run_through(network, x, &mut |_, _| {})
}

/// As [`run`], the place and the values of every layer passed to `each` before others read them.
pub(crate) fn run_through(
    network: &Network,
    x: &[f64],
    each: &mut impl FnMut(usize, &mut [f64]),
) -> Vec<f64> {
    let mut last = Call {
        y: Vec::new(),
        state: vec![0.0; network.state()],
    };
    for x in x.chunks(network.inputs()) {
        last = call_through(network, x, &last.state, each);
    }
    last.y
}

/// Derivatives of outputs and new state (rows, in this order) with respect to inputs and state
/// before (columns, in this order).
///
/// ```
/// use sinew_nn::{evaluate, import};
///
/// let network = import::read("examples/mlp.onnx".as_ref())?;
/// let rows = evaluate::jacobian(&network, &[0.1; 12], &[]);
///
/// // The first column is the derivative with respect to the first input.
/// let (mut x, h) = ([0.1; 12], 1e-6);
/// let before = evaluate::run(&network, &x);
/// x[0] += h;
/// let slope = (evaluate::run(&network, &x)[0] - before[0]) / h;
/// assert!((rows[0][0] - slope).abs() < 1e-5);
/// # Ok::<(), sinew_nn::NetworkError>(())
/// ```
///
/// # Panics
/// As [`call`].
#[must_use]
pub fn jacobian(network: &Network, x: &[f64], state: &[f64]) -> Vec<Vec<f64>> {
    let mut rows = vec![Vec::new(); network.outputs() + network.state()];
    for column in 0..x.len() + state.len() {
        let seed = |(i, &v): (usize, &f64)| Dual::new(v, f64::from(u8::from(i == column)));
        let all: Vec<Dual<f64>> = x.iter().chain(state).enumerate().map(seed).collect();
        let (x, state) = all.split_at(x.len());
        let call = call(network, x, state);
        for (row, value) in rows.iter_mut().zip(call.y.iter().chain(&call.state)) {
            row.push(value.tangent);
        }
    }
    rows
}

/// The second derivatives of `sum_r weights[r] result_r`, with the results and columns of
/// [`jacobian`].
///
/// # Panics
/// As [`call`].
#[must_use]
pub fn curvature(network: &Network, x: &[f64], state: &[f64], weights: &[f64]) -> Vec<Vec<f64>> {
    let all: Vec<f64> = x.iter().chain(state).copied().collect();
    let unit = |i, j| f64::from(u8::from(i == j));
    (0..all.len())
        .map(|i| {
            (0..all.len())
                .map(|j| {
                    let seed = |(k, &v): (usize, &f64)| {
                        Dual::new(Dual::new(v, unit(i, k)), Dual::new(unit(j, k), 0.0))
                    };
                    let all: Vec<_> = all.iter().enumerate().map(seed).collect();
                    let (x, state) = all.split_at(x.len());
                    let call = call(network, x, state);
                    let results = call.y.iter().chain(&call.state);
                    results
                        .zip(weights)
                        .map(|(r, w)| w * r.tangent.tangent)
                        .sum()
                })
                .collect()
        })
        .collect()
}

fn dot<T: Real>(weights: &[f32], x: &[T]) -> T {
    let products = weights
        .iter()
        .zip(x)
        .map(|(&w, x)| x.clone() * T::of(f64::from(w)));
    products.fold(T::of(0.0), |sum, product| sum + product)
}

fn apply<T: Real>(g: Activation, z: T) -> T {
    let one = || T::of(1.0);
    let narrow = |x: f32| T::of(f64::from(x));
    let positive = z.number() > 0.0;
    match g {
        Activation::Linear => z,
        Activation::Relu if positive => z,
        Activation::Relu => z * T::of(0.0),
        Activation::LeakyRelu { .. } if positive => z,
        Activation::LeakyRelu { alpha } => z * narrow(alpha),
        Activation::Elu { scale, .. } if positive => z * narrow(scale),
        Activation::Elu { alpha, scale } => (z.exp() - one()) * narrow(alpha) * narrow(scale),
        Activation::Gelu => {
            let normal = (z.clone() * T::of(0.5_f64.sqrt())).erf() + one();
            z * normal * T::of(0.5)
        }
        Activation::GeluTanh => {
            let cube = z.clone() * z.clone() * z.clone() * T::of(0.044_715);
            let bend = ((z.clone() + cube) * T::of((2.0 / std::f64::consts::PI).sqrt())).tanh();
            z * (bend + one()) * T::of(0.5)
        }
        Activation::Softplus if positive => z.clone() + ((T::of(0.0) - z).exp() + one()).ln(),
        Activation::Softplus => (z.exp() + one()).ln(),
        Activation::Softsign if positive => z.clone() / (one() + z),
        Activation::Softsign => z.clone() / (one() - z),
        Activation::Swish => z.clone() * sigmoid(z),
        Activation::HardSigmoid { alpha, beta } => {
            let y = z * narrow(alpha) + narrow(beta);
            if y.number() <= 0.0 {
                T::of(0.0)
            } else if y.number() >= 1.0 {
                one()
            } else {
                y
            }
        }
        Activation::Clip { high, .. } if z.number() >= f64::from(high) => narrow(high),
        Activation::Clip { low, .. } if z.number() <= f64::from(low) => narrow(low),
        Activation::Clip { .. } => z,
        Activation::Sigmoid => sigmoid(z),
        Activation::Tanh => z.tanh(),
        Activation::Exponential => z.exp(),
        Activation::Logarithm => z.ln(),
        Activation::Root => z.sqrt(),
        Activation::Reciprocal => one() / z,
    }
}

fn sigmoid<T: Real>(z: T) -> T {
    T::of(1.0) / (T::of(1.0) + (T::of(0.0) - z).exp())
}

fn softmax<T: Real>(z: &[T]) -> Vec<T> {
    let largest = z.iter().map(Real::number).fold(f64::NEG_INFINITY, f64::max);
    let e: Vec<T> = z
        .iter()
        .map(|z| (z.clone() - T::of(largest)).exp())
        .collect();
    let sum = e.iter().cloned().fold(T::of(0.0), |sum, e| sum + e);
    e.into_iter().map(|e| e / sum.clone()).collect()
}

fn log_softmax<T: Real>(z: &[T]) -> Vec<T> {
    let largest = z.iter().map(Real::number).fold(f64::NEG_INFINITY, f64::max);
    let below: Vec<T> = z.iter().map(|z| z.clone() - T::of(largest)).collect();
    let sum = below.iter().fold(T::of(0.0), |sum, z| sum + z.exp()).ln();
    below.into_iter().map(|z| z - sum.clone()).collect()
}

/// The larger or smaller of two numbers, the first where they are equal; NaN where either is.
fn extreme<T: Real>(largest: bool, a: &T, b: &T) -> T {
    let (first, second) = (a.number(), b.number());
    let beyond = if largest {
        second > first
    } else {
        second < first
    };
    if beyond || second.is_nan() { b } else { a }.clone()
}

fn normalise<T: Real>(x: &[T], epsilon: f64) -> Vec<T> {
    let mean = |values: Vec<T>| {
        let count = T::of(values.len() as f64);
        values.into_iter().fold(T::of(0.0), |sum, x| sum + x) / count
    };
    let centre = mean(x.to_vec());
    let centred: Vec<T> = x.iter().map(|x| x.clone() - centre.clone()).collect();
    let variance = mean(centred.iter().map(|x| x.clone() * x.clone()).collect());
    let deviation = (variance + T::of(epsilon)).sqrt();
    (centred.into_iter().map(|x| x / deviation.clone())).collect()
}

fn permute<T: Real>(axes: &[usize], shape: &[usize], x: &[T]) -> Vec<T> {
    let strides: Vec<usize> = (0..shape.len())
        .map(|i| shape[i + 1..].iter().product())
        .collect();
    let mut places = vec![0];
    for &axis in axes {
        places = places
            .iter()
            .flat_map(|&place| (0..shape[axis]).map(move |i| (place, i)))
            .map(|(place, i)| place + i * strides[axis])
            .collect();
    }
    places.into_iter().map(|place| x[place].clone()).collect()
}

fn concatenate<T: Real>(network: &Network, node: &Node, axis: usize, values: &[Vec<T>]) -> Vec<T> {
    let runs: usize = node.shape[..axis].iter().product();
    let mut y = Vec::new();
    for run in 0..runs {
        for &from in &node.from {
            let part: usize = network.nodes[from].shape[axis..].iter().product();
            y.extend_from_slice(&values[from][run * part..][..part]);
        }
    }
    y
}
