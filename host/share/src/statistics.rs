//! Bounded statistics of devices, and their private release (docs/explanation/sharing.md, eq. 2
//! to 4).

use rand_chacha::ChaCha20Rng;

use crate::budget::Budget;
use crate::discrete::Noise;

/// Whole numbers that the radius of the unit ball is divided into.
const GRID: i64 = 1 << 16;

/// Statistics of one device or their sum over devices, as whole numbers: its place, then its
/// products, row by row of the lower triangle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Counts(Vec<i64>);

/// Number of statistics of a place with `size` coordinates.
pub fn count(size: usize) -> usize {
    size + size * (size + 1) / 2
}

/// Largest Euclidean change of the sum when one device is replaced (eq. 3).
pub fn sensitivity(size: usize) -> f64 {
    let products = (size * (size + 1) / 2) as f64;
    2.0 * GRID as f64 + products.sqrt() + 1.0
}

impl Counts {
    /// Statistics of a device (eq. 2). A place outside the unit ball, rounding included, is moved
    /// towards the middle until it is inside.
    pub fn of(place: &[f64]) -> Self {
        let mut at: Vec<i64> = (place.iter())
            .map(|x| (x.clamp(-1.0, 1.0) * GRID as f64).round() as i64)
            .collect();
        // Judged in whole numbers, so that no rounding breaks the bound.
        while at.iter().map(|x| x * x).sum::<i64>() > GRID * GRID {
            at.iter_mut()
                .for_each(|x| *x -= x.signum() * (1 + x.abs() / GRID));
        }
        let mut all = at.clone();
        for row in 0..at.len() {
            for column in 0..=row {
                let product = (at[row] * at[column]) as f64 / GRID as f64;
                let weight = if row == column {
                    std::f64::consts::FRAC_1_SQRT_2
                } else {
                    1.0
                };
                all.push((product * weight).round() as i64);
            }
        }
        Self(all)
    }

    /// Sum over devices, of which there is at least one.
    pub fn sum(devices: &[Vec<f64>]) -> Self {
        let size = devices.first().map_or(0, Vec::len);
        let mut all = vec![0; count(size)];
        for device in devices {
            for (sum, own) in all.iter_mut().zip(Self::of(device).0) {
                *sum += own;
            }
        }
        Self(all)
    }

    /// The whole numbers.
    pub fn numbers(&self) -> &[i64] {
        &self.0
    }
}

/// Sums with noise: all that is released. Everything else follows from it and from public settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Release {
    /// Number of devices, which is public.
    pub devices: usize,
    /// Number of parameters.
    pub size: usize,
    /// Variance of the noise on each whole number.
    pub variance: u64,
    /// Sums with noise.
    pub sums: Vec<i64>,
}

impl Release {
    /// Adds noise to the sum over places (eq. 4).
    pub fn new(places: &[Vec<f64>], budget: &Budget, random: ChaCha20Rng) -> Self {
        let size = places.first().map_or(0, Vec::len);
        let variance = budget.variance(sensitivity(size));
        Self::with_variance(places, variance, &mut Noise::new(random))
    }

    /// Adds noise of a variance that [`Budget::variance`] gave for this sensitivity.
    pub fn with_variance(places: &[Vec<f64>], variance: u64, noise: &mut Noise) -> Self {
        let sums = Counts::sum(places).0.into_iter();
        Self {
            devices: places.len(),
            size: places.first().map_or(0, Vec::len),
            variance,
            sums: sums.map(|sum| sum + noise.draw(variance)).collect(),
        }
    }

    /// Means over devices, in units of the radius: of the places, then of the weighted products.
    pub fn means(&self) -> Vec<f64> {
        let scale = GRID as f64 * self.devices as f64;
        self.sums.iter().map(|sum| *sum as f64 / scale).collect()
    }

    /// Standard deviation of the noise on each mean.
    pub fn deviation(&self) -> f64 {
        deviation(self.variance, self.devices)
    }
}

/// Standard deviation of the noise on a mean over devices, in units of the radius.
fn deviation(variance: u64, devices: usize) -> f64 {
    (variance as f64).sqrt() / (GRID as f64 * devices as f64)
}

/// Expected error of the mean of a place's coordinate (root mean square) with so many devices, in
/// units of the radius (eq. 8). It depends on no recording.
pub fn expected_error(size: usize, devices: usize, budget: &Budget) -> f64 {
    deviation(budget.variance(sensitivity(size)), devices)
}

/// Means of the statistics of places in exact arithmetic, weighted as [`Release::means`].
pub fn means(places: &[Vec<f64>]) -> Vec<f64> {
    let size = places.first().map_or(0, Vec::len);
    let mut all = vec![0.0; count(size)];
    for place in places {
        let mut k = size;
        for row in 0..size {
            all[row] += place[row];
            for column in 0..=row {
                let weight = if row == column {
                    std::f64::consts::FRAC_1_SQRT_2
                } else {
                    1.0
                };
                all[k] += weight * place[row] * place[column];
                k += 1;
            }
        }
    }
    let devices = places.len().max(1) as f64;
    all.iter().map(|sum| sum / devices).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    fn apart(a: &[f64], b: &[f64]) -> f64 {
        let (a, b) = (Counts::of(a), Counts::of(b));
        let squares = a.0.iter().zip(&b.0).map(|(a, b)| ((a - b) as f64).powi(2));
        squares.sum::<f64>().sqrt()
    }

    #[test]
    fn no_replacement_of_a_device_exceeds_the_sensitivity_and_one_comes_near() {
        let mut random = ChaCha20Rng::seed_from_u64(4);
        for size in 1..=8 {
            let bound = sensitivity(size);
            let mut draw = |length: f64| -> Vec<f64> {
                let mut at: Vec<f64> = (0..size).map(|_| random.random_range(-1.0..1.0)).collect();
                let norm = at.iter().map(|x| x * x).sum::<f64>().sqrt();
                at.iter_mut().for_each(|x| *x *= length / norm);
                at
            };
            let mut largest = 0.0_f64;
            for k in 0..4000 {
                // On the surface, beyond it, and anywhere inside.
                let lengths = [[1.0, 1.0], [7.0, 1e9], [0.6, 1.0], [0.1, 0.9]][k % 4];
                let (a, b) = (draw(lengths[0]), draw(lengths[1]));
                let across: Vec<f64> = a.iter().map(|x| -x).collect();
                let turned: Vec<f64> = a.iter().rev().map(|x| -x).collect();
                for other in [&b, &across, &turned] {
                    largest = largest.max(apart(&a, other));
                }
            }
            assert!(largest <= bound, "{size}: {largest} beside {bound}");
            assert!(largest > 0.999 * bound, "{size}: {largest} beside {bound}");
        }
    }

    #[test]
    fn sums_in_whole_numbers_are_those_of_exact_arithmetic() {
        let places = vec![vec![0.3, -0.2, 0.5], vec![-0.1, 0.4, 0.25]];
        let exact = means(&places);
        let whole = Counts::sum(&places);
        for (exact, whole) in exact.iter().zip(whole.numbers()) {
            let mean = *whole as f64 / (2.0 * GRID as f64);
            assert!((mean - exact).abs() < 2e-5, "{mean} {exact}");
        }
    }
}
