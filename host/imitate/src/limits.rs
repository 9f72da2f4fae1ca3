//! Limits of commands while a policy learns (docs/explanation/imitation.md, eq. 4).

/// Limits of commands: one entry an input, SI. On the chip the limits of `sinew-mpc` hold exactly.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Smallest command.
    pub lower: Vec<f64>,
    /// Largest command.
    pub upper: Vec<f64>,
    /// Largest change in one control period.
    pub rate: Vec<f64>,
    /// Command before the first step.
    pub safe: Vec<f64>,
}

/// What holds a command, for derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Held {
    /// Nothing: it follows what is asked.
    Free,
    /// The rate: it follows the last command.
    Rate,
    /// The box: it follows nothing.
    Box,
}

impl Limits {
    /// Largest change of each command that a policy counts in: its rate, or a twentieth of its box
    /// where it may jump.
    pub fn step(&self) -> Vec<f64> {
        let each = self.rate.iter().zip(self.lower.iter().zip(&self.upper));
        each.map(|(rate, (lower, upper))| {
            let jump = 0.05 * (upper - lower);
            match (rate.is_finite(), jump.is_finite()) {
                (true, true) => rate.min(20.0 * jump),
                (true, false) => *rate,
                (false, true) => jump,
                (false, false) => 1.0,
            }
        })
        .collect()
    }

    /// The nearest command of input `i`, and what holds it.
    pub(crate) fn limit(&self, i: usize, asked: f64, before: f64) -> (f64, Held) {
        let (low, high) = (before - self.rate[i], before + self.rate[i]);
        let boxed = asked.clamp(self.lower[i], self.upper[i]);
        if boxed < low {
            (low, Held::Rate)
        } else if boxed > high {
            (high, Held::Rate)
        } else if boxed == asked {
            (asked, Held::Free)
        } else {
            (boxed, Held::Box)
        }
    }
}
