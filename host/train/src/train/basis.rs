//! The coordinates in which a predictor is learned, and the best linear predictor in them.
//!
//! A position and its last value are nearly equal, so raw regressors are badly conditioned and what
//! matters (velocity, acceleration) hides in their last digits. Learning happens in iterated
//! differences, each scaled to unit spread (docs/explanation/training.md, eq. T1); the result is
//! folded back into weights on the raw regressor, so the firmware never sees this basis.

use nalgebra::{DMatrix, DVector};

use super::windows::Shape;

/// z = (F x - mean) / spread, with x the flattened regressor in model units.
#[derive(Clone, Debug)]
pub struct Basis {
    /// F, `[n][n]`: iterated backward differences of past inputs and outputs.
    pub differences: DMatrix<f64>,
    /// Mean of F x over the training windows, `[n]`.
    pub mean: DVector<f64>,
    /// Standard deviation of F x over the training windows, `[n]`; 1 where a feature is constant.
    pub spread: DVector<f64>,
}

impl Basis {
    /// The basis of `shape`, scaled on the rows of `regressors` (`[samples][n]`).
    pub fn fit(shape: &Shape, regressors: &DMatrix<f64>) -> Self {
        let differences = iterated_differences(shape);
        let z = regressors * differences.transpose();
        let n = z.ncols();
        let (mut mean, mut spread) = (DVector::zeros(n), DVector::from_element(n, 1.0));
        for (j, column) in z.column_iter().enumerate() {
            mean[j] = column.mean();
            let deviation = column.variance().sqrt();
            if deviation > 1e-12 {
                spread[j] = deviation;
            }
        }
        Self {
            differences,
            mean,
            spread,
        }
    }

    /// The affine map of the basis as one matrix and one vector: z = A x + a.
    pub fn affine(&self) -> (DMatrix<f64>, DVector<f64>) {
        let mut a = self.differences.clone();
        let mut offset = -self.mean.clone();
        for (i, spread) in self.spread.iter().enumerate() {
            a.row_mut(i).unscale_mut(*spread);
            offset[i] /= spread;
        }
        (a, offset)
    }

    /// Features of every row of `regressors`.
    pub fn features(&self, regressors: &DMatrix<f64>) -> DMatrix<f64> {
        let (a, offset) = self.affine();
        let mut z = regressors * a.transpose();
        for mut row in z.row_iter_mut() {
            row += offset.transpose();
        }
        z
    }
}

/// F: per signal, the p-th row of its block is the p-th backward difference of its newest values.
fn iterated_differences(shape: &Shape) -> DMatrix<f64> {
    let n = shape.regressor_len();
    let mut f = DMatrix::zeros(n, n);
    let mut block = |start: usize, width: usize, lags: usize| {
        for signal in 0..width {
            for order in 0..lags {
                let mut binomial = 1.0;
                for lag in 0..=order {
                    f[(start + order * width + signal, start + lag * width + signal)] =
                        if lag % 2 == 0 { binomial } else { -binomial };
                    binomial *= (order - lag) as f64 / (lag + 1) as f64;
                }
            }
        }
    };
    block(0, shape.n_u, shape.past_inputs);
    block(shape.n_u * shape.past_inputs, shape.n_y, shape.past_outputs);
    block(n - shape.n_s, shape.n_s, 1);
    f
}

/// Ridge least squares t ~ W z + w with unit-spread features; returns (W `[n_t][n]`, w `[n_t]`).
///
/// The ridge is 1e-9 of the features' own energy: it decides only directions that the data leave
/// open.
pub fn least_squares(z: &DMatrix<f64>, t: &DMatrix<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let (rows, n) = z.shape();
    let augmented = z.clone().insert_column(n, 1.0);
    let mut gram = augmented.transpose() * &augmented;
    for i in 0..=n {
        gram[(i, i)] += 1e-9 * rows as f64;
    }
    let right = augmented.transpose() * t;
    // Positive definite by the ridge; a failure would mean non-finite data, which windows refuse.
    let solution = match gram.clone().cholesky() {
        Some(factor) => factor.solve(&right),
        None => DMatrix::zeros(n + 1, t.ncols()),
    };
    (solution.rows(0, n).transpose(), solution.row(n).transpose())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: Shape = Shape {
        n_u: 1,
        n_y: 2,
        past_inputs: 2,
        past_outputs: 3,
        n_s: 1,
    };

    #[test]
    fn differences_of_a_parabola_are_its_derivatives() {
        // y = k^2: newest 9, then 4, 1: first difference 5, second 2.
        let x = DVector::from_vec(vec![7.0, 6.0, 9.0, 0.0, 4.0, 0.0, 1.0, 0.0, 5.0]);
        let z = iterated_differences(&SHAPE) * x;
        assert_eq!(z.as_slice(), [7.0, 1.0, 9.0, 0.0, 5.0, 0.0, 2.0, 0.0, 5.0]);
    }

    #[test]
    fn least_squares_recovers_a_linear_map() {
        let z = DMatrix::from_fn(50, 3, |i, j| {
            ((i * (j + 2)) as f64 * 0.7).rem_euclid(3.1) - 1.5
        });
        let w = DMatrix::from_row_slice(2, 3, &[0.5, -1.0, 2.0, 0.1, 0.0, -0.3]);
        let t = DMatrix::from_fn(50, 2, |i, r| (w.row(r) * z.row(i).transpose())[0] + 0.25);
        let (found, bias) = least_squares(&z, &t);
        assert!((found - w).norm() < 1e-6);
        assert!((bias - DVector::from_element(2, 0.25)).norm() < 1e-6);
    }
}
