//! Small dense matrices in double precision. Only `+ - * /` and square roots in one fixed order, so
//! that the same model prints the same rows on every machine.

use std::ops::{Index, IndexMut};

/// Sweeps of the Jacobi method; ten are enough for any symmetric matrix of these sizes.
const SWEEPS: usize = 30;

/// A matrix, row after row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Matrix {
    pub rows: usize,
    pub columns: usize,
    values: Vec<f64>,
}

impl Index<(usize, usize)> for Matrix {
    type Output = f64;

    fn index(&self, (row, column): (usize, usize)) -> &f64 {
        &self.values[row * self.columns + column]
    }
}

impl IndexMut<(usize, usize)> for Matrix {
    fn index_mut(&mut self, (row, column): (usize, usize)) -> &mut f64 {
        &mut self.values[row * self.columns + column]
    }
}

impl Matrix {
    /// Elements by their place.
    pub fn from_fn(
        rows: usize,
        columns: usize,
        mut value: impl FnMut(usize, usize) -> f64,
    ) -> Self {
        let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        Self {
            rows,
            columns,
            values: places.map(|(row, column)| value(row, column)).collect(),
        }
    }

    /// All zero.
    pub fn zero(rows: usize, columns: usize) -> Self {
        Self::from_fn(rows, columns, |_, _| 0.0)
    }

    /// The unit matrix.
    pub fn unit(size: usize) -> Self {
        Self::from_fn(size, size, |row, column| f64::from(u8::from(row == column)))
    }

    /// One column.
    pub fn column(values: &[f64]) -> Self {
        Self::from_fn(values.len(), 1, |row, _| values[row])
    }

    /// A row.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.values[row * self.columns..][..self.columns]
    }

    /// Elements, row after row.
    #[cfg(test)]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The transpose.
    pub fn transpose(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |row, column| self[(column, row)])
    }

    /// `self other`.
    pub fn times(&self, other: &Self) -> Self {
        assert_eq!(self.columns, other.rows, "shapes of a product");
        let mut product = Self::zero(self.rows, other.columns);
        for row in 0..self.rows {
            for (inner, factor) in self.row(row).iter().enumerate() {
                if *factor == 0.0 {
                    continue;
                }
                for column in 0..other.columns {
                    product[(row, column)] += factor * other[(inner, column)];
                }
            }
        }
        product
    }

    /// `self + factor other`.
    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        assert_eq!(
            (self.rows, self.columns),
            (other.rows, other.columns),
            "shapes of a sum"
        );
        Self::from_fn(self.rows, self.columns, |row, column| {
            self[(row, column)] + factor * other[(row, column)]
        })
    }

    /// Rows and columns of a part.
    pub fn part(&self, rows: std::ops::Range<usize>, columns: std::ops::Range<usize>) -> Self {
        Self::from_fn(rows.len(), columns.len(), |row, column| {
            self[(rows.start + row, columns.start + column)]
        })
    }

    /// Writes a part, its first element at a place.
    pub fn enter(&mut self, row: usize, column: usize, part: &Self) {
        for r in 0..part.rows {
            for c in 0..part.columns {
                self[(row + r, column + c)] = part[(r, c)];
            }
        }
    }

    /// `self^-1 right` by elimination with row pivots; `None` where the matrix is singular.
    pub fn solve(&self, right: &Self) -> Option<Self> {
        assert_eq!((self.rows, self.rows), (self.columns, right.rows), "shapes");
        let (mut a, mut b) = (self.clone(), right.clone());
        let n = self.rows;
        for i in 0..n {
            let pivot = (i..n).max_by(|r, s| a[(*r, i)].abs().total_cmp(&a[(*s, i)].abs()))?;
            let size = a[(pivot, i)].abs();
            if size == 0.0 || !size.is_finite() {
                return None;
            }
            a.swap_rows(i, pivot);
            b.swap_rows(i, pivot);
            for row in 0..n {
                let factor = a[(row, i)] / a[(i, i)];
                if row == i || factor == 0.0 {
                    continue;
                }
                for column in i..n {
                    a[(row, column)] -= factor * a[(i, column)];
                }
                for column in 0..b.columns {
                    b[(row, column)] -= factor * b[(i, column)];
                }
            }
        }
        Some(Self::from_fn(n, b.columns, |row, column| {
            b[(row, column)] / a[(row, row)]
        }))
    }

    fn swap_rows(&mut self, one: usize, other: usize) {
        for column in 0..self.columns {
            let (one, other) = (one * self.columns + column, other * self.columns + column);
            self.values.swap(one, other);
        }
    }

    /// Eigenvalues of a symmetric matrix, the largest first, each with its vector as a column, by
    /// the cyclic Jacobi method. A vector's largest element is positive.
    pub fn eigen(&self) -> (Vec<f64>, Self) {
        let n = self.rows;
        let (mut a, mut vectors) = (self.clone(), Self::unit(n));
        for _ in 0..SWEEPS {
            for p in 0..n {
                for q in p + 1..n {
                    rotate(&mut a, &mut vectors, p, q);
                }
            }
        }
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|i, j| a[(*j, *j)].total_cmp(&a[(*i, *i)]));
        let values = order.iter().map(|i| a[(*i, *i)]).collect();
        let sign = |i: usize| {
            let largest = (0..n)
                .map(|row| vectors[(row, i)])
                .max_by(|x, y| x.abs().total_cmp(&y.abs()));
            largest.unwrap_or(1.0).signum()
        };
        let sorted = Self::from_fn(n, n, |row, column| {
            sign(order[column]) * vectors[(row, order[column])]
        });
        (values, sorted)
    }
}

