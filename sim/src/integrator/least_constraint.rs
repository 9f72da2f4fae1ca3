//! Gauss's principle of least constraint for what is at rest together: of all reactions within
//! their holds the ones that leave the least acceleration along the paths
//! (docs/explanation/plant.md, eq. 6c).
//!
//! A convex quadratic in a box, so its minimum is where every reaction inside its hold stops its
//! path and every one at its hold opposes a path that goes its way. Found by descent over sets of
//! reactions inside their holds: the value never rises, so that no set comes twice but by rounding.

use super::dynamics::Dynamics;
use super::modes::{Mode, decide};
use super::sticking::{coupling, solve};
use crate::plant::topology::Topology;

/// Modes of the frictions `resting`: `Stick` inside the hold, `Slide` at its bound. The other
/// forces alone give the accelerations `wanted` along their paths.
pub(super) fn reactions(
    dynamics: &Dynamics<f64>,
    topology: &Topology,
    resting: &[usize],
    wanted: &[f64],
    holds: &[[f64; 2]],
) -> Vec<Mode> {
    let mut descent = Descent {
        dynamics,
        topology,
        resting,
        wanted,
        holds,
        modes: vec![Mode::Stick; resting.len()],
        reactions: holds.iter().map(start).collect(),
    };
    descent.release_negative();
    for _ in 0..8 * resting.len() + 8 {
        if descent.step_to_bound() && !descent.restore_worst() {
            break;
        }
    }
    descent.modes
}

/// No reaction, or what a hold that excludes that has nearest to it.
fn start(&[forward, backward]: &[f64; 2]) -> f64 {
    0.0f64.max(-backward).min(forward)
}

struct Descent<'a> {
    dynamics: &'a Dynamics<f64>,
    topology: &'a Topology,
    resting: &'a [usize],
    wanted: &'a [f64],
    holds: &'a [[f64; 2]],
    modes: Vec<Mode>,
    reactions: Vec<f64>,
}

impl Descent<'_> {
    /// A level below zero, which a fit may try, holds nothing and pushes out of rest.
    fn release_negative(&mut self) {
        let holds = |[forward, backward]: [f64; 2]| forward + backward >= 0.0;
        if self.holds.iter().all(|&hold| holds(hold)) {
            return;
        }
        let all = self.stopping_reactions(&self.held());
        for (k, force) in all.into_iter().enumerate() {
            if !holds(self.holds[k]) {
                self.set(k, decide(force, self.holds[k]));
            }
        }
    }

    fn set(&mut self, k: usize, mode: Mode) {
        self.modes[k] = mode;
        if let Mode::Slide(direction) = mode {
            let [forward, backward] = self.holds[k];
            self.reactions[k] = if direction > 0.0 { forward } else { -backward };
        }
    }

    fn held(&self) -> Vec<usize> {
        let held = |&k: &usize| self.modes[k] == Mode::Stick;
        (0..self.modes.len()).filter(held).collect()
    }

    /// The reactions of those that are held which stop their paths, the others staying.
    fn stopping_reactions(&self, held: &[usize]) -> Vec<f64> {
        let right = held.iter().map(|&k| {
            let others = (0..self.modes.len()).filter(|&j| self.modes[j] != Mode::Stick);
            self.wanted[k] - others.map(|j| self.cancelled_by(k, j)).sum::<f64>()
        });
        let right = right.collect();
        let paths: Vec<usize> = held.iter().map(|&k| self.resting[k]).collect();
        solve(self.dynamics, self.topology, &paths, right)
    }

    /// Part of the acceleration along the path of `k` that the reaction of `j` cancels.
    fn cancelled_by(&self, k: usize, j: usize) -> f64 {
        coupling(
            self.dynamics,
            self.topology,
            self.resting[k],
            self.resting[j],
        ) * self.reactions[j]
    }

    /// Goes towards the reactions that stop all that is held; as far as the first that comes to its
    /// hold, and that one gives way. Whether they were reached.
    fn step_to_bound(&mut self) -> bool {
        let held = self.held();
        let target = self.stopping_reactions(&held);
        let mut first: Option<(f64, usize, f64)> = None;
        for (&k, &target) in held.iter().zip(&target) {
            let (from, [forward, backward]) = (self.reactions[k], self.holds[k]);
            let (bound, direction) = match (target > forward, target < -backward) {
                (false, false) => continue,
                (true, _) => (forward, 1.0),
                (false, true) => (-backward, -1.0),
            };
            let share = (bound - from) / (target - from);
            if first.is_none_or(|(least, ..)| share < least) {
                first = Some((share, k, direction));
            }
        }
        let share = first.map_or(1.0, |(share, ..)| share);
        for (&k, &target) in held.iter().zip(&target) {
            self.reactions[k] += share * (target - self.reactions[k]);
        }
        if let Some((_, k, direction)) = first {
            self.set(k, Mode::Slide(direction));
        }
        first.is_none()
    }

    /// Holds the one again whose path goes most against the direction that it gives way to; whether
    /// there is one.
    fn restore_worst(&mut self) -> bool {
        let mut worst: Option<(f64, usize)> = None;
        for k in 0..self.modes.len() {
            let [forward, backward] = self.holds[k];
            let Mode::Slide(direction) = self.modes[k] else {
                continue;
            };
            if forward + backward < 0.0 {
                continue;
            }
            let (mut along, mut size) = (self.wanted[k], self.wanted[k].abs());
            for j in 0..self.modes.len() {
                let taken = self.cancelled_by(k, j);
                along -= taken;
                size += taken.abs();
            }
            let against = direction * along / size;
            if against < -1e-12 && worst.is_none_or(|(most, _)| against < most) {
                worst = Some((against, k));
            }
        }
        if let Some((_, k)) = worst {
            self.modes[k] = Mode::Stick;
        }
        worst.is_some()
    }
}
