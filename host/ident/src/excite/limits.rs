//! Inside the limits and rate limits of an actuator, to the last bit.

use sinew_sim::Input;

/// Nobody's actuator notices a billionth, and rounding on the way through a file is far smaller:
/// what is kept clear of a limit so that it holds exactly after a change of units.
const CLEARANCE: f64 = 1e-9;

/// Limits of an input, SI.
pub(super) struct Bounds {
    low: f64,
    high: f64,
    rate: f64,
}

impl Bounds {
    /// A fraction of an actuator's range, about its middle; `limit` is that range.
    pub(super) fn of(input: &Input, (low, high): (f64, f64), fraction: f64) -> Self {
        let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
        let reach = half * fraction * (1.0 - CLEARANCE);
        Self {
            low: middle - reach,
            high: middle + reach,
            rate: input.rate_limit.unwrap_or(f64::INFINITY) * (1.0 - CLEARANCE),
        }
    }

    /// Normalised signal of no input, or of the limit that is nearest to it.
    pub(super) fn normalised_zero(&self) -> f64 {
        let (middle, half) = ((self.low + self.high) / 2.0, (self.high - self.low) / 2.0);
        if half > 0.0 {
            (0.0f64.clamp(self.low, self.high) - middle) / half
        } else {
            0.0
        }
    }

    /// A normalised signal, in -1 to 1, brought to the range and followed as fast as the rate
    /// limit allows. Begins at zero or as near to it as the range comes: where a rig at rest is.
    pub(super) fn keep(&self, t: &[f64], signal: &[f64]) -> Vec<f64> {
        let (middle, half) = ((self.low + self.high) / 2.0, (self.high - self.low) / 2.0);
        let mut u = 0.0f64.clamp(self.low, self.high);
        let mut last = t.first().copied().unwrap_or(0.0);
        let mut kept = Vec::with_capacity(t.len());
        for (&t, value) in t.iter().zip(signal) {
            let change = self.rate * (t - last);
            let wanted = middle + half * value;
            // The first row is where it starts; a signal elsewhere is followed from the second on.
            if kept.is_empty() {
                kept.push(u);
                continue;
            }
            u = wanted
                .clamp(u - change, u + change)
                .clamp(self.low, self.high);
            kept.push(u);
            last = t;
        }
        kept
    }
}
