//! Time of an event on a step: a body stops or breaks away, a law changes its branch. Found on
//! values without derivatives, by stepping there.

use super::dynamics::Dynamics;
use super::modes::Mode;
use super::runge_kutta::{Scratch, Start};
use crate::plant::forces::Forces;
use crate::plant::topology::{Switch, Topology};
use crate::scalar::Scalar;

/// Event that ends a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event {
    /// A friction stops, turns or breaks away.
    Friction(usize),
    /// A law changes its branch.
    Switch(usize),
}

/// Distance of the end of the last step from leaving a mode: the speed in its direction while
/// something slides, the force to spare while it rests, the distance from the branch's border.
#[inline]
pub(super) fn margin<S: Scalar>(
    dynamics: &Dynamics<S>,
    topology: &Topology,
    event: Event,
    start: &Start<S>,
    tau: S,
    scratch: &mut Scratch<S>,
    forces: &mut Forces<S>,
) -> S {
    let at = dynamics.point(start, &scratch.end, tau);
    match event {
        Event::Friction(index) => match start.modes.friction[index] {
            Mode::Slide(direction) => {
                topology.frictions[index].speed(&dynamics.values, &scratch.end) * direction
            }
            // It goes on as long as the others on its path hold.
            Mode::Yield(_) => S::constant(f64::INFINITY),
            Mode::Stick => {
                topology.forces(&at, forces);
                let modes = &start.modes.friction;
                dynamics.accelerate(topology, &at, modes, forces, &mut scratch.last);
                scratch.last[index].margin()
            }
        },
        Event::Switch(index) => {
            if matches!(topology.switches[index], Switch::Load(..)) {
                topology.forces(&at, forces);
            }
            topology.margin(index, &at, &forces.load)
        }
    }
}

/// A step of plain numbers that can be taken to any length, to look for an event on it.
pub(super) struct Probe<'a> {
    pub(super) topology: &'a Topology,
    pub(super) dynamics: &'a Dynamics<f64>,
    pub(super) start: Start<'a, f64>,
    pub(super) scratch: &'a mut Scratch<f64>,
    pub(super) forces: &'a mut Forces<f64>,
}

impl Probe<'_> {
    /// The margin after a step of length `t`.
    pub(super) fn margin(&mut self, event: Event, t: f64) -> f64 {
        self.dynamics
            .step(self.topology, &self.start, t, self.scratch);
        let tau = self.start.tau + t;
        margin(
            self.dynamics,
            self.topology,
            event,
            &self.start,
            tau,
            self.scratch,
            self.forces,
        )
    }

    /// Rate of change of the margin at `t`, by a five-point difference (error about 1e-13).
    ///
    /// Of the margin as it is computed: the acceleration there would be the rate of the exact
    /// margin, which differs by the truncation error of the step, and so would the derivatives.
    pub(super) fn slope(&mut self, event: Event, t: f64, step: f64) -> f64 {
        let d = 0.01 * step;
        let mut difference = |d: f64| self.margin(event, t + d) - self.margin(event, t - d);
        (8.0 * difference(d) - difference(2.0 * d)) / (12.0 * d)
    }

    /// The time on (0, `within`] at which the margin turns negative, if it does: `within` is where
    /// it was seen negative. A margin that is negative from the start gives 0.
    pub(super) fn locate(&mut self, event: Event, within: f64) -> Option<f64> {
        let after = self.margin(event, within);
        if after >= 0.0 {
            return None;
        }
        let mut low = (0.0, self.margin(event, 0.0));
        if low.1 <= 0.0 {
            // A body that has just begun to slide begins with no margin: look for where it has
            // some.
            let mut t = within;
            for _ in 0..30 {
                t *= 0.5;
                let margin = self.margin(event, t);
                if margin > 0.0 {
                    low = (t, margin);
                    break;
                }
            }
            if low.1 <= 0.0 {
                return Some(0.0);
            }
        }
        Some(self.bisect(event, low, (within, after), within))
    }

    /// The Illinois method: false position that halves the weight of an end which stays, with a
    /// bisection every third time as the guarantee. Returns the end at which the event has
    /// happened.
    fn bisect(&mut self, event: Event, low: (f64, f64), high: (f64, f64), scale: f64) -> f64 {
        let ((mut a, mut fa), (mut b, mut fb)) = (low, high);
        let mut side = 0;
        for round in 1..=120 {
            if b - a <= 4.0 * f64::EPSILON * scale {
                break;
            }
            let chord = b - fb * (b - a) / (fb - fa);
            let inside = a < chord && chord < b && round % 3 != 0;
            let t = if inside { chord } else { 0.5 * (a + b) };
            let margin = self.margin(event, t);
            if margin == 0.0 {
                return t;
            }
            if margin > 0.0 {
                (a, fa) = (t, margin);
                if side == 1 {
                    fb *= 0.5;
                }
                side = 1;
            } else {
                (b, fb) = (t, margin);
                if side == -1 {
                    fa *= 0.5;
                }
                side = -1;
            }
        }
        b
    }
}

/// Place in the unit interval of a negative inner minimum of the cubic with these end values and
/// end slopes: a speed that dips through zero and comes back within one step.
pub(super) fn dip(start: f64, end: f64, slope_start: f64, slope_end: f64) -> Option<f64> {
    if !(slope_start < 0.0 && slope_end > 0.0) {
        return None;
    }
    let difference = end - start;
    let c2 = 3.0 * difference - 2.0 * slope_start - slope_end;
    let c3 = slope_start + slope_end - 2.0 * difference;
    // p'(s) = slope_start + 2 c2 s + 3 c3 s^2, negative at 0 and positive at 1: one root between.
    // The form that does not cancel: slope_start < 0 and the root is where p' rises.
    let root = crate::math::sqrt((c2 * c2 - 3.0 * c3 * slope_start).max(0.0));
    let s = if c2 >= 0.0 {
        -slope_start / (c2 + root)
    } else {
        (root - c2) / (3.0 * c3)
    };
    let value = start + s * (slope_start + s * (c2 + s * c3));
    (s > 0.0 && s < 1.0 && value < 0.0).then_some(s)
}

#[cfg(test)]
mod tests {
    use super::dip;

    #[test]
    fn a_dip_is_seen_where_it_is_deepest() {
        // p(s) = (s - 0.3)(s - 0.6): deepest at 0.45.
        let deepest = dip(0.18, 0.28, -0.9, 1.1);
        assert!(
            deepest.is_some_and(|s| (s - 0.45).abs() < 1e-12),
            "{deepest:?}"
        );
        assert_eq!(dip(0.5, 0.6, -0.9, 1.1), None);
        assert_eq!(dip(0.18, 0.28, 0.9, 1.1), None);
        // A cubic with a negative c2: p = 4 s^3 - 3 s^2 ... has its minimum where its slope rises.
        let (start, end) = (0.1, 0.2);
        if let Some(s) = dip(start, end, -3.0, 0.5) {
            assert!(s > 0.0 && s < 1.0);
        }
    }
}
