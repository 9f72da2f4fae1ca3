//! Kalman filter in double precision from the textbook: full matrices, Joseph form.

use crate::linear::Linear;

/// Mean and covariance of (x, d, theta).
pub struct Reference {
    pub z: Vec<f64>,
    pub p: Vec<Vec<f64>>,
}

fn times(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let columns = b.first().map_or(0, Vec::len);
    a.iter()
        .map(|row| {
            let entry = |c: usize| row.iter().zip(b).map(|(a, b)| a * b[c]).sum();
            (0..columns).map(entry).collect()
        })
        .collect()
}

fn transposed(a: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let columns = a.first().map_or(0, Vec::len);
    (0..columns)
        .map(|c| a.iter().map(|row| row[c]).collect())
        .collect()
}

impl Reference {
    pub fn new(z: Vec<f64>, variances: &[f64]) -> Self {
        let n = variances.len();
        let p = (0..n)
            .map(|r| {
                (0..n)
                    .map(|c| if r == c { variances[r] } else { 0.0 })
                    .collect()
            })
            .collect();
        Self { z, p }
    }

    /// P = F P F' + Q, z = F z + (B u, 0, 0).
    pub fn predict<const NX: usize, const NU: usize, const NM: usize, const NP: usize>(
        &mut self,
        model: &Linear<NX, NU, NM, NP>,
        u: &[f32; NU],
        noise: &[f64],
    ) {
        let n = self.z.len();
        let jacobian = &model.transition;
        let f: Vec<Vec<f64>> = (0..n)
            .map(|r| {
                let entry = |c: usize| {
                    if r >= NX {
                        return f64::from(u8::from(r == c));
                    }
                    f64::from(if c < NX {
                        jacobian.x[r][c]
                    } else if c < NX + NU {
                        jacobian.u[r][c - NX]
                    } else {
                        jacobian.theta[r][c - NX - NU]
                    })
                };
                (0..n).map(entry).collect()
            })
            .collect();
        let z: Vec<Vec<f64>> = self.z.iter().map(|z| vec![*z]).collect();
        self.z = times(&f, &z).iter().map(|z| z[0]).collect();
        for (z, row) in self.z.iter_mut().zip(&jacobian.u) {
            for (b, u) in row.iter().zip(u) {
                *z += f64::from(*b) * f64::from(*u);
            }
        }
        self.p = times(&times(&f, &self.p), &transposed(&f));
        for (i, variance) in noise.iter().enumerate() {
            self.p[i][i] += variance;
        }
    }

    /// All readings that are numbers, at once in effect: one after the other on a linear model.
    pub fn update<const NX: usize, const NU: usize, const NM: usize, const NP: usize>(
        &mut self,
        model: &Linear<NX, NU, NM, NP>,
        readings: &[f32; NM],
        noise: f64,
    ) {
        let n = self.z.len();
        for (i, reading) in readings.iter().enumerate() {
            if !reading.is_finite() {
                continue;
            }
            let mut h = vec![0.0; n];
            for (place, value) in h.iter_mut().zip(&model.measurement.x[i]) {
                *place = f64::from(*value);
            }
            for (place, value) in h.iter_mut().skip(NX + NU).zip(&model.measurement.theta[i]) {
                *place = f64::from(*value);
            }
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let ph: Vec<f64> = self.p.iter().map(|row| dot(row, &h)).collect();
            let variance = dot(&h, &ph) + noise;
            let gain: Vec<f64> = ph.iter().map(|ph| ph / variance).collect();
            let innovation = f64::from(*reading) - dot(&h, &self.z);
            for (z, gain) in self.z.iter_mut().zip(&gain) {
                *z += gain * innovation;
            }
            // Joseph form: (I - K h) P (I - K h)' + K r K'.
            let left: Vec<Vec<f64>> = (0..n)
                .map(|r| {
                    (0..n)
                        .map(|c| f64::from(u8::from(r == c)) - gain[r] * h[c])
                        .collect()
                })
                .collect();
            self.p = times(&times(&left, &self.p), &transposed(&left));
            for (row, a) in self.p.iter_mut().zip(&gain) {
                for (p, b) in row.iter_mut().zip(&gain) {
                    *p += noise * a * b;
                }
            }
        }
    }

    pub fn deviation(&self, i: usize) -> f64 {
        self.p[i][i].sqrt()
    }
}
