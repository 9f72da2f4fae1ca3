//! Positions of points and the fields there: chains, plates, dipoles, zipping pouches. Pure
//! functions over any [`Scalar`]; the equations are in docs/explanation/geometry.md.

pub(crate) mod chain;
pub(crate) mod dipole;
pub(crate) mod plate;
pub(crate) mod zip;

use crate::scalar::Scalar;

/// A vector, or a point, in the world: m, T, whatever it is of.
pub(crate) type Vector<S> = [S; 3];

/// Position and rotation: `world = origin + turn * own`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pose<S> {
    pub(crate) origin: Vector<S>,
    /// Rows of the rotation matrix.
    pub(crate) turn: [Vector<S>; 3],
}

impl<S: Scalar> Pose<S> {
    /// The world itself.
    pub(crate) fn world() -> Self {
        let (zero, one) = (S::ZERO, S::constant(1.0));
        Self {
            origin: [zero; 3],
            turn: [[one, zero, zero], [zero, one, zero], [zero, zero, one]],
        }
    }

    /// A direction of its own, seen from the world.
    pub(crate) fn direction(&self, own: Vector<S>) -> Vector<S> {
        self.turn
            .map(|row| row[0] * own[0] + row[1] * own[1] + row[2] * own[2])
    }

    /// A point of its own, seen from the world.
    pub(crate) fn point(&self, own: Vector<S>) -> Vector<S> {
        sum(self.origin, self.direction(own))
    }

    /// The pose that `next` describes from here.
    pub(crate) fn then(&self, next: &Self) -> Self {
        let column = |k: usize| self.direction([next.turn[0][k], next.turn[1][k], next.turn[2][k]]);
        let [a, b, c] = [column(0), column(1), column(2)];
        Self {
            origin: self.point(next.origin),
            turn: [[a[0], b[0], c[0]], [a[1], b[1], c[1]], [a[2], b[2], c[2]]],
        }
    }
}

pub(crate) fn sum<S: Scalar>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
