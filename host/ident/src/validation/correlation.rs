//! Whiteness of residuals, and their correlation with the inputs
//! (docs/explanation/identification.md, eq. 14b and 14c).

/// Half the width of a band that holds 99 % of what chance makes, in standard deviations.
pub const CROSS_BAND: f64 = 2.576;

/// Residuals at most so many rows apart are held against each other.
pub(super) const LAGS: usize = 25;

/// Correlation coefficients by lag, with the band that chance stays in.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlation {
    /// Rows by which the second series lies before the first.
    pub lags: Vec<i64>,
    /// Coefficient of each lag, -1 to 1.
    pub values: Vec<f64>,
    /// Coefficient that 99 % of unrelated series stay below, of each lag.
    pub band: f64,
}

impl Correlation {
    /// Share of the lags outside the band, lag 0 of an autocorrelation aside.
    pub fn outside(&self, with_zero: bool) -> f64 {
        let judged = self.lags.iter().zip(&self.values);
        let judged: Vec<f64> = judged
            .filter(|(lag, _)| with_zero || **lag != 0)
            .map(|(_, value)| *value)
            .collect();
        let outside = judged.iter().filter(|value| value.abs() > self.band);
        outside.count() as f64 / judged.len().max(1) as f64
    }

    /// The largest coefficient by magnitude and its lag, lag 0 of an autocorrelation aside.
    pub fn largest(&self, with_zero: bool) -> Option<(i64, f64)> {
        let all = self.lags.iter().copied().zip(self.values.iter().copied());
        all.filter(|(lag, _)| with_zero || *lag != 0)
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
    }
}

/// Correlation of a series with itself, 0 to `LAGS` rows apart, over several stretches whose
/// means are removed. NaN is a missing sample. `None` where nothing moves or little is there.
pub fn autocorrelation(series: &[&[f64]]) -> Option<Correlation> {
    let centred = centred(series)?;
    let pairs: Vec<(&[f64], &[f64])> = centred.iter().map(|s| (&s[..], &s[..])).collect();
    let lags: Vec<i64> = (0..=LAGS as i64).collect();
    let values = coefficients(&pairs, &lags)?;
    Some(Correlation {
        band: CROSS_BAND / (samples(&centred) as f64).sqrt(),
        lags,
        values,
    })
}

/// Correlation of residuals with an input, `LAGS` rows to either side; a positive lag is an input
/// that came before. The band is Bartlett's: memory of both series widens it. `None` where one of
/// them does not move.
pub fn cross_correlation(residuals: &[&[f64]], input: &[&[f64]]) -> Option<Correlation> {
    let (residuals, input) = (centred(residuals)?, centred(input)?);
    let pairs: Vec<(&[f64], &[f64])> = residuals
        .iter()
        .zip(&input)
        .map(|(r, u)| (&r[..], &u[..]))
        .collect();
    let lags: Vec<i64> = (-(LAGS as i64)..=LAGS as i64).collect();
    let values = coefficients(&pairs, &lags)?;
    // Long enough for the memory of both, short enough that its own noise stays small.
    let count = samples(&residuals);
    let memory: Vec<i64> = (0..=(4 * LAGS as i64).min(count as i64 / 4)).collect();
    let own = |all: &[Vec<f64>]| {
        let pairs: Vec<(&[f64], &[f64])> = all.iter().map(|s| (&s[..], &s[..])).collect();
        coefficients(&pairs, &memory)
    };
    let (of_residuals, of_input) = (own(&residuals)?, own(&input)?);
    let products = of_residuals.iter().zip(&of_input).map(|(r, u)| r * u);
    let sum: f64 = products.skip(1).sum();
    let variance = (1.0 + 2.0 * sum).max(1.0) / count as f64;
    Some(Correlation {
        lags,
        values,
        band: CROSS_BAND * variance.sqrt(),
    })
}

/// Each stretch without its mean.
fn centred(series: &[&[f64]]) -> Option<Vec<Vec<f64>>> {
    let one = |series: &&[f64]| {
        let finite = || series.iter().filter(|v| v.is_finite());
        let mean = finite().sum::<f64>() / finite().count().max(1) as f64;
        series.iter().map(|v| v - mean).collect::<Vec<f64>>()
    };
    let all: Vec<Vec<f64>> = series.iter().map(one).collect();
    (samples(&all) > 2 * LAGS).then_some(all)
}

fn samples(series: &[Vec<f64>]) -> usize {
    series.iter().flatten().filter(|v| v.is_finite()).count()
}

