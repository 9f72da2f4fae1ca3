//! Bounds, absolute values, and the larger or smaller of two values.

use crate::{Activation, Network, NetworkError, Op};

impl Network {
    /// `min(max(x, low), high)`; where the bounds cross, the upper one holds.
    ///
    /// # Errors
    /// A bound is no number.
    pub(in crate::import) fn clipped(
        &mut self,
        name: &str,
        x: usize,
        low: f32,
        high: f32,
    ) -> Result<usize, NetworkError> {
        if low.is_nan() || high.is_nan() {
            let what = format!("a bound between {low} and {high}");
            return Err(NetworkError::unsupported(name, what, "use numbers"));
        }
        // Exporters write the ends of f32 for a bound that is not there.
        let low = if low == f32::MIN {
            f32::NEG_INFINITY
        } else {
            low
        };
        let high = if high == f32::MAX {
            f32::INFINITY
        } else {
            high
        };
        match (low, high) {
            (f32::NEG_INFINITY, f32::INFINITY) => Ok(x),
            (0.0, f32::INFINITY) => self.apply(name, Activation::Relu, x),
            (low, high) => {
                let low = low.min(high);
                self.apply(name, Activation::Clip { low, high }, x)
            }
        }
    }

    /// `|x|`, a leaky ReLU of slope -1.
    pub(in crate::import) fn absolute(
        &mut self,
        name: &str,
        x: usize,
    ) -> Result<usize, NetworkError> {
        self.apply(name, Activation::LeakyRelu { alpha: -1.0 }, x)
    }

    /// `max(a, b)`.
    pub(in crate::import) fn larger(
        &mut self,
        name: &str,
        a: usize,
        b: usize,
    ) -> Result<usize, NetworkError> {
        self.append(name, Op::Maximum, &[a, b])
    }

    /// `min(a, b)`.
    pub(in crate::import) fn smaller(
        &mut self,
        name: &str,
        a: usize,
        b: usize,
    ) -> Result<usize, NetworkError> {
        self.append(name, Op::Minimum, &[a, b])
    }

    /// `max(x, bounds)`, or `min` where not `largest`, with a bound for each value of the last axis
    /// or for each value.
    pub(in crate::import) fn bounded_each(
        &mut self,
        name: &str,
        x: usize,
        bounds: &[f32],
        largest: bool,
    ) -> Result<usize, NetworkError> {
        match bounds.first() {
            Some(&bound) if bounds.iter().all(|&other| other == bound) => {
                return if largest {
                    self.clipped(name, x, bound, f32::INFINITY)
                } else {
                    self.clipped(name, x, f32::NEG_INFINITY, bound)
                };
            }
            _ => {}
        }
        let other = self.of_each(name, x, vec![0.0; bounds.len()], bounds.to_vec())?;
        let op = if largest { Op::Maximum } else { Op::Minimum };
        self.append(name, op, &[x, other])
    }
}
