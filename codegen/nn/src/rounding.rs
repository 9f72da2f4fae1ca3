//! Rounding that a framework does between layers and that networks here do not: values there are
//! floating point.

use std::fmt;

use super::{Network, evaluate};

/// Inputs that are drawn to see what rounding changes.
const DRAWN: usize = 64;
/// Largest input that is drawn where the file says none.
const REACH: f64 = 1.0;

/// Values between layers that a framework rounds to integers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rounding {
    /// Bits of an integer.
    pub bits: u32,
    /// Smallest and largest input that the integers hold; none where the scale follows the values.
    pub input: Option<[f64; 2]>,
}

impl Rounding {
    /// Largest difference of an output, as a part of the range of all outputs, where the values of
    /// every layer are rounded to a step of their largest, `max |v| / (2^(bits - 1) - 1)`: the
    /// largest for all inputs where the file states the scale, else of each input.
    ///
    /// # Panics
    /// If an input has not the network's length.
    #[must_use]
    pub fn loss(&self, network: &Network, inputs: &[Vec<f64>]) -> f64 {
        let levels = f64::from((1_u32 << (self.bits.clamp(2, 31) - 1)) - 1);
        let size = |values: &[f64]| values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        let mut sizes = vec![0.0_f64; network.nodes.len()];
        let stated = self.input.is_some();
        for x in inputs.iter().filter(|_| stated) {
            evaluate::run_through(network, x, &mut |place, values| {
                sizes[place] = sizes[place].max(size(values));
            });
        }
        let mut round = |place: usize, values: &mut [f64]| {
            let most = if stated { sizes[place] } else { size(values) };
            let step = most / levels;
            if step > 0.0 {
                values
                    .iter_mut()
                    .for_each(|v| *v = (*v / step).round() * step);
            }
        };
        let (mut low, mut high, mut largest) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
        for x in inputs {
            let exact = evaluate::run(network, x);
            let rounded = evaluate::run_through(network, x, &mut round);
            for (a, b) in exact.into_iter().zip(rounded) {
                (low, high) = (low.min(a), high.max(a));
                largest = largest.max((a - b).abs());
            }
        }
        largest / (high - low).max(f64::MIN_POSITIVE)
    }

    /// As [`Self::loss`], for drawn inputs of a valid network.
    #[must_use]
    pub fn drawn_loss(&self, network: &Network) -> f64 {
        let [low, high] = self.input.unwrap_or([-REACH, REACH]);
        let mut state = 0x2545_f491_4f6c_dd1d_u64;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            low + (high - low) * (state >> 40) as f64 / f64::from(1_u32 << 24)
        };
        let one = |_| (0..network.inputs()).map(|_| next()).collect();
        let inputs: Vec<Vec<f64>> = (0..DRAWN).map(one).collect();
        self.loss(network, &inputs)
    }
}

impl fmt::Display for Rounding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bits = self.bits;
        write!(
            f,
            "its framework rounds values between layers to {bits}-bit integers; here they are \
             floating point"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Dense, Op};

    fn twice() -> Network {
        let mut network = Network::new("twice", "x", vec![2]);
        let dense = Dense {
            weights: vec![2.0, 0.0, 0.0, 1.0],
            bias: vec![0.0; 2],
        };
        let pushed = network.push("twice", Op::Dense(dense), vec![0]);
        assert_eq!(pushed, Ok(1));
        network
    }

    #[test]
    fn rounding_moves_an_output_by_a_step_of_the_largest_value() {
        let network = twice();
        let eight = Rounding {
            bits: 8,
            input: None,
        };
        // 0.013 of 1 is 1.651 of 127 steps: rounded to 2, 0.35 steps of 1/127 off, then to 1 of
        // 2/127.
        let found = eight.loss(&network, &[vec![1.0, 0.013]]);
        let range = 2.0 - 0.013;
        let exact = (2.0 / 127.0 - 0.013) / range;
        assert!((found - exact).abs() < 1e-12, "{found} {exact}");
        let sixteen = Rounding { bits: 16, ..eight };
        assert!(sixteen.drawn_loss(&network) < 2e-4);
        assert!(eight.drawn_loss(&network) > 2e-3);
    }
}
