//! Eigenvalues of a symmetric matrix by Jacobi's rotations (Golub and Van Loan 2013, section 8.5).

use crate::math::sqrt;

/// Sweeps after which rounding is all that is left.
const MOST_SWEEPS: usize = 40;

/// Symmetric matrix in scaled coordinates, `D^-1/2 A D^-1/2` with the row sums of `|A|` as `D`, by
/// its eigenvalues. They lie in [-1, 1], whatever the units of the rows.
pub(super) struct Decomposition {
    n: usize,
    /// Eigenvalues of the scaled matrix, in no order.
    pub(super) values: Vec<f64>,
    /// Eigenvector `k` of the scaled matrix is column `k`, row by row.
    vectors: Vec<f64>,
    /// Square roots of `D`; 1 for a row of zeros.
    scale: Vec<f64>,
}

impl Decomposition {
    /// `matrix` is n by n, row by row.
    pub(super) fn of(matrix: &[f64], n: usize) -> Self {
        let scale: Vec<f64> = (0..n)
            .map(|row| {
                let sum: f64 = (0..n).map(|column| matrix[row * n + column].abs()).sum();
                if sum > 0.0 { sqrt(sum) } else { 1.0 }
            })
            .collect();
        let mut scaled = matrix.to_vec();
        for row in 0..n {
            for column in 0..n {
                scaled[row * n + column] /= scale[row] * scale[column];
            }
        }
        let vectors = diagonalise(&mut scaled, n);
        Self {
            n,
            values: (0..n).map(|k| scaled[k * n + k]).collect(),
            vectors,
            scale,
        }
    }

    /// Component of a force along eigenvector `k`, in scaled coordinates.
    pub(super) fn component(&self, k: usize, force: &[f64]) -> f64 {
        (0..self.n)
            .map(|row| self.vectors[row * self.n + k] * force[row] / self.scale[row])
            .sum()
    }

    /// Eigenvector `k` as a displacement.
    pub(super) fn direction(&self, k: usize) -> Vec<f64> {
        (0..self.n)
            .map(|row| self.vectors[row * self.n + k] / self.scale[row])
            .collect()
    }

    /// `sum_k share(eigenvalue k) v_k v_k' force`, back in plain coordinates.
    pub(super) fn apply(&self, force: &[f64], share: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut moved = vec![0.0; self.n];
        for (k, &value) in self.values.iter().enumerate() {
            let along = share(value) * self.component(k, force);
            for (moved, part) in moved.iter_mut().zip(self.direction(k)) {
                *moved += along * part;
            }
        }
        moved
    }

    /// Inverse of the matrix, row by row.
    pub(super) fn inverse(&self) -> Vec<f64> {
        let n = self.n;
        let mut inverse = vec![0.0; n * n];
        for (k, value) in self.values.iter().enumerate() {
            let direction = self.direction(k);
            for row in 0..n {
                for column in 0..n {
                    inverse[row * n + column] += direction[row] * direction[column] / value;
                }
            }
        }
        inverse
    }

    /// Matrix `B` in the coordinates in which this one, which is positive, is the identity: its
    /// least eigenvalue is the `mu` of `mu A <= B`.
    pub(super) fn least_beside(&self, other: &[f64]) -> f64 {
        let n = self.n;
        let whitened: Vec<Vec<f64>> = (0..n)
            .map(|k| {
                let size = sqrt(self.values[k]);
                self.direction(k).iter().map(|part| part / size).collect()
            })
            .collect();
        let mut product = vec![0.0; n * n];
        for (a, left) in whitened.iter().enumerate() {
            for (b, right) in whitened.iter().enumerate() {
                for row in 0..n {
                    for column in 0..n {
                        product[a * n + b] += left[row] * other[row * n + column] * right[column];
                    }
                }
            }
        }
        diagonalise(&mut product, n);
        (0..n)
            .map(|k| product[k * n + k])
            .fold(f64::INFINITY, f64::min)
    }
}

/// Rotates a symmetric matrix until it is diagonal; the eigenvectors are the columns returned.
fn diagonalise(a: &mut [f64], n: usize) -> Vec<f64> {
    let mut vectors = vec![0.0; n * n];
    for k in 0..n {
        vectors[k * n + k] = 1.0;
    }
    for _ in 0..MOST_SWEEPS {
        let mut rotated = false;
        for p in 0..n {
            for q in p + 1..n {
                let (off, pp, qq) = (a[p * n + q], a[p * n + p], a[q * n + q]);
                if off == 0.0 || off.abs() < 1e-18 * sqrt((pp * qq).abs()) {
                    continue;
                }
                rotated = true;
                // Tangent of the smaller of the two angles that cancel the pair.
                let theta = 0.5 * (qq - pp) / off;
                let root = theta.abs() + sqrt(theta * theta + 1.0);
                let tangent = if theta < 0.0 { -1.0 } else { 1.0 } / root;
                let cos = 1.0 / sqrt(tangent * tangent + 1.0);
                let sin = tangent * cos;
                for k in 0..n {
                    let (kp, kq) = (a[k * n + p], a[k * n + q]);
                    a[k * n + p] = cos * kp - sin * kq;
                    a[k * n + q] = sin * kp + cos * kq;
                }
                for k in 0..n {
                    let (pk, qk) = (a[p * n + k], a[q * n + k]);
                    a[p * n + k] = cos * pk - sin * qk;
                    a[q * n + k] = sin * pk + cos * qk;
                }
                a[p * n + q] = 0.0;
                a[q * n + p] = 0.0;
                for row in vectors.chunks_exact_mut(n) {
                    let (vp, vq) = (row[p], row[q]);
                    row[p] = cos * vp - sin * vq;
                    row[q] = sin * vp + cos * vq;
                }
            }
        }
        if !rotated {
            break;
        }
    }
    vectors
}

#[cfg(test)]
mod tests {
    use super::Decomposition;

    #[test]
    fn an_inverse_times_its_matrix_is_the_identity_whatever_the_units() {
        let matrix = [4e6, 1e3, 0.0, 1e3, 3.0, 1e-4, 0.0, 1e-4, 2e-6];
        let inverse = Decomposition::of(&matrix, 3).inverse();
        for row in 0..3 {
            for column in 0..3 {
                let product: f64 = (0..3)
                    .map(|k| matrix[row * 3 + k] * inverse[k * 3 + column])
                    .sum();
                let one = f64::from(u8::from(row == column));
                // Rounding in units of the entries.
                let unit = (matrix[row * 4] / matrix[column * 4]).sqrt();
                assert!((product - one).abs() < 1e-12 * unit.max(1.0), "{product}");
            }
        }
    }

    #[test]
    fn a_free_pair_has_one_flat_direction_and_a_push_apart_a_negative_one() {
        let found = Decomposition::of(&[2.0, -2.0, -2.0, 2.0], 2);
        let least = found.values.iter().copied().fold(1.0, f64::min);
        assert!(least.abs() < 1e-15);
        let found = Decomposition::of(&[1.0, 2.0, 2.0, 1.0], 2);
        assert!(
            found
                .values
                .iter()
                .any(|&value| (value + 1.0 / 3.0).abs() < 1e-15)
        );
    }
}
