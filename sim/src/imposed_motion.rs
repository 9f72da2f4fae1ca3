//! Smoothing of a recorded coordinate: position, velocity, acceleration at every row
//! (docs/explanation/plant.md, eq. 24).
//!
//! The quintic smoothing spline in its state-space form (Wahba 1978; Kohn and Ansley 1987): the
//! jerk is white noise, the samples carry white noise. A Kalman filter and the Rauch–Tung–Striebel
//! smoother give its exact value in linear time, with gaps and uneven rows.

#![allow(
    clippy::needless_range_loop,
    reason = "matrices of one size by their indices"
)]

use crate::math;

type Vector = [f64; 3];
type Matrix = [[f64; 3]; 3];

/// Rows whose parabola starts the filter.
const FIRST: usize = 6;

/// Factor on the variance of that parabola, so that the start has next to no weight.
const DIFFUSE: f64 = 1e4;

/// Decades of the jerk's intensity that are searched, in units of noise and sample interval.
const DECADES: (f64, f64) = (-12.0, 6.0);

/// Part of an interval that a golden section keeps.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// A coordinate, its derivatives and what is known of them, one entry a row.
#[derive(Clone, Debug, PartialEq)]
pub struct ImposedMotion {
    /// m or rad.
    pub position: Vec<f64>,
    /// Per second.
    pub velocity: Vec<f64>,
    /// Per second squared.
    pub acceleration: Vec<f64>,
    /// Standard deviation of the velocity.
    pub velocity_deviation: Vec<f64>,
    /// Standard deviation of the noise on the samples.
    pub noise: f64,
}

/// Estimate after a row, and the prediction of the row from the one before.
struct Step {
    mean: Vector,
    spread: Matrix,
    predicted: Vector,
    predicted_spread: Matrix,
}

/// Samples in units of the usual interval; NaN where missing.
struct Samples<'a> {
    /// Intervals before each row; 0 at the first.
    steps: Vec<f64>,
    values: &'a [f64],
    start: Vector,
    start_spread: Matrix,
}

impl ImposedMotion {
    /// Smooths samples (NaN: missing) at increasing times. The noise and the smoothness are those
    /// of the greatest likelihood. `None` with fewer than six samples.
    ///
    /// ```
    /// let t: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
    /// let q: Vec<f64> = t.iter().map(|t| (3.0 * t).sin()).collect();
    /// let motion = sinew_sim::ImposedMotion::smooth(&t, &q).unwrap();
    /// assert!((motion.velocity[100] - 3.0 * 3.0_f64.cos()).abs() < 1e-5);
    /// ```
    pub fn smooth(t: &[f64], samples: &[f64]) -> Option<Self> {
        let mut gaps: Vec<f64> = t.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let known: Vec<usize> = (0..samples.len().min(t.len()))
            .filter(|&row| samples[row].is_finite())
            .collect();
        if known.len() < FIRST {
            return None;
        }
        let middle = gaps.len() / 2;
        let unit = *gaps.select_nth_unstable_by(middle, f64::total_cmp).1;
        let steps = std::iter::once(0.0).chain(t.windows(2).map(|pair| (pair[1] - pair[0]) / unit));
        let (start, start_spread) = parabola(t, samples, &known[..FIRST], unit)?;
        let samples = Samples {
            steps: steps.collect(),
            values: samples,
            start,
            start_spread,
        };
        let (intensity, variance) = samples.likeliest();
        Some(samples.smoothed(intensity, variance, unit))
    }
}

