//! Covariance as factors P = U D U' (docs/explanation/controller.md, eq. 16 and 17).
//!
//! U is upper triangular with ones on its diagonal, D is diagonal. P is symmetric and its variances
//! are not negative whatever the rounding, and no square root is taken (Bierman, "Factorization
//! Methods for Discrete Sequential Estimation", Academic Press, 1977, chapters V to VII).
#![allow(
    clippy::needless_range_loop,
    reason = "one index runs through several arrays and their neighbours, as in the equations"
)]

/// Factors of an `N` by `N` covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covariance<const N: usize> {
    /// U above the diagonal; what stands on it and below is not read.
    u: [[f32; N]; N],
    /// Diagonal of D.
    d: [f32; N],
}

/// A measurement's row h seen through the factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection<const N: usize> {
    /// `U' h`.
    f: [f32; N],
    /// Variance of the innovation, `h P h' + r`.
    pub variance: f32,
}

/// Result of a measurement update.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain<const N: usize> {
    /// Kalman gain: correction of the estimate for an innovation of 1.
    pub gain: [f32; N],
    /// Variance that the measurement took from each element.
    pub reduction: [f32; N],
}

impl<const N: usize> Covariance<N> {
    /// Independent elements with these variances.
    pub const fn diagonal(variances: [f32; N]) -> Self {
        Self {
            u: [[0.0; N]; N],
            d: variances,
        }
    }

    /// Element `(row, column)` of P; 0 outside.
    pub fn element(&self, row: usize, column: usize) -> f32 {
        let (first, last) = if row < column {
            (row, column)
        } else {
            (column, row)
        };
        let mut sum = 0.0;
        for j in 0..N {
            if j >= last {
                sum += self.factor(first, j) * self.d[j] * self.factor(last, j);
            }
        }
        sum
    }

    /// Variance of an element; 0 outside.
    pub fn variance(&self, i: usize) -> f32 {
        self.element(i, i)
    }

    /// Element of U.
    fn factor(&self, row: usize, column: usize) -> f32 {
        if row == column {
            1.0
        } else {
            self.u
                .get(row)
                .and_then(|row| row.get(column))
                .copied()
                .unwrap_or(0.0)
        }
    }

    /// Every factor is a number and no variance is negative.
    pub fn is_valid(&self) -> bool {
        let mut valid = true;
        for j in 0..N {
            valid &= (0.0..f32::INFINITY).contains(&self.d[j]);
            for i in 0..j {
                valid &= self.u[i][j].is_finite();
            }
        }
        valid
    }

    /// Time update (eq. 16): the first `NX` elements become `F z` plus white noise of the given
    /// variances, the others stay as they are.
    ///
    /// Only the block of the first `NX` needs an orthogonalisation, by weighted Gram-Schmidt
    /// (Thornton); the columns of constant elements stay triangular. Cost: `NX N^2 / 2 + 2 NX^3`
    /// multiply-adds.
    pub fn propagate<const NX: usize>(&mut self, f: &[[f32; N]; NX], noise: &[f32; NX]) {
        const { assert!(NX <= N, "the states are the first elements") };
        // F U, all columns.
        let mut product = [[0.0; N]; NX];
        for (product, f) in product.iter_mut().zip(f) {
            for column in 0..N {
                let mut sum = f[column];
                for l in 0..column {
                    sum += f[l] * self.u[l][column];
                }
                product[column] = sum;
            }
        }
        for (row, product) in self.u.iter_mut().zip(&product) {
            for (place, value) in row.iter_mut().zip(product).skip(NX) {
                *place = *value;
            }
        }
        // [F U, I] with weights [D, noise], row after row from the last.
        let mut added = [[0.0; NX]; NX];
        for i in 0..NX {
            added[i][i] = 1.0;
        }
        let old: [f32; NX] = core::array::from_fn(|i| self.d[i]);
        for j in (0..NX).rev() {
            let mut weighted = [0.0; NX];
            let mut weighted_added = [0.0; NX];
            let mut norm = 0.0;
            for k in 0..NX {
                weighted[k] = old[k] * product[j][k];
                weighted_added[k] = noise[k] * added[j][k];
                norm += weighted[k] * product[j][k] + weighted_added[k] * added[j][k];
            }
            self.d[j] = norm;
            // A row of no length has no part in the others.
            let inverse = if norm > 0.0 { 1.0 / norm } else { 0.0 };
            for i in 0..j {
                let mut sum = 0.0;
                for k in 0..NX {
                    sum += product[i][k] * weighted[k] + added[i][k] * weighted_added[k];
                }
                let share = sum * inverse;
                self.u[i][j] = share;
                for k in 0..NX {
                    product[i][k] -= share * product[j][k];
                    added[i][k] -= share * added[j][k];
                }
            }
        }
    }

