//! Noise: its size, the steps of an encoder, and what is left over a model that noise does
//! not explain (docs/explanation/diagnosis.md, eq. 1 to 4).

use crate::noise::noise_level;
use crate::order;

/// Standard deviation of the white noise on a signal (docs/explanation/training.md, eq. T0).
pub(crate) fn level(t: &[f64], samples: &[f64]) -> f64 {
    noise_level(t, samples)
}

/// The middle value; 0 of none.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The step of the scale that all samples lie on, as an encoder's do; 0 where they lie on none that
/// is coarse enough to matter: fewer than half of the samples may be distinct.
pub(crate) fn lattice(samples: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = samples.iter().copied().filter(|y| y.is_finite()).collect();
    order::sort(&mut sorted);
    let count = sorted.len();
    let range = match (sorted.first(), sorted.last()) {
        (Some(low), Some(high)) if high > low => high - low,
        _ => return 0.0,
    };
    sorted.dedup_by(|b, a| (*b - *a).abs() <= 1e-9 * range);
    if 2 * sorted.len() > count || sorted.len() < 3 {
        return 0.0;
    }
    let gaps: Vec<f64> = sorted.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    let fits = gaps
        .iter()
        .filter(|&&gap| {
            let steps = gap / least;
            (steps - steps.round()).abs() < 0.05 * steps.max(1.0)
        })
        .count();
    if fits * 20 >= gaps.len() * 19 {
        least
    } else {
        0.0
    }
}

/// A residual less what rounding to an encoder's step may do to it (eq. 2).
pub(crate) fn beyond_rounding(residual: f64, step: f64) -> f64 {
    residual.signum() * (residual.abs() - 0.5 * step).max(0.0)
}

/// Residuals of a model beside noise (eq. 3, 4).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Excess {
    /// Root mean square of the part that follows itself from sample to sample, SI.
    pub rms: f64,
    /// Number of standard deviations that it stands above what white noise of this size would show.
    pub significance: f64,
}

/// The part of residuals that white noise of standard deviation `noise` does not explain: averages
/// over blocks of 1, 4, 16, 64 samples scatter by `noise / sqrt(block)` if it does (eq. 3).
pub(crate) fn excess(series: &[Vec<f64>], noise: f64) -> Excess {
    let mut found = Excess::default();
    for block in [1_usize, 4, 16, 64] {
        let (mut squares, mut count) = (0.0, 0_usize);
        for stretch in series {
            for part in stretch.chunks_exact(block) {
                let mean = part.iter().sum::<f64>() / block as f64;
                squares += mean * mean;
                count += 1;
            }
        }
        if count < 8 {
            continue;
        }
        let variance = squares / count as f64;
        let expected = noise * noise / block as f64;
        // The noise level itself is known to a few per cent, no better; that matters where blocks
        // are short.
        let doubt = if block == 1 { 0.1 } else { 0.2 };
        let deviation = expected
            * ((2.0 / count as f64).sqrt() + if block == 1 { doubt / 4.0 } else { 0.0 })
            + f64::MIN_POSITIVE;
        let significance = (variance - expected) / deviation;
        if significance > found.significance {
            found.significance = significance;
        }
        if significance > 3.0 {
            found.rms = found.rms.max((variance - expected).max(0.0).sqrt());
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn noise(seed: u64, count: usize) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..count)
            .map(|_| crate::noise::gaussian(&mut random))
            .collect()
    }

    #[test]
    fn white_noise_leaves_no_excess_and_a_slow_wave_under_it_does() {
        let white = noise(1, 4000);
        let nothing = excess(std::slice::from_ref(&white), 1.0);
        assert!(nothing.significance < 4.0, "{nothing:?}");
        let wave: Vec<f64> = white
            .iter()
            .enumerate()
            .map(|(k, y)| y + 0.3 * (0.02 * k as f64).sin())
            .collect();
        let found = excess(&[wave], 1.0);
        assert!(found.significance > 8.0, "{found:?}");
        assert!(
            (found.rms / (0.3 / 2.0_f64.sqrt()) - 1.0).abs() < 0.2,
            "{found:?}"
        );
    }

    #[test]
    fn an_encoder_is_seen_by_its_steps_and_smooth_samples_have_none() {
        let smooth: Vec<f64> = (0..1000).map(|k| (0.01 * f64::from(k)).sin()).collect();
        assert_eq!(lattice(&smooth), 0.0);
        let rounded: Vec<f64> = smooth.iter().map(|y| (y / 0.02).round() * 0.02).collect();
        assert!((lattice(&rounded) - 0.02).abs() < 1e-12);
    }
}