/// Parabola through the first samples by least squares: its state at the first row and the spread
/// of it, for noise of one.
fn parabola(t: &[f64], samples: &[f64], rows: &[usize], unit: f64) -> Option<(Vector, Matrix)> {
    let (mut normal, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
    for &row in rows {
        let x = (t[row] - t[0]) / unit;
        let powers = [1.0, x, 0.5 * x * x];
        for i in 0..3 {
            right[i] += powers[i] * samples[row];
            for j in 0..3 {
                normal[i][j] += powers[i] * powers[j];
            }
        }
    }
    let inverse = inverse(&normal)?;
    let spread = inverse.map(|row| row.map(|x| x * DIFFUSE));
    Some((apply(&inverse, &right), spread))
}

impl Samples<'_> {
    /// Intensity of the jerk in units of the noise, and the variance of the noise, of the greatest
    /// likelihood: a grid, then a golden section.
    fn likeliest(&self) -> (f64, f64) {
        let at = |decade: f64| self.deviance(math::exp(decade * std::f64::consts::LN_10));
        let grid = (0..)
            .map(|k| DECADES.0 + f64::from(k))
            .take_while(|&d| d <= DECADES.1);
        let best = grid
            .map(|decade| (at(decade).0, decade))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(0.0, |(_, decade)| decade);
        let (mut low, mut high) = (best - 1.0, best + 1.0);
        for _ in 0..12 {
            let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
            if at(a).0 < at(b).0 {
                high = b;
            } else {
                low = a;
            }
        }
        let decade = 0.5 * (low + high);
        (math::exp(decade * std::f64::consts::LN_10), at(decade).1)
    }

    /// Minus twice the logarithm of the likelihood, concentrated in the noise, and that noise's
    /// variance.
    fn deviance(&self, intensity: f64) -> (f64, f64) {
        let (mut squares, mut logarithms, mut count) = (0.0, 0.0, 0usize);
        let mut seen = 0;
        self.filter(intensity, |_, innovation| {
            if let Some((surprise, variance)) = innovation {
                seen += 1;
                if seen > FIRST {
                    squares += surprise * surprise / variance;
                    logarithms += math::ln(variance);
                    count += 1;
                }
            }
        });
        let count = count.max(1) as f64;
        let variance = (squares / count).max(f64::MIN_POSITIVE);
        (count * math::ln(variance) + logarithms, variance)
    }

    /// Runs the filter with noise of one; `visit` sees every row and its innovation.
    fn filter(&self, intensity: f64, mut visit: impl FnMut(&Step, Option<(f64, f64)>)) {
        let (mut mean, mut spread) = (self.start, self.start_spread);
        for (&h, &sample) in self.steps.iter().zip(self.values) {
            if h > 0.0 {
                let transition = transition(h);
                mean = apply(&transition, &mean);
                spread = propagated(&transition, &spread);
                for (row, noise) in spread.iter_mut().zip(process_noise(h)) {
                    for (x, noise) in row.iter_mut().zip(noise) {
                        *x += intensity * noise;
                    }
                }
            }
            let (predicted, predicted_spread) = (mean, spread);
            let mut innovation = None;
            if sample.is_finite() {
                let variance = spread[0][0] + 1.0;
                let surprise = sample - mean[0];
                let gain = [0, 1, 2].map(|i| spread[i][0] / variance);
                for i in 0..3 {
                    mean[i] += gain[i] * surprise;
                    for j in 0..3 {
                        spread[i][j] -= gain[i] * predicted_spread[0][j];
                    }
                }
                innovation = Some((surprise, variance));
            }
            let step = Step {
                mean,
                spread,
                predicted,
                predicted_spread,
            };
            visit(&step, innovation);
        }
    }

    /// The way back, in SI.
    fn smoothed(&self, intensity: f64, variance: f64, unit: f64) -> ImposedMotion {
        let mut steps = Vec::with_capacity(self.values.len());
        self.filter(intensity, |step, _| {
            steps.push(Step { ..*step });
        });
        let rows = steps.len();
        let noise = math::sqrt(variance);
        let mut motion = ImposedMotion {
            position: vec![0.0; rows],
            velocity: vec![0.0; rows],
            acceleration: vec![0.0; rows],
            velocity_deviation: vec![0.0; rows],
            noise,
        };
        let Some(last) = steps.last() else {
            return motion;
        };
        let (mut mean, mut spread) = (last.mean, last.spread);
        for row in (0..rows).rev() {
            if row + 1 < rows {
                let (here, next) = (&steps[row], &steps[row + 1]);
                let transition = transition(self.steps[row + 1]);
                // Where rows are so close that the prediction's spread is singular, what follows
                // says no more than the row itself.
                let inverse = inverse(&next.predicted_spread).unwrap_or_default();
                let gain = product(&product(&here.spread, &transposed(&transition)), &inverse);
                let surprise = [0, 1, 2].map(|i| mean[i] - next.predicted[i]);
                let correction = apply(&gain, &surprise);
                let mut change = spread;
                for i in 0..3 {
                    mean[i] = here.mean[i] + correction[i];
                    for j in 0..3 {
                        change[i][j] -= next.predicted_spread[i][j];
                    }
                }
                spread = propagated(&gain, &change);
                for i in 0..3 {
                    for j in 0..3 {
                        spread[i][j] += here.spread[i][j];
                    }
                }
            }
            motion.position[row] = mean[0];
            motion.velocity[row] = mean[1] / unit;
            motion.acceleration[row] = mean[2] / (unit * unit);
            motion.velocity_deviation[row] = noise * math::sqrt(spread[1][1].max(0.0)) / unit;
        }
        motion
    }
}

/// Position, velocity and acceleration after `h` at constant acceleration.
fn transition(h: f64) -> Matrix {
    [[1.0, h, 0.5 * h * h], [0.0, 1.0, h], [0.0, 0.0, 1.0]]
}

/// Spread that white jerk of intensity one adds within `h`.
fn process_noise(h: f64) -> Matrix {
    let (h2, h3) = (h * h, h * h * h);
    [
        [h3 * h2 / 20.0, h2 * h2 / 8.0, h3 / 6.0],
        [h2 * h2 / 8.0, h3 / 3.0, h2 / 2.0],
        [h3 / 6.0, h2 / 2.0, h],
    ]
}