/// Coefficients of `(a(k), b(k - lag))`; pairs with a missing sample are left out.
fn coefficients(pairs: &[(&[f64], &[f64])], lags: &[i64]) -> Option<Vec<f64>> {
    let power = |side: usize| {
        let all = pairs.iter().flat_map(|pair| [pair.0, pair.1][side]);
        let all: Vec<f64> = all.copied().filter(|v| v.is_finite()).collect();
        all.iter().map(|v| v * v).sum::<f64>() / all.len().max(1) as f64
    };
    let scale = (power(0) * power(1)).sqrt();
    if !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    let all = lags.iter().map(|&lag| {
        let (mut sum, mut count) = (0.0, 0_usize);
        for (a, b) in pairs {
            let rows = a.len().min(b.len()) as i64;
            for k in lag.max(0)..rows.min(rows + lag) {
                let product = a[k as usize] * b[(k - lag) as usize];
                if product.is_finite() {
                    sum += product;
                    count += 1;
                }
            }
        }
        sum / count.max(1) as f64 / scale
    });
    Some(all.collect())
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::noise::gaussian;

    fn white(rows: usize, seed: u64) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..rows).map(|_| gaussian(&mut random)).collect()
    }

    #[test]
    fn white_residuals_stay_in_the_band_and_filtered_ones_leave_it() {
        let noise = white(4000, 1);
        let found = autocorrelation(&[&noise]).unwrap();
        assert!((found.values[0] - 1.0).abs() < 1e-12);
        assert!((found.band - 2.576 / 4000.0_f64.sqrt()).abs() < 1e-12);
        assert!(found.outside(false) <= 0.1, "{}", found.outside(false));
        // A first-order filter with 0.8: the coefficient of lag k is 0.8 to the power k.
        let mut kept = 0.0;
        let filtered: Vec<f64> = (noise.iter())
            .map(|v| {
                kept = 0.8 * kept + v;
                kept
            })
            .collect();
        let found = autocorrelation(&[&filtered]).unwrap();
        for lag in 1..4 {
            let truth = 0.8_f64.powi(lag as i32);
            assert!((found.values[lag] - truth).abs() < 0.05);
        }
        assert!(found.outside(false) > 0.2);
    }

    #[test]
    fn an_input_that_the_model_forgot_shows_at_its_delay() {
        let (input, noise) = (white(3000, 2), white(3000, 3));
        let missed: Vec<f64> = (0..3000_usize)
            .map(|k| noise[k] + k.checked_sub(4).map_or(0.0, |before| 0.5 * input[before]))
            .collect();
        let found = cross_correlation(&[&missed], &[&input]).unwrap();
        let (lag, value) = found.largest(true).unwrap();
        assert_eq!(lag, 4);
        assert!(value > 0.4 && found.band < 0.06, "{value} {}", found.band);
        let unrelated = cross_correlation(&[&noise], &[&input]).unwrap();
        assert!(
            unrelated.outside(true) <= 0.06,
            "{}",
            unrelated.outside(true)
        );
    }

    #[test]
    fn slow_series_that_have_nothing_to_do_with_each_other_stay_in_bartletts_band() {
        let slow = |seed| {
            let mut kept = 0.0;
            let all = white(3000, seed).into_iter().map(|v| {
                kept = 0.95 * kept + v;
                kept
            });
            all.collect::<Vec<f64>>()
        };
        let outside: Vec<f64> = (0..20)
            .map(|k| {
                let found = cross_correlation(&[&slow(10 + k)], &[&slow(50 + k)]).unwrap();
                assert!(found.band > 2.0 * CROSS_BAND / 3000.0_f64.sqrt());
                found.outside(true)
            })
            .collect();
        let mean = outside.iter().sum::<f64>() / 20.0;
        assert!(mean < 0.1, "{mean}");
    }

    #[test]
    fn missing_samples_and_still_series_do_no_harm() {
        let mut series = white(500, 5);
        series[20] = f64::NAN;
        series[400] = f64::NAN;
        let found = autocorrelation(&[&series[..250], &series[250..]]).unwrap();
        assert!(found.values.iter().all(|v| v.is_finite()));
        assert!(autocorrelation(&[&[1.0; 500]]).is_none());
        assert!(autocorrelation(&[&[f64::NAN; 500]]).is_none());
        assert!(autocorrelation(&[]).is_none());
        assert!(cross_correlation(&[&series], &[&[0.0; 500]]).is_none());
    }
}
