//! Functions that several layers together compute: bounds, powers, quotients, activations without
//! a kernel of their own. Importers of all formats share them.

mod activations;
mod arithmetic;
mod arrangement;
mod bounds;
mod choice;
mod normalisation;
#[cfg(test)]
mod tests;

use crate::{Activation, Network, NetworkError, Op};
pub(in crate::import) use normalisation::Length;

impl Network {
    /// As [`Network::push`], with a number after the name where another layer has it.
    pub(in crate::import) fn append(
        &mut self,
        name: &str,
        op: Op,
        from: &[usize],
    ) -> Result<usize, NetworkError> {
        let taken = |name: &str| self.nodes.iter().any(|node| node.name == name);
        let mut free = name.to_owned();
        let mut number = 2;
        while taken(&free) {
            free = format!("{name} {number}");
            number += 1;
        }
        self.push(&free, op, from.to_vec())
    }

    /// An activation of node `x`.
    pub(super) fn apply(
        &mut self,
        name: &str,
        g: Activation,
        x: usize,
    ) -> Result<usize, NetworkError> {
        self.append(name, Op::Activation(g), &[x])
    }

    /// `gain x + offset`, the same for every value.
    pub(in crate::import) fn scaled(
        &mut self,
        name: &str,
        x: usize,
        gain: f32,
        offset: f32,
    ) -> Result<usize, NetworkError> {
        if gain == 1.0 && offset == 0.0 {
            return Ok(x);
        }
        let channels = self.nodes[x].shape.last().copied().unwrap_or(1);
        let (gain, offset) = (vec![gain; channels], vec![offset; channels]);
        self.append(name, Op::Scale { gain, offset }, &[x])
    }

    /// A gain and an offset for each value of the last axis, or for each value; the shape stays.
    pub(in crate::import) fn of_each(
        &mut self,
        name: &str,
        x: usize,
        gain: Vec<f32>,
        offset: Vec<f32>,
    ) -> Result<usize, NetworkError> {
        let held = self.nodes[x].shape.clone();
        if held.last() == Some(&gain.len()) {
            return self.append(name, Op::Scale { gain, offset }, &[x]);
        }
        let flat = self.reshaped(name, x, &[gain.len()])?;
        let scaled = self.append(name, Op::Scale { gain, offset }, &[flat])?;
        self.reshaped(name, scaled, &held)
    }

    /// The same values in another shape.
    pub(in crate::import) fn reshaped(
        &mut self,
        name: &str,
        x: usize,
        shape: &[usize],
    ) -> Result<usize, NetworkError> {
        if self.nodes[x].shape == shape {
            return Ok(x);
        }
        self.append(name, Op::Reshape(shape.to_vec()), &[x])
    }
}