/// One rotation of the Jacobi method: makes `a[p][q]` zero.
fn rotate(a: &mut Matrix, vectors: &mut Matrix, p: usize, q: usize) {
    let n = a.rows;
    if a[(p, q)] == 0.0 {
        return;
    }
    let theta = (a[(q, q)] - a[(p, p)]) / (2.0 * a[(p, q)]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for k in 0..n {
        let (kp, kq) = (a[(k, p)], a[(k, q)]);
        (a[(k, p)], a[(k, q)]) = (c * kp - s * kq, s * kp + c * kq);
    }
    for k in 0..n {
        let (pk, qk) = (a[(p, k)], a[(q, k)]);
        (a[(p, k)], a[(q, k)]) = (c * pk - s * qk, s * pk + c * qk);
    }
    for k in 0..n {
        let (kp, kq) = (vectors[(k, p)], vectors[(k, q)]);
        (vectors[(k, p)], vectors[(k, q)]) = (c * kp - s * kq, s * kp + c * kq);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same numbers in every run.
    fn drawn(rows: usize, columns: usize) -> Matrix {
        let mut bits = 12345_u64;
        Matrix::from_fn(rows, columns, |_, _| {
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (bits >> 40) as f64 / (1_u64 << 23) as f64 - 1.0
        })
    }

    fn distance(a: &Matrix, b: &Matrix) -> f64 {
        let difference = a.plus(-1.0, b);
        let most = difference.values().iter().map(|x| x.abs());
        most.fold(0.0, f64::max)
    }

    #[test]
    fn a_solution_solves_and_a_singular_matrix_has_none() {
        let (a, b) = (drawn(7, 7), drawn(7, 3));
        let x = a.solve(&b).expect("regular");
        assert!(distance(&a.times(&x), &b) < 1e-12);
        let mut singular = a;
        let first = singular.part(0..1, 0..7);
        singular.enter(1, 0, &first);
        assert!(
            singular
                .solve(&b)
                .is_none_or(|x| x.values().iter().any(|x| x.abs() > 1e9))
        );
        assert_eq!(Matrix::zero(2, 2).solve(&Matrix::zero(2, 1)), None);
    }

    #[test]
    fn eigenvectors_diagonalise_largest_first() {
        let half = drawn(6, 6);
        let a = half.times(&half.transpose());
        let (values, vectors) = a.eigen();
        assert!(values.is_sorted_by(|x, y| x >= y), "{values:?}");
        let diagonal = Matrix::from_fn(6, 6, |i, j| if i == j { values[i] } else { 0.0 });
        let again = vectors.times(&diagonal).times(&vectors.transpose());
        assert!(distance(&again, &a) < 1e-12, "{}", distance(&again, &a));
        let unit = vectors.transpose().times(&vectors);
        assert!(distance(&unit, &Matrix::unit(6)) < 1e-12);
    }
}
