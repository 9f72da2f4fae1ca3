//! White noise: drawn, and estimated from a recorded signal.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Standard deviation of the white noise on `samples`, from their high-order differences
/// (docs/explanation/training.md): a smooth signal vanishes from them, noise does not. The smallest
/// estimate over orders 3 to 8 is taken, since what is left of the signal only adds.
///
/// Missing samples cut the series. 0 where no stretch is long enough.
pub fn noise_level(samples: &[f64]) -> f64 {
    let mut least = f64::INFINITY;
    for order in 3..=8 {
        let (mut sum, mut count) = (0.0, 0_usize);
        for stretch in samples.split(|v| !v.is_finite()) {
            let mut differences = stretch.to_vec();
            for _ in 0..order {
                differences = differences.windows(2).map(|w| w[1] - w[0]).collect();
            }
            sum += differences.iter().map(|d| d * d).sum::<f64>();
            count += differences.len();
        }
        if count >= 16 {
            // The p-th difference of white noise has variance C(2p, p) sigma^2.
            let gain = (1..=order).fold(1.0, |c, i| c * f64::from(order + i) / f64::from(i));
            least = least.min((sum / count as f64 / gain).sqrt());
        }
    }
    if least.is_finite() { least } else { 0.0 }
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
        let found = noise_level(&samples);
        assert!((found / 1e-3 - 1.0).abs() < 0.08, "{found}");
    }

    #[test]
    fn a_smooth_signal_has_none_and_gaps_do_not_count() {
        let mut samples: Vec<f64> = (0..2000).map(|k| (f64::from(k) * 0.01).sin()).collect();
        assert!(noise_level(&samples) < 1e-12);
        samples[1000] = f64::NAN;
        assert!(noise_level(&samples) < 1e-12);
        assert!(noise_level(&[1.0, 2.0]) == 0.0);
    }
}
