//! Differences, quotients and powers.

use crate::{Activation, Network, NetworkError, Op};

/// The largest integer power, which takes a product less.
const MAX_POWER: u32 = 8;

impl Network {
    /// `a - b`.
    pub(in crate::import) fn difference(
        &mut self,
        name: &str,
        a: usize,
        b: usize,
    ) -> Result<usize, NetworkError> {
        let negative = self.scaled(name, b, -1.0, 0.0)?;
        self.append(name, Op::Add, &[a, negative])
    }

    /// `a / b`.
    pub(in crate::import) fn quotient(
        &mut self,
        name: &str,
        a: usize,
        b: usize,
    ) -> Result<usize, NetworkError> {
        let inverse = self.apply(name, Activation::Reciprocal, b)?;
        self.append(name, Op::Multiply, &[a, inverse])
    }

    /// `x^exponent` for integers up to 8, halves between them, and their negatives.
    ///
    /// # Errors
    /// Another exponent.
    pub(in crate::import) fn power(
        &mut self,
        name: &str,
        x: usize,
        exponent: f32,
    ) -> Result<usize, NetworkError> {
        let size = exponent.abs();
        let (whole, half) = (size.trunc() as u32, size.fract());
        if ![0.0, 0.5].contains(&half) || whole > MAX_POWER || size == 0.0 {
            return Err(NetworkError::unsupported(
                name,
                format!("a power of {exponent}"),
                format!("integers up to {MAX_POWER}, halves between and their negatives work"),
            ));
        }
        let mut place = None;
        if half != 0.0 {
            place = Some(self.apply(name, Activation::Root, x)?);
        }
        // From the highest bit down: squared, and multiplied by x where the bit is set.
        let mut product = None;
        for bit in (0..u32::BITS - whole.leading_zeros()).rev() {
            if let Some(before) = product {
                product = Some(self.append(name, Op::Multiply, &[before, before])?);
            }
            if whole >> bit & 1 == 1 {
                product = Some(match product {
                    Some(before) => self.append(name, Op::Multiply, &[before, x])?,
                    None => x,
                });
            }
        }
        let place = match (place, product) {
            (Some(root), Some(product)) => self.append(name, Op::Multiply, &[product, root])?,
            (one, other) => one.or(other).unwrap_or(x),
        };
        if exponent < 0.0 {
            return self.apply(name, Activation::Reciprocal, place);
        }
        Ok(place)
    }
}
