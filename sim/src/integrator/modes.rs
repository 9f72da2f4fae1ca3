//! Modes of dry friction and branches of laws, and the rule for what is at rest.

use crate::scalar::Scalar;

/// Mode of a dry friction during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mode {
    /// Rests: velocity and acceleration along its path exactly zero.
    Stick,
    /// Rests because others on its path do, and opposes this direction with all that it has.
    Yield(f64),
    /// Slides in this direction, +1 or -1.
    Slide(f64),
}

/// Modes and branches, held during a step.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Modes {
    /// One entry a friction.
    pub(super) friction: Vec<Mode>,
    /// One entry a switch.
    pub(super) branches: Vec<i8>,
}

/// The force that a resting friction opposes and how much it can, forward and backward.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held<S> {
    pub(super) force: S,
    pub(super) hold: [S; 2],
}

impl<S: Scalar> Held<S> {
    pub(super) const NOTHING: Self = Self {
        force: S::ZERO,
        hold: [S::ZERO; 2],
    };

    /// Force to spare.
    pub(super) fn margin(&self) -> S {
        (self.hold[0] - self.force).min(self.force + self.hold[1])
    }
}

/// Mode of a body at rest (eq. 6): held while the other force stays within the hold of its
/// friction, else sliding in the direction of the excess.
pub(super) fn decide(force: f64, [forward, backward]: [f64; 2]) -> Mode {
    match (force > forward, force < -backward) {
        (false, false) => Mode::Stick,
        (true, false) => Mode::Slide(1.0),
        (false, true) => Mode::Slide(-1.0),
        // Only a negative friction, which a fit may try, pushes out of rest both ways.
        (true, true) if 2.0 * force >= forward - backward => Mode::Slide(1.0),
        (true, true) => Mode::Slide(-1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::{Mode, decide};

    #[test]
    fn rest_is_kept_up_to_the_level_and_left_beyond_it() {
        let hold = [2.0, 3.0];
        assert_eq!(decide(2.0, hold), Mode::Stick);
        assert_eq!(decide(-3.0, hold), Mode::Stick);
        assert_eq!(decide(2.0 + 1e-15, hold), Mode::Slide(1.0));
        assert_eq!(decide(-3.0 - 1e-15, hold), Mode::Slide(-1.0));
    }

    #[test]
    fn a_negative_level_leaves_rest_with_the_force() {
        assert_eq!(decide(0.5, [-1.0, -1.0]), Mode::Slide(1.0));
        assert_eq!(decide(-0.5, [-1.0, -1.0]), Mode::Slide(-1.0));
    }
}