    /// Adds noise of a variance to one element, which costs `i^2` multiply-adds (Agee and Turner's
    /// update of rank one).
    pub fn add_noise(&mut self, i: usize, variance: f32) {
        if !(variance > 0.0) {
            return;
        }
        let mut a = [0.0; N];
        let Some(place) = a.get_mut(i) else { return };
        *place = 1.0;
        let mut weight = variance;
        for j in (0..N).rev() {
            let old = self.d[j];
            let scaled = weight * a[j];
            let sum = old + scaled * a[j];
            self.d[j] = sum;
            // Before element i nothing has a part in the noise.
            if !(sum > 0.0) || j > i {
                continue;
            }
            let share = scaled / sum;
            weight *= old / sum;
            for row in 0..j {
                a[row] -= a[j] * self.u[row][j];
                self.u[row][j] += share * a[row];
            }
        }
    }

    /// The row `h` of a measurement with noise of variance `r`, and its innovation's variance.
    pub fn project(&self, h: &[f32; N], r: f32) -> Projection<N> {
        let mut f = *h;
        let mut variance = r;
        for j in 0..N {
            for i in 0..j {
                f[j] += self.u[i][j] * h[i];
            }
            variance += self.d[j] * f[j] * f[j];
        }
        Projection { f, variance }
    }

    /// Measurement update (eq. 17) by Bierman's algorithm. `r` is that of the projection and above
    /// 0. Cost: `1.5 N^2` multiply-adds and `2 N` divisions.
    pub fn update(&mut self, projection: &Projection<N>, r: f32) -> Gain<N> {
        let f = &projection.f;
        // P h', once the loop is through.
        let mut ph = [0.0; N];
        let mut alpha = r;
        for j in 0..N {
            let v = self.d[j] * f[j];
            let before = alpha;
            alpha += f[j] * v;
            self.d[j] *= before / alpha;
            let share = -f[j] / before;
            for i in 0..j {
                let old = self.u[i][j];
                self.u[i][j] = old + ph[i] * share;
                ph[i] += old * v;
            }
            ph[j] = v;
        }
        let gain = ph.map(|ph| ph / alpha);
        let mut reduction = gain;
        for (reduction, ph) in reduction.iter_mut().zip(&ph) {
            *reduction *= ph;
        }
        Gain { gain, reduction }
    }

    /// Takes the elements from `first` on as known: the others keep their covariance given those,
    /// the correlation is forgotten, and the variances of the known ones wait unchanged.
    pub fn condition(&mut self, first: usize) {
        for row in self.u.iter_mut().take(first) {
            for element in row.iter_mut().skip(first) {
                *element = 0.0;
            }
        }
    }

    /// Starts the elements before `end` anew: independent of all, with these variances.
    pub fn restart(&mut self, end: usize, variances: &[f32; N]) {
        self.condition(end);
        for i in 0..N {
            if i < end {
                self.d[i] = variances[i];
                for row in &mut self.u {
                    row[i] = 0.0;
                }
            }
        }
    }
}