fn apply(a: &Matrix, x: &Vector) -> Vector {
    a.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let columns = transposed(b);
    a.map(|row| columns.map(|column| (0..3).map(|k| row[k] * column[k]).sum()))
}

fn transposed(a: &Matrix) -> Matrix {
    [0, 1, 2].map(|i| [a[0][i], a[1][i], a[2][i]])
}

/// `a x a'`, symmetric.
fn propagated(a: &Matrix, x: &Matrix) -> Matrix {
    let full = product(&product(a, x), &transposed(a));
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| 0.5 * (full[i][j] + full[j][i])))
}

/// Inverse by cofactors, of a matrix scaled to a diagonal of one; `None` where it is singular.
fn inverse(a: &Matrix) -> Option<Matrix> {
    let scale = [0, 1, 2].map(|i| math::sqrt(a[i][i].abs()));
    if scale.iter().any(|s| *s == 0.0 || !s.is_finite()) {
        return None;
    }
    let b = [0, 1, 2].map(|i| [0, 1, 2].map(|j| a[i][j] / (scale[i] * scale[j])));
    let minor = |i: usize, j: usize| {
        let (r, s) = ((i + 1) % 3, (i + 2) % 3);
        let (p, q) = ((j + 1) % 3, (j + 2) % 3);
        b[r][p] * b[s][q] - b[r][q] * b[s][p]
    };
    let determinant: f64 = (0..3).map(|j| b[0][j] * minor(0, j)).sum();
    let cofactor = |i: usize, j: usize| minor(j, i) / (determinant * scale[i] * scale[j]);
    (determinant != 0.0 && determinant.is_finite())
        .then(|| [0, 1, 2].map(|i| [0, 1, 2].map(|j| cofactor(i, j))))
}

#[cfg(test)]
mod tests {
    use super::ImposedMotion;

    /// A pseudo-random normal deviate: twelve uniform numbers of a linear congruence.
    fn deviate(state: &mut u64) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            *state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            sum += (*state >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum
    }

    fn rms(found: &[f64], exact: impl Fn(usize) -> f64) -> f64 {
        let squares = found
            .iter()
            .enumerate()
            .map(|(row, x)| (x - exact(row)).powi(2));
        (squares.sum::<f64>() / found.len() as f64).sqrt()
    }

    /// q = 2 sin 5t with uneven rows, gaps and noise of 1e-3: derivatives in closed form.
    #[test]
    fn noise_is_found_and_kept_out_of_the_derivatives() {
        let mut state = 7;
        let t: Vec<f64> = (0..2000)
            .map(|k| 0.005 * (f64::from(k) + 0.3 * f64::from(k % 3)))
            .collect();
        let mut q: Vec<f64> = t
            .iter()
            .map(|t| 2.0 * (5.0 * t).sin() + 1e-3 * deviate(&mut state))
            .collect();
        q[700..720].fill(f64::NAN);
        let motion = ImposedMotion::smooth(&t, &q).unwrap();
        assert!((motion.noise / 1e-3 - 1.0).abs() < 0.1, "{}", motion.noise);
        let speed = rms(&motion.velocity, |row| 10.0 * (5.0 * t[row]).cos());
        let force = rms(&motion.acceleration, |row| -50.0 * (5.0 * t[row]).sin());
        // Differences of the samples err by 0.28 /s and by 80 /s^2.
        assert!(speed < 0.03, "{speed}");
        assert!(force < 2.0, "{force}");
        // It knows how far off it is.
        let deviation = rms(&motion.velocity_deviation, |_| 0.0);
        assert!(
            (0.5..2.0).contains(&(deviation / speed)),
            "{deviation} {speed}"
        );
    }

    #[test]
    fn exact_samples_are_followed_and_too_few_are_refused() {
        let t: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let q: Vec<f64> = t.iter().map(|t| t * t * t - t).collect();
        let motion = ImposedMotion::smooth(&t, &q).unwrap();
        // A natural spline has no jerk at its ends, and this motion has; it is off there alone.
        let velocity = |row: usize| motion.velocity[row] - (3.0 * t[row] * t[row] - 1.0);
        let acceleration = |row: usize| motion.acceleration[row] - 6.0 * t[row];
        assert!((30..350).all(|row| velocity(row).abs() < 1e-11));
        assert!((30..350).all(|row| acceleration(row).abs() < 1e-8));
        assert!((0..400).all(|row| velocity(row).abs() < 2e-3));
        assert!((0..400).all(|row| acceleration(row).abs() < 0.2));
        assert_eq!(ImposedMotion::smooth(&t[..5], &q[..5]), None);
        let still = ImposedMotion::smooth(&t, &vec![0.25; 400]).unwrap();
        assert!(rms(&still.velocity, |_| 0.0) < 1e-9);
    }
}
