//! Calibration of the watch over a soft sensor's channels: what the others say of each
//! (docs/explanation/controller.md, eq. 25).

use nalgebra::{Cholesky, DMatrix, DVector};
use sinew_model::spec::WatchSpec;

/// Ridge on the covariance: two channels that say the same share their weight.
const RIDGE: f64 = 1e-6;
/// Least spread, in half ranges: a recording without noise promises too much.
const LEAST_SPREAD: f64 = 2e-3;
/// Part of the deviations that lie within three spreads, at least.
const WITHIN: f64 = 0.995;

/// Relation of the columns of `z`, readings in model units, to one another. Spreads are those on
/// `stretches` of the rows, each judged by the relation of all others. `None` for fewer channels
/// than can be watched.
pub fn calibrate(
    z: &DMatrix<f64>,
    stretches: impl Iterator<Item = (usize, usize)>,
) -> Option<WatchSpec> {
    let (rows, n) = z.shape();
    if n < WatchSpec::LEAST {
        return None;
    }
    let mut deviations: Vec<Vec<f64>> = vec![Vec::with_capacity(rows); n];
    for (from, to) in stretches {
        let others = z.clone().remove_rows(from, to - from);
        let (bias, weights) = relation(&others)?;
        for row in z.rows(from, to - from).row_iter() {
            let said = &weights * row.transpose() + &bias;
            for (i, (said, read)) in said.iter().zip(row.iter()).enumerate() {
                deviations[i].push(read - said);
            }
        }
    }
    let spread = deviations.into_iter().map(|mut of| {
        let rms = (of.iter().map(|d| d * d).sum::<f64>() / of.len().max(1) as f64).sqrt();
        of.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        let within = (WITHIN * of.len() as f64) as usize;
        let most = of.get(within).map_or(0.0, |d| d.abs() / 3.0);
        rms.max(most).max(LEAST_SPREAD) as f32
    });
    let spread = spread.collect();
    let (bias, weights) = relation(z)?;
    Some(WatchSpec {
        bias: bias.iter().map(|b| *b as f32).collect(),
        // Column by column it is stored.
        weights: weights.transpose().iter().map(|w| *w as f32).collect(),
        spread,
    })
}

/// b and W of `z_i = b_i + sum_j w_ij z_j`: from the inverse P of the covariance, `w_ij = -P_ij /
/// P_ii`, which is least squares of each on all others at once.
fn relation(z: &DMatrix<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let (rows, n) = z.shape();
    let mean = z.row_mean();
    let centred = DMatrix::from_fn(rows, n, |k, i| z[(k, i)] - mean[i]);
    let covariance = centred.tr_mul(&centred) / rows.max(1) as f64;
    let ridged = covariance + DMatrix::identity(n, n) * RIDGE;
    let inverse = Cholesky::new(ridged)?.inverse();
    let weights = DMatrix::from_fn(n, n, |i, j| {
        if i == j {
            0.0
        } else {
            -inverse[(i, j)] / inverse[(i, i)]
        }
    });
    let mean = mean.transpose();
    Some((&mean - &weights * &mean, weights))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five channels of a body that bends in two ways, one of them curved.
    fn bent(rows: usize, noise: f64) -> DMatrix<f64> {
        let mut state = 1_u64;
        let mut rough = || {
            // Twelve uniform numbers are nearly normal.
            let mut sum = -6.0;
            for _ in 0..12 {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
            }
            noise * sum
        };
        DMatrix::from_fn(rows, 5, |k, i| {
            let (p, q) = ((0.031 * k as f64).sin(), (0.017 * k as f64 + 0.4).cos());
            let read = [p, q, 0.6 * p + 0.4 * q, 0.5 * (p - q), -0.8 * q][i];
            read + rough()
        })
    }

    fn fifths(rows: usize) -> impl Iterator<Item = (usize, usize)> {
        (0..5).map(move |k| (k * rows / 5, (k + 1) * rows / 5))
    }

    #[test]
    fn what_the_others_say_is_off_by_their_noise() {
        let z = bent(3000, 0.01);
        let found = calibrate(&z, fifths(3000)).unwrap();
        for spread in &found.spread {
            assert!((0.009..0.025).contains(spread), "{:?}", found.spread);
        }
        // And on readings that it has not seen.
        let quiet = bent(200, 0.0);
        for row in quiet.row_iter() {
            let row: Vec<f64> = row.iter().copied().collect();
            for (said, read) in found.said(&row).iter().zip(&row) {
                assert!((said - read).abs() < 0.02, "{said} for {read}");
            }
        }
        assert!((0..5).all(|i| found.weights[6 * i] == 0.0));
    }

    #[test]
    fn a_recording_without_noise_promises_no_more_than_the_least_spread() {
        let found = calibrate(&bent(600, 0.0), fifths(600)).unwrap();
        assert!(
            found.spread.iter().all(|s| *s == LEAST_SPREAD as f32),
            "{:?}",
            found.spread
        );
    }

    #[test]
    fn three_channels_are_too_few_to_be_watched() {
        let three = bent(600, 0.01).columns(0, 3).into_owned();
        assert_eq!(calibrate(&three, fifths(600)), None);
    }
}
