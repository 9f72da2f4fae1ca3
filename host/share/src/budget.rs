//! Privacy budget: (epsilon, delta) as zero-concentrated privacy, and the noise that it takes
//! (docs/explanation/sharing.md, eq. 5 and 6).

use sinew_ident::error::{Error, Result};

/// A budget of differential privacy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Largest logarithm of a ratio of probabilities.
    pub epsilon: f64,
    /// Probability with which that bound may fail.
    pub delta: f64,
}

/// Range of epsilon that is taken: below, any fleet is too small; above, it promises nothing.
const EPSILON: std::ops::RangeInclusive<f64> = 0.01..=20.0;

impl Budget {
    /// Refuses a budget that promises nothing to one of so many devices.
    ///
    /// # Errors
    /// `Arguments` for an epsilon that is not in 0.01 to 20, and for a delta that is not above 0
    /// and below one in ten times the devices: one device in full, with that chance, meets a delta
    /// of one in their number.
    pub fn check(&self, devices: usize) -> Result<()> {
        if !EPSILON.contains(&self.epsilon) {
            let (low, high) = (EPSILON.start(), EPSILON.end());
            return Err(
                Error::must_be("--epsilon", format!("in [{low}, {high}]"), self.epsilon)
                    .help("for example --epsilon 2; less is more private and takes more devices"),
            );
        }
        let most = 0.1 / devices.max(1) as f64;
        if !(self.delta > 1e-15 && self.delta < most) {
            let expectation = format!("above 1e-15 and below {most:e}, a tenth of 1 / devices");
            return Err(
                Error::must_be("--delta", expectation, self.delta).help("for example --delta 1e-6")
            );
        }
        Ok(())
    }

    /// Largest rho of zero-concentrated privacy that gives this budget (eq. 5), found from below.
    pub fn rho(&self) -> f64 {
        let (mut low, mut high) = (0.0, self.epsilon);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if delta_of(middle, self.epsilon) <= self.delta {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// Variance of the noise on each whole number of a vector of this sensitivity: the least whole
    /// number that gives the budget (eq. 6).
    pub fn variance(&self, sensitivity: f64) -> u64 {
        // The margin is a million times what rounding could take.
        (sensitivity * sensitivity / (2.0 * self.rho()) * (1.0 + 1e-9)).ceil() as u64
    }

    /// Largest difference between the share of members and the share of others that any test finds
    /// to be members (eq. 7).
    pub fn most_advantage(&self) -> f64 {
        let odds = self.epsilon.exp();
        (odds - 1.0 + 2.0 * self.delta) / (odds + 1.0)
    }
}

/// Smallest delta with epsilon that eq. 5 gives for zero-concentrated privacy rho. Every order
/// alpha gives a valid one, so a coarse search errs towards safety.
fn delta_of(rho: f64, epsilon: f64) -> f64 {
    let orders = (0..=600).map(|k| 1.0 + 10f64.powf(-4.0 + f64::from(k) * 0.016));
    let log_delta = |alpha: f64| {
        (alpha - 1.0) * (alpha * rho - epsilon) + (alpha - 1.0) * (-alpha.recip()).ln_1p()
            - alpha.ln()
    };
    orders.map(log_delta).fold(0.0, f64::min).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Upper tail of the normal distribution by Simpson's rule.
    fn tail(x: f64) -> f64 {
        let density = |t: f64| (-0.5 * t * t).exp() / std::f64::consts::TAU.sqrt();
        let (rows, end) = (4000, x.max(0.0) + 12.0);
        let step = (end - x) / f64::from(rows);
        let weight = |k: i32| match k {
            0 => 1.0,
            k if k == rows => 1.0,
            k if k % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let terms = (0..=rows).map(|k| weight(k) * density(x + f64::from(k) * step));
        terms.sum::<f64>() * step / 3.0
    }

    #[test]
    fn noise_is_never_less_than_the_exact_gaussian_needs_nor_much_more() {
        for (epsilon, delta) in [
            (0.1, 1e-6),
            (1.0, 1e-5),
            (2.0, 1e-6),
            (4.0, 1e-5),
            (8.0, 1e-8),
        ] {
            let rho = Budget { epsilon, delta }.rho();
            // Balle and Wang 2018, theorem 8, at sensitivity 1.
            let exact = |sigma: f64| {
                let (a, b) = (0.5 / sigma, epsilon * sigma);
                tail(b - a) - f64::exp(epsilon) * tail(b + a)
            };
            let sigma = (0.5 / rho).sqrt();
            assert!(exact(sigma) <= delta, "{epsilon} {delta}: {}", exact(sigma));
            assert!(exact(0.85 * sigma) > delta, "{epsilon} {delta}: wasteful");
        }
    }

    #[test]
    fn the_simple_bound_of_bun_and_steinke_is_beaten() {
        let (epsilon, delta) = (1.0, 1e-5);
        let rho = Budget { epsilon, delta }.rho();
        let simple = rho + 2.0 * (rho * f64::ln(1.0 / delta)).sqrt();
        assert!(simple > epsilon, "{simple}");
    }

    #[test]
    fn budgets_that_promise_nothing_are_refused() {
        let of = |epsilon, delta| Budget { epsilon, delta };
        assert!(of(1.0, 1e-6).check(100).is_ok());
        for (bad, devices) in [
            (of(0.0, 1e-6), 100),
            (of(f64::NAN, 1e-6), 100),
            (of(50.0, 1e-6), 100),
            (of(1.0, 0.0), 100),
            (of(1.0, 1e-3), 100),
        ] {
            assert!(bad.check(devices).is_err(), "{bad:?}");
        }
    }
}
