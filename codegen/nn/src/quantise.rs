//! Weights as integers of eight bits: a row of a matrix, all that makes one output, has a scale of
//! its own, and weight `w` is the integer nearest to `w / scale`, where `scale` is the row's
//! largest weight over 127. Biases stay floating point, and so does the arithmetic.

use super::{Golden, Network, Op, evaluate};

/// Largest integer of a row.
const LARGEST: f32 = 127.0;

/// Inputs drawn where a network brings no golden vectors, and calls of each where it remembers.
const DRAWN: usize = 64;
const CALLS: usize = 8;

/// A row as integers and their scale.
#[must_use]
pub fn row(weights: &[f32]) -> (Vec<i8>, f32) {
    let largest = weights.iter().fold(0.0_f32, |m, w| m.max(w.abs()));
    let scale = largest / LARGEST;
    let integer = |w: &f32| {
        if scale > 0.0 {
            (w / scale).round().clamp(-LARGEST, LARGEST) as i8
        } else {
            0
        }
    };
    (weights.iter().map(integer).collect(), scale)
}

/// The matrices of a layer, each with the length of its rows.
fn matrices(op: &mut Op) -> Vec<(&mut Vec<f32>, usize)> {
    match op {
        Op::Dense(layer) => {
            let length = layer.weights.len() / layer.bias.len();
            vec![(&mut layer.weights, length)]
        }
        Op::Convolution(layer) => {
            let length = layer.weights.len() / layer.bias.len();
            vec![(&mut layer.weights, length)]
        }
        Op::Recurrent(layer) => {
            let (inputs, units) = (layer.inputs(), layer.units);
            vec![(&mut layer.kernel, inputs), (&mut layer.recurrent, units)]
        }
        _ => Vec::new(),
    }
}

impl Network {
    /// The network with its weights rounded to int8; its golden vectors are recomputed.
    ///
    /// ```
    /// use sinew_nn::{evaluate, import};
    ///
    /// let network = import::read("examples/mlp.onnx".as_ref())?;
    /// let x = [0.1; 12];
    /// let exact = evaluate::run(&network, &x);
    /// let rounded = evaluate::run(&network.quantised(), &x);
    /// assert!(exact.iter().zip(&rounded).all(|(a, b)| (a - b).abs() < 0.02));
    /// # Ok::<(), sinew_nn::NetworkError>(())
    /// ```
    #[must_use]
    pub fn quantised(&self) -> Self {
        let mut network = self.clone();
        for node in &mut network.nodes {
            for (values, length) in matrices(&mut node.op) {
                for values in values.chunks_mut(length) {
                    let (integers, scale) = row(values);
                    for (value, integer) in values.iter_mut().zip(integers) {
                        *value = f32::from(integer) * scale;
                    }
                }
            }
        }
        let golden = self.golden.iter().map(|golden| Golden {
            x: golden.x.clone(),
            y: evaluate::run(&network, &wide(&golden.x)),
        });
        network.golden = golden.collect();
        network
    }

    /// Bytes of its weights: four each, or one, and four for each row.
    #[must_use]
    pub fn weight_bytes(&self, int8: bool) -> usize {
        let nodes = self.nodes.iter();
        nodes.map(|node| weight_bytes(&node.op, int8)).sum()
    }
}

/// Bytes of a layer's weights: as [`Network::weight_bytes`].
pub(crate) fn weight_bytes(op: &Op, int8: bool) -> usize {
    let all = 4 * op.parameters();
    if !int8 {
        return all;
    }
    let mut op = op.clone();
    let matrices = matrices(&mut op).into_iter();
    let saved = matrices.map(|(values, length)| 3 * values.len() - 4 * (values.len() / length));
    all - saved.sum::<usize>()
}

fn wide(x: &[f32]) -> Vec<f64> {
    x.iter().copied().map(f64::from).collect()
}

/// Loss of accuracy by integer weights.
///
/// ```
/// use sinew_nn::quantise::{Loss, loss};
/// use sinew_nn::{Dense, Network, Op};
///
/// let mut network = Network::new("halves", "x", vec![1]);
/// let dense = Dense { weights: vec![1.0, 0.5], bias: vec![0.0, 0.0] };
/// network.push("dense", Op::Dense(dense), vec![0])?;
/// let Loss { largest, drawn, .. } = loss(&network);
/// assert!(drawn, "the network brings no golden vectors");
/// assert!(largest < 1e-6, "a row of one weight is exact but for the rounding of its scale");
/// # Ok::<(), sinew_nn::NetworkError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loss {
    /// Largest difference of an output, relative to the range of all outputs.
    pub largest: f64,
    /// Root mean square of the differences, relative to the same.
    pub rms: f64,
    /// Vectors compared.
    pub vectors: usize,
    /// True if the inputs were drawn, between -1 and 1, because the network brings none.
    pub drawn: bool,
}

impl std::fmt::Display for Loss {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let inputs = if self.drawn {
            "drawn inputs between -1 and 1: the network brings no vectors of its own"
        } else {
            "golden vectors"
        };
        write!(
            f,
            "int8 weights: outputs move by up to {:.3} % of their range, {:.3} % RMS ({} {inputs})",
            100.0 * self.largest,
            100.0 * self.rms,
            self.vectors
        )
    }
}

/// Compares a valid network with what [`Network::quantised`] makes of it, in double precision.
#[must_use]
pub fn loss(network: &Network) -> Loss {
    let folded = network.folded();
    let quantised = folded.quantised();
    let drawn = network.golden.is_empty();
    let inputs: Vec<Vec<f64>> = if drawn {
        let calls = if network.state() > 0 { CALLS } else { 1 };
        let mut bits = 0x9e37_79b9_u32;
        let mut draw = || {
            bits = bits.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            f64::from(bits >> 8) / f64::from(1_u32 << 23) - 1.0
        };
        (0..DRAWN)
            .map(|_| (0..calls * network.inputs()).map(|_| draw()).collect())
            .collect()
    } else {
        network.golden.iter().map(|g| wide(&g.x)).collect()
    };
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut largest, mut squares, mut count) = (0.0_f64, 0.0, 0);
    for x in &inputs {
        let (exact, found) = (evaluate::run(&folded, x), evaluate::run(&quantised, x));
        for (exact, found) in exact.iter().zip(found) {
            (low, high) = (low.min(*exact), high.max(*exact));
            let error = (found - exact).abs();
            (largest, squares, count) = (largest.max(error), squares + error * error, count + 1);
        }
    }
    let range = (high - low).max(f64::MIN_POSITIVE);
    Loss {
        largest: largest / range,
        rms: (squares / f64::from(count.max(1))).sqrt() / range,
        vectors: inputs.len(),
        drawn,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_of_integers_is_within_half_a_step_and_keeps_its_largest() {
        let weights = [0.3, -1.27, 0.004, 0.0, 1.1];
        let (integers, scale) = row(&weights);
        assert_eq!(integers[1], -127);
        for (w, q) in weights.iter().zip(integers) {
            assert!((w - f32::from(q) * scale).abs() <= 0.5001 * scale, "{w}");
        }
        assert_eq!(row(&[0.0, 0.0]), (vec![0, 0], 0.0));
    }
}
