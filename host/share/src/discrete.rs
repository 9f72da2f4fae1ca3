//! Discrete Gaussian noise, drawn with whole numbers alone (docs/explanation/sharing.md, eq. 4).
//!
//! C. Canonne, G. Kamath, T. Steinke, "The discrete Gaussian for differential privacy", NeurIPS
//! 2020, algorithms 1 to 3. No rounding takes place, so the low bits of a result tell nothing: what
//! I. Mironov ("On significance of the least significant bits for differential privacy", CCS 2012)
//! reads from noise of floating point is not there.

use rand::RngCore;
use rand_chacha::ChaCha20Rng;

/// Largest variance: its products fit 128 bits.
pub const MOST: u64 = 1 << 58;

/// Source of noise.
pub struct Noise(ChaCha20Rng);

impl Noise {
    /// Takes its bits from a generator.
    pub fn new(random: ChaCha20Rng) -> Self {
        Self(random)
    }

    /// Draws a whole number with probability proportional to `exp(-x^2 / (2 variance))`. `variance`
    /// is in 1 to `MOST`.
    pub fn draw(&mut self, variance: u64) -> i64 {
        let variance = u128::from(variance.clamp(1, MOST));
        let t = variance.isqrt() + 1;
        loop {
            let (negative, size) = self.laplace(t);
            // |size - variance / t|^2 / (2 variance), over t^2.
            let away = (size * t).abs_diff(variance);
            let Some(square) = away.checked_mul(away) else {
                // Farther out than exp(-2^60): no draw comes here.
                continue;
            };
            if self.exponential(square, 2 * variance * t * t) {
                let size = i64::try_from(size).unwrap_or(i64::MAX);
                return if negative { -size } else { size };
            }
        }
    }

    /// Sign and size of a whole number with probability proportional to `exp(-|x| / t)`.
    fn laplace(&mut self, t: u128) -> (bool, u128) {
        loop {
            let fine = self.below(t);
            if !self.exponential(fine, t) {
                continue;
            }
            let mut coarse = 0;
            while self.exponential(1, 1) {
                coarse += 1;
            }
            let size = fine + t * coarse;
            let negative = self.below(2) == 1;
            // Zero has one sign only.
            if !(negative && size == 0) {
                return (negative, size);
            }
        }
    }

    /// True with probability `exp(-numerator / denominator)`.
    fn exponential(&mut self, numerator: u128, denominator: u128) -> bool {
        let (whole, rest) = (numerator / denominator, numerator % denominator);
        (0..whole).all(|_| self.within_one(1, 1)) && self.within_one(rest, denominator)
    }

    /// The same for a ratio of at most 1: von Neumann's alternating series.
    fn within_one(&mut self, numerator: u128, denominator: u128) -> bool {
        let mut k = 1;
        // With probability numerator / (denominator k), drawn in two steps that fit 128 bits.
        while self.below(denominator) < numerator && self.below(k) == 0 {
            k += 1;
        }
        k % 2 == 1
    }

    /// Even draw of a whole number below `limit`, which is at least 1; without bias.
    fn below(&mut self, limit: u128) -> u128 {
        let bits = 128 - (limit - 1).leading_zeros();
        let mask = u128::MAX.checked_shr(128 - bits).unwrap_or(0);
        loop {
            let low = u128::from(self.0.next_u64());
            let high = if bits > 64 {
                u128::from(self.0.next_u64()) << 64
            } else {
                0
            };
            let drawn = (high | low) & mask;
            if drawn < limit {
                return drawn;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn noise(seed: u64) -> Noise {
        Noise::new(ChaCha20Rng::seed_from_u64(seed))
    }

    #[test]
    fn shares_of_small_numbers_are_those_of_the_discrete_gaussian() {
        let mut noise = noise(1);
        let (variance, draws) = (3_u64, 200_000);
        let mut counts = [0_u32; 21];
        for _ in 0..draws {
            let at = noise.draw(variance) + 10;
            counts[usize::try_from(at.clamp(0, 20)).expect("it is in 0 to 20")] += 1;
        }
        let weight = |x: i32| f64::exp(-f64::from(x * x) / (2.0 * variance as f64));
        let all: f64 = (-40..=40).map(weight).sum();
        let squares: f64 = (-5..=5)
            .map(|x: i32| {
                let expected = f64::from(draws) * weight(x) / all;
                (f64::from(counts[(x + 10) as usize]) - expected).powi(2) / expected
            })
            .sum();
        // Chi-square of about eleven: 31 is exceeded by chance once in a thousand.
        assert!(squares < 31.0, "{squares} {counts:?}");
    }

    #[test]
    fn large_noise_has_its_mean_its_variance_and_its_tails() {
        let mut noise = noise(2);
        let sigma = 3e7_f64;
        let drawn: Vec<f64> = (0..40_000)
            .map(|_| noise.draw((sigma * sigma) as u64) as f64 / sigma)
            .collect();
        let count = drawn.len() as f64;
        let mean = drawn.iter().sum::<f64>() / count;
        let square = drawn.iter().map(|x| x * x).sum::<f64>() / count;
        let beyond = drawn.iter().filter(|x| x.abs() > 2.0).count() as f64 / count;
        assert!(mean.abs() < 0.02, "{mean}");
        assert!((square - 1.0).abs() < 0.03, "{square}");
        assert!((beyond - 0.0455).abs() < 0.004, "{beyond}");
    }

    #[test]
    fn even_draws_have_no_bias() {
        let mut noise = noise(3);
        for limit in [1_u128, 2, 3, 5, 1 << 70] {
            let drawn: Vec<f64> = (0..20_000)
                .map(|_| noise.below(limit) as f64 / limit as f64)
                .collect();
            let mean = drawn.iter().sum::<f64>() / 20_000.0;
            let wanted = (limit - 1) as f64 / (2.0 * limit as f64);
            assert!((mean - wanted).abs() < 0.01, "{limit}: {mean}");
        }
    }
}
