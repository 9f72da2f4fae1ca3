//! Student's t.

/// Probability that the size of a value of Student's t with `freedom` degrees of freedom exceeds
/// `size` (Abramowitz and Stegun, 26.7.3 and 26.7.4).
pub(super) fn exceeding(size: f64, freedom: usize) -> f64 {
    let angle = (size / (freedom as f64).sqrt()).atan();
    let (sine, cosine) = angle.sin_cos();
    let odd = freedom % 2 == 1;
    let (mut term, mut sum) = (if odd { cosine } else { 1.0 }, 0.0);
    let mut power = if odd { 1 } else { 0 };
    while power + 2 <= freedom {
        sum += term;
        power += 2;
        term *= cosine * cosine * (power - 1) as f64 / power as f64;
    }
    let within = if odd {
        (angle + sine * sum) * std::f64::consts::FRAC_2_PI
    } else {
        sine * sum
    };
    (1.0 - within).max(0.0)
}

/// Value of Student's t that a share of all values, between 0 and 1, does not exceed.
pub(super) fn quantile(share: f64, freedom: usize) -> f64 {
    let tail = 2.0 * share.min(1.0 - share);
    let (mut low, mut high) = (0.0, 1.0);
    while exceeding(high, freedom) > tail && high < LARGEST {
        high *= 2.0;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if exceeding(middle, freedom) > tail {
            low = middle;
        } else {
            high = middle;
        }
    }
    high.copysign(share - 0.5)
}

/// Largest quantile that is looked for.
const LARGEST: f64 = 1e9;

/// Halvings of the interval that holds a quantile: to the last bit.
const HALVINGS: usize = 90;

#[cfg(test)]
mod tests {
    use super::{exceeding, quantile};

    #[test]
    fn quantiles_agree_with_tables() {
        for (share, freedom, value) in [
            (0.975, 1, 12.706),
            (0.025, 4, -2.776),
            (0.5, 7, 0.0),
            (0.95, 10, 1.812),
            (0.975, 100_000, 1.960),
        ] {
            let found = quantile(share, freedom);
            assert!((found - value).abs() < 1e-3, "{share} {freedom}: {found}");
        }
    }

    #[test]
    fn tails_agree_with_tables() {
        for (size, freedom, tail) in [
            (1.0, 1, 0.5),
            (12.706, 1, 0.05),
            (4.303, 2, 0.05),
            (3.182, 3, 0.05),
            (2.776, 4, 0.05),
            (2.571, 5, 0.05),
            (2.228, 10, 0.05),
            (3.106, 11, 0.01),
            (1.960, 100_000, 0.05),
        ] {
            let found = exceeding(size, freedom);
            assert!(
                (found / tail - 1.0).abs() < 2e-3,
                "{size} {freedom}: {found}"
            );
        }
    }
}
