//! Choices between values that meet where they change over.

use crate::{Activation, Network, NetworkError, Op};

/// Part of a function of `z`, with its factor.
enum Piece {
    /// `z`.
    Linear(f32),
    /// `exp(z) - 1`.
    Saturating(f32),
}

impl Network {
    /// `factor z`, `factor (exp(z) - 1)`, or neither, past scales of one gain.
    fn piece(&self, mut place: usize, z: usize) -> Option<Piece> {
        let mut factor = 1.0_f32;
        loop {
            if place == z {
                return Some(Piece::Linear(factor));
            }
            let node = &self.nodes[place];
            let from = node.from.first().copied()?;
            match &node.op {
                Op::Activation(Activation::Elu { alpha, scale }) if from == z => {
                    return (*alpha == 1.0).then_some(Piece::Saturating(factor * scale));
                }
                Op::Scale { gain, offset } => {
                    let (g, o) = (gain.first().copied()?, offset.first().copied()?);
                    let alike = gain.iter().all(|&other| other == g)
                        && offset.iter().all(|&other| other == o);
                    let exponential = self.nodes[from].op
                        == Op::Activation(Activation::Exponential)
                        && self.below(self.nodes[from].from[0], z);
                    if !alike {
                        return None;
                    }
                    if o == -g && exponential {
                        return Some(Piece::Saturating(factor * g));
                    }
                    if o != 0.0 {
                        return None;
                    }
                    factor *= g;
                    place = from;
                }
                // Past layers that leave every value where it is.
                Op::Reshape(_) => place = from,
                _ => return None,
            }
        }
    }

    /// True if `b` is a softplus of `z`, and `a` the line that it nears where `z` is large; both
    /// past a scale.
    pub(in crate::import) fn nears(&self, z: usize, a: usize, b: usize) -> bool {
        let scale = |place: usize| match &self.nodes[place].op {
            Op::Scale { gain, offset } if offset.iter().all(|&o| o == 0.0) => {
                let first = gain.first().copied()?;
                let alike = gain.iter().all(|&g| g == first);
                alike.then_some((self.nodes[place].from[0], first))
            }
            _ => None,
        };
        let (softplus, outer) = scale(b).unwrap_or((b, 1.0));
        let node = &self.nodes[softplus];
        if node.op != Op::Activation(Activation::Softplus) || node.from != [z] {
            return false;
        }
        let inner = match scale(z) {
            Some((x, inner)) if x == a => inner,
            _ if z == a => 1.0,
            _ => return false,
        };
        (inner * outer - 1.0).abs() < 1e-6
    }

    /// True if a node is `z`, or `min(z, 0)`.
    fn below(&self, place: usize, z: usize) -> bool {
        let negative = |place: usize| match &self.nodes[place].op {
            Op::Scale { gain, offset } => {
                gain.iter().all(|&g| g == -1.0) && offset.iter().all(|&o| o == 0.0)
            }
            _ => false,
        };
        if place == z {
            return true;
        }
        let (low, high) = (f32::NEG_INFINITY, 0.0);
        let held = Op::Activation(Activation::Clip { low, high });
        if self.nodes[place].op == held && self.nodes[place].from == [z] {
            return true;
        }
        let from = |place: usize| self.nodes[place].from.first().copied().unwrap_or(0);
        let cut = from(place);
        negative(place)
            && self.nodes[cut].op == Op::Activation(Activation::Relu)
            && negative(from(cut))
            && from(from(cut)) == z
    }

    /// `a` where `z` is positive and `b` elsewhere, of parts that meet at zero: linear ones, and
    /// `exp(z) - 1` below. No part is zero.
    ///
    /// # Errors
    /// The parts are others: a choice that jumps has no derivative.
    pub(in crate::import) fn piecewise(
        &mut self,
        name: &str,
        z: usize,
        [a, b]: [Option<usize>; 2],
    ) -> Result<usize, NetworkError> {
        let piece = |part: Option<usize>| match part {
            Some(part) => self.piece(part, z),
            None => Some(Piece::Linear(0.0)),
        };
        // An ELU is the identity where it is positive.
        let above = match piece(a) {
            Some(Piece::Linear(s)) => Some(s),
            Some(Piece::Saturating(s)) if a.is_some_and(|a| self.is_elu(a, z)) => Some(s),
            _ => None,
        };
        match (above, piece(b)) {
            (Some(0.0), Some(Piece::Linear(c))) => {
                let negative = self.scaled(name, z, -1.0, 0.0)?;
                let cut = self.apply(name, Activation::Relu, negative)?;
                self.scaled(name, cut, -c, 0.0)
            }
            (Some(s), Some(Piece::Linear(c))) => {
                let g = match c / s {
                    0.0 => Activation::Relu,
                    alpha => Activation::LeakyRelu { alpha },
                };
                let place = self.apply(name, g, z)?;
                self.scaled(name, place, s, 0.0)
            }
            (Some(scale), Some(Piece::Saturating(c))) if scale > 0.0 => {
                let alpha = c / scale;
                self.apply(name, Activation::Elu { alpha, scale }, z)
            }
            _ => Err(NetworkError::unsupported(
                name,
                "a choice by values, which may jump,",
                "choices by the sign of x between multiples of x and exp(x) - 1 work",
            )),
        }
    }

    /// True if a node is an ELU of `z`, past scales.
    fn is_elu(&self, mut place: usize, z: usize) -> bool {
        loop {
            let node = &self.nodes[place];
            match &node.op {
                Op::Activation(Activation::Elu { .. }) => return node.from == [z],
                Op::Scale { .. } | Op::Reshape(_) => place = node.from[0],
                _ => return false,
            }
        }
    }
}
