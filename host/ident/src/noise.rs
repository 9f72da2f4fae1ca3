//! White noise: drawn, and estimated from a recorded signal.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// A long signal whose spread is below this many times its white noise is nothing but noise.
const NOISE_ALONE: f64 = 1.15;

/// Scatter of that ratio for white noise, times the root of the number of samples: one of noise
/// alone in a thousand exceeds it.
const SCATTER: f64 = 4.5;

/// Fewest samples that tell noise from motion.
const FEWEST: usize = 64;

/// Spread of so many samples, as a multiple of their white noise, below which they are noise alone.
pub(crate) fn most_of_noise(samples: usize) -> f64 {
    NOISE_ALONE.max(1.0 + SCATTER / (samples.max(1) as f64).sqrt())
}

/// Standard deviation of a signal that is noise alone; `None` of one that moves, and of one that is
/// too short to tell.
pub(crate) fn noise_alone(t: &[f64], samples: &[f64]) -> Option<f64> {
    let valid: Vec<f64> = samples.iter().copied().filter(|y| y.is_finite()).collect();
    if valid.len() < FEWEST {
        return None;
    }
    let mean = valid.iter().sum::<f64>() / valid.len() as f64;
    let squares: f64 = valid.iter().map(|y| (y - mean).powi(2)).sum();
    let spread = (squares / valid.len() as f64).sqrt();
    let noise = noise_level(t, samples);
    (noise > 0.0 && spread <= most_of_noise(valid.len()) * noise).then_some(spread)
}

/// Longest window beside the usual one.
const LONGEST: f64 = 4.0;

/// Standard deviation of the white noise on `samples` at the times `t`, from their high-order
/// divided differences (docs/explanation/training.md): a smooth signal vanishes from them, noise
/// does not, evenly sampled or not. The smallest estimate over orders 3 to 8 is taken, since the
/// rest of the signal only adds.
///
/// Missing samples cut the series. 0 where no stretch is long enough.
pub fn noise_level(t: &[f64], samples: &[f64]) -> f64 {
    let mut least = f64::INFINITY;
    for order in 3..=8 {
        let (mut sum, mut count) = (0.0, 0_usize);
        let ranges = t.windows(order + 1).map(|times| times[order] - times[0]);
        let mut ranges: Vec<f64> = ranges.collect();
        let middle = ranges.len() / 2;
        let usual = if ranges.is_empty() {
            0.0
        } else {
            *ranges.select_nth_unstable_by(middle, f64::total_cmp).1
        };
        let times = t.windows(order + 1);
        for (times, values) in times.zip(samples.windows(order + 1)) {
            // Over a gap in time no signal is smooth.
            let whole = times[order] - times[0] <= LONGEST * usual;
            if whole && values.iter().all(|value| value.is_finite()) {
                sum += scaled_difference(times, values).powi(2);
                count += 1;
            }
        }
        if count >= 16 {
            least = least.min((sum / count as f64).sqrt());
        }
    }
    if least.is_finite() { least } else { 0.0 }
}

/// Divided difference of all of some samples, its weights scaled to unit norm: white noise of any
/// sampling leaves its own standard deviation.
pub(crate) fn scaled_difference(t: &[f64], values: &[f64]) -> f64 {
    // Times in units of their range keep the weights of order one.
    let range = t[t.len() - 1] - t[0];
    let (mut difference, mut square) = (0.0, 0.0);
    for (k, value) in values.iter().enumerate() {
        let others = (0..t.len()).filter(|other| *other != k);
        let product: f64 = others.map(|other| (t[k] - t[other]) / range).product();
        difference += value / product;
        square += product.powi(-2);
    }
    difference / square.sqrt()
}

/// A standard normal deviate (Box and Muller 1958).
pub fn gaussian(random: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * (1.0 - random.random::<f64>()).ln()).sqrt();
    radius * (std::f64::consts::TAU * random.random::<f64>()).cos()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn noise_is_found_under_a_large_smooth_signal() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let samples: Vec<f64> = (0..4000)
            .map(|k| (f64::from(k) * 0.01).sin() + 1e-3 * gaussian(&mut random))
            .collect();
        let t: Vec<f64> = (0..4000).map(f64::from).collect();
        let found = noise_level(&t, &samples);
        assert!((found / 1e-3 - 1.0).abs() < 0.08, "{found}");
    }

    #[test]
    fn a_smooth_signal_has_none_and_gaps_do_not_count() {
        let mut samples: Vec<f64> = (0..2000).map(|k| (f64::from(k) * 0.01).sin()).collect();
        let t: Vec<f64> = (0..2000).map(f64::from).collect();
        assert!(noise_level(&t, &samples) < 1e-12);
        samples[1000] = f64::NAN;
        assert!(noise_level(&t, &samples) < 1e-12);
        assert!(noise_level(&[0.0, 1.0], &[1.0, 2.0]) == 0.0);
    }

    /// Rows between 1 and 25 ms apart: the estimate is that of even rows, not 16 times as much.
    #[test]
    fn uneven_times_change_nothing() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let mut now = 0.0;
        let t: Vec<f64> = (0..2000)
            .map(|_| {
                now += 0.001 + 0.024 * random.random::<f64>().powi(2);
                now
            })
            .collect();
        let signal = |t: f64| 0.3 * (5.0 * t).sin();
        let samples: Vec<f64> = (t.iter())
            .map(|t| signal(*t) + 1e-4 * gaussian(&mut random))
            .collect();
        let found = noise_level(&t, &samples);
        assert!((found / 1e-4 - 1.0).abs() < 0.1, "{found}");
    }
}
