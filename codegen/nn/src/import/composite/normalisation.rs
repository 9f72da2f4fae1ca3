//! Normalisation of runs of values by their length or by the moments of a group.

use crate::{Activation, Network, NetworkError, Op, Pool, PoolKind, Window};

/// Divisor of a run of values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::import) enum Length {
    /// The root of the mean of the squares and this.
    Mean(f32),
    /// The root of the sum of the squares, which is at least this.
    Sum(f32),
}

impl Network {
    /// Each run of `run` values divided by its length; the shape stays.
    ///
    /// # Errors
    /// There are more values than can be repeated.
    pub(in crate::import) fn by_length(
        &mut self,
        name: &str,
        x: usize,
        run: usize,
        length: Length,
    ) -> Result<usize, NetworkError> {
        let held = self.nodes[x].shape.clone();
        let rows = self.nodes[x].len().checked_div(run).unwrap_or(0);
        let flat = self.reshaped(name, x, &[rows, run, 1])?;
        let square = self.append(name, Op::Multiply, &[flat, flat])?;
        let mean = self.mean_of_rows(name, square, run)?;
        let held_above = match length {
            Length::Mean(epsilon) => self.scaled(name, mean, 1.0, epsilon)?,
            Length::Sum(least) => {
                let sum = self.scaled(name, mean, run as f32, 0.0)?;
                self.clipped(name, sum, least, f32::INFINITY)?
            }
        };
        let root = self.apply(name, Activation::Root, held_above)?;
        let inverse = self.apply(name, Activation::Reciprocal, root)?;
        let inverse = self.spread(name, inverse, &[rows, run, 1])?;
        let product = self.append(name, Op::Multiply, &[flat, inverse])?;
        self.reshaped(name, product, &held)
    }

    /// The mean of each row of `[rows, run, 1]`, as `[rows, 1, 1]`.
    fn mean_of_rows(&mut self, name: &str, x: usize, run: usize) -> Result<usize, NetworkError> {
        let window = Window {
            size: [1, run],
            stride: [1; 2],
            dilation: [1; 2],
            before: [0; 2],
            after: [0; 2],
        };
        let kind = PoolKind::Average;
        self.append(name, Op::Pool(Pool { window, kind }), &[x])
    }

    /// Each group of channels, all its places together, by its own mean and variance; channels are
    /// the last axis, and the shape stays.
    ///
    /// # Errors
    /// The channels do not divide into groups.
    pub(in crate::import) fn grouped(
        &mut self,
        name: &str,
        x: usize,
        groups: usize,
        epsilon: f32,
    ) -> Result<usize, NetworkError> {
        let held = self.nodes[x].shape.clone();
        let channels = held.last().copied().unwrap_or(0);
        if groups == 0 || !channels.is_multiple_of(groups) {
            let message = format!("{channels} channels in {groups} groups");
            return Err(NetworkError::malformed(name, message));
        }
        let (own, places) = (channels / groups, self.nodes[x].len() / channels);
        let turn = |network: &mut Self, x: usize, shape: [usize; 3]| {
            let x = network.reshaped(name, x, &shape)?;
            network.append(name, Op::Permute(vec![1, 0, 2]), &[x])
        };
        let together = turn(self, x, [places, groups, own])?;
        let rows = self.reshaped(name, together, &[groups, places * own])?;
        let normal = self.append(name, Op::Normalise { epsilon }, &[rows])?;
        let apart = turn(self, normal, [groups, places, own])?;
        self.reshaped(name, apart, &held)
    }

    /// A gain and an offset for each channel, the last axis.
    ///
    /// # Errors
    /// Not as many numbers as channels.
    pub(in crate::import) fn by_channel(
        &mut self,
        name: &str,
        x: usize,
        gain: Vec<f32>,
        offset: Vec<f32>,
    ) -> Result<usize, NetworkError> {
        let channels = self.nodes[x].shape.last().copied().unwrap_or(0);
        let idle = gain.iter().all(|&gain| gain == 1.0) && offset.iter().all(|&o| o == 0.0);
        if idle && gain.len() == channels {
            return Ok(x);
        }
        self.append(name, Op::Scale { gain, offset }, &[x])
    }
}
