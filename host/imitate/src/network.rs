//! A small tanh network with a linear path, and its gradient
//! (docs/explanation/imitation.md, eq. 3).

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// A network: tanh layers, a linear layer, and a linear path from the features to the outputs
/// (eq. 3). All weights stand in one row, so that an optimiser moves a vector.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    /// Width of each layer, features first, outputs last.
    pub sizes: Vec<usize>,
    /// Of each layer its matrix, row by row, then its biases; then the matrix of the linear path.
    pub weights: Vec<f64>,
}

impl Network {
    /// Weights of a network of these sizes, the linear path among them.
    pub fn count(sizes: &[usize]) -> usize {
        let layers = sizes.windows(2).map(|pair| (pair[0] + 1) * pair[1]);
        layers.sum::<usize>() + sizes[0] * sizes[sizes.len() - 1]
    }

    /// A network whose outputs are zero; hidden weights are drawn (Glorot and Bengio 2010).
    pub fn new(sizes: &[usize], random: &mut ChaCha8Rng) -> Self {
        let mut weights = vec![0.0; Self::count(sizes)];
        let mut first = 0;
        for pair in sizes.windows(2).take(sizes.len() - 2) {
            let reach = (6.0 / (pair[0] + pair[1]) as f64).sqrt();
            for weight in &mut weights[first..first + pair[0] * pair[1]] {
                *weight = random.random_range(-reach..reach);
            }
            first += (pair[0] + 1) * pair[1];
        }
        Self {
            sizes: sizes.to_vec(),
            weights,
        }
    }

    /// Place of the linear path's matrix, row by row, among the weights.
    pub fn linear_path(&self) -> usize {
        self.weights.len() - self.sizes[0] * self.sizes[self.sizes.len() - 1]
    }

    /// Outputs for features `z`. `kept` gets the features and the values of each hidden layer,
    /// which [`Network::backward`] needs.
    pub(crate) fn forward(&self, z: &[f64], kept: &mut Vec<f64>, out: &mut [f64]) {
        kept.clear();
        kept.extend_from_slice(z);
        let (mut from, mut first) = (0, 0);
        let last = self.sizes.len() - 2;
        for (layer, pair) in self.sizes.windows(2).enumerate() {
            let (n, m) = (pair[0], pair[1]);
            let biases = first + n * m;
            let rows = self.weights[first..biases].chunks(n);
            for (row, (weights, bias)) in rows.zip(&self.weights[biases..]).enumerate() {
                let sum = dot(weights, &kept[from..from + n]) + bias;
                if layer == last {
                    out[row] = sum;
                } else {
                    kept.push(sum.tanh());
                }
            }
            from += n;
            first = biases + m;
        }
        let n = self.sizes[0];
        for (row, out) in out.iter_mut().enumerate() {
            *out += dot(&self.weights[first + row * n..first + (row + 1) * n], z);
        }
    }

    /// Adds the gradient by the weights to `gradient` and the one by the features to `by_z`, for
    /// the gradient `by_out` of the outputs of the [`Network::forward`] that filled `kept`.
    pub(crate) fn backward(
        &self,
        kept: &[f64],
        by_out: &[f64],
        gradient: &mut [f64],
        by_z: &mut [f64],
    ) {
        let n = self.sizes[0];
        let path = self.linear_path();
        for (row, by) in by_out.iter().enumerate() {
            let first = path + row * n;
            for i in 0..n {
                gradient[first + i] += by * kept[i];
                by_z[i] += by * self.weights[first + i];
            }
        }
        let mut by = by_out.to_vec();
        let (mut end, mut from) = (path, kept.len());
        for pair in self.sizes.windows(2).rev() {
            let (n, m) = (pair[0], pair[1]);
            let first = end - (n + 1) * m;
            from -= n;
            let values = &kept[from..from + n];
            let mut below = vec![0.0; n];
            for row in 0..m {
                gradient[first + n * m + row] += by[row];
                let at = first + row * n;
                for i in 0..n {
                    gradient[at + i] += by[row] * values[i];
                    below[i] += by[row] * self.weights[at + i];
                }
            }
            if from > 0 {
                for (below, value) in below.iter_mut().zip(values) {
                    *below *= 1.0 - value * value;
                }
            } else {
                for (by_z, below) in by_z.iter_mut().zip(&below) {
                    *by_z += below;
                }
            }
            (by, end) = (below, first);
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
