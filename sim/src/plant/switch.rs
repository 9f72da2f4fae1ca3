//! The branches of laws that have kinks and jumps, and how far a state is from leaving one.

use super::forces::{Forces, Point, not_below_zero};
use super::topology::{Gap, Switch, Topology};
use crate::effects::press;
use crate::scalar::Scalar;

impl Topology {
    /// Distance of the state from leaving the branch: zero or more while it is right. `forces` are
    /// those at the point, for switches that follow a load.
    #[inline]
    pub(crate) fn margin<S: Scalar>(&self, index: usize, at: &Point<S>, load: &[S]) -> S {
        let branch = at.branches[index];
        let one_sided = |x: S| if branch > 0 { x } else { -x };
        let banded = |x: S, width: S| match branch {
            0 => (width * 0.5 - x).min(width * 0.5 + x),
            1 => x - width * 0.5,
            _ => -x - width * 0.5,
        };
        match self.switches[index] {
            Switch::Slack(tendon) => one_sided(self.tendons[tendon].free_tension(self, at)),
            switch @ (Switch::SpringGap(_)
            | Switch::TendonGap(_)
            | Switch::LoopBand(_)
            | Switch::LoopLimit(_)) => {
                let (x, width) = self.band(switch, at);
                banded(x, width)
            }
            Switch::Stop(stop) => {
                let (depth, force) = self.contact(stop, at);
                match branch {
                    0 => -depth,
                    // With a damper the force falls to zero before the depth does, without one with
                    // it.
                    1 if at.values[self.stops[stop].slot + 2].value() >= 0.0 => force,
                    1 => force.min(depth),
                    _ => (-force).min(depth),
                }
            }
            Switch::Velocity(body) => one_sided(at.state.v[body]),
            Switch::SpringRate(spring) => one_sided(self.springs[spring].speed(at.state)),
            Switch::Internal(state) => one_sided(at.state.z[state]),
            switch @ Switch::Yield { spring, .. } => match branch {
                0 => {
                    let (z, width) = self.band(switch, at);
                    banded(z, width)
                }
                _ => one_sided(self.springs[spring].speed(at.state)),
            },
            Switch::Load(friction, follow) => {
                one_sided(load[self.frictions[friction].follows[follow].index])
            }
        }
    }

    /// Quantity of a switch that has a band around zero, and the width of that band, not below
    /// zero.
    #[inline]
    fn band<S: Scalar>(&self, switch: Switch, at: &Point<S>) -> (S, S) {
        let width = |gap: Option<Gap>| {
            let width = gap.map_or(S::ZERO, |gap| at.values[gap.slot]);
            not_below_zero(width)
        };
        let servo = |line: usize| self.lines[line].servo;
        match switch {
            Switch::SpringGap(spring) => {
                let spring = &self.springs[spring];
                (spring.extension(at.values, at.state), width(spring.gap))
            }
            Switch::TendonGap(tendon) => {
                let tendon = &self.tendons[tendon];
                (tendon.elastic(self, at), tendon.band(at.values))
            }
            Switch::LoopBand(line) => {
                let half = width(servo(line).and_then(|servo| servo.dead_band));
                (self.loop_error(line, at), half * 2.0)
            }
            Switch::LoopLimit(line) => {
                let half = width(servo(line).and_then(|servo| servo.limit));
                (self.free_loop(line, at), half * 2.0)
            }
            Switch::Yield { slot, state, .. } => {
                (at.state.z[state], not_below_zero(at.values[slot + 1]) * 2.0)
            }
            _ => (S::ZERO, S::ZERO),
        }
    }

    /// Depth in a stop, and the force that it would answer with if it could pull.
    fn contact<S: Scalar>(&self, stop: usize, at: &Point<S>) -> (S, S) {
        let stop = &self.stops[stop];
        let (depth, rate) = self.depth(stop.body, stop.slot, at);
        let p = &at.values[stop.slot..];
        (depth, press(p[1], p[2], depth, rate))
    }

    /// The branch that a state belongs to, whatever it was in. At a border it is the one that the
    /// rates lead to where that is known, else the positive one.
    pub(crate) fn branch<S: Scalar>(&self, index: usize, at: &Point<S>, load: &[S]) -> i8 {
        let sign = |x: S| if x.value() < 0.0 { -1 } else { 1 };
        match self.switches[index] {
            Switch::Slack(tendon) => {
                i8::from(self.tendons[tendon].free_tension(self, at).value() > 0.0)
            }
            switch @ (Switch::SpringGap(_)
            | Switch::TendonGap(_)
            | Switch::LoopBand(_)
            | Switch::LoopLimit(_)) => {
                let (x, width) = self.band(switch, at);
                let half = 0.5 * width.value();
                match x.value() {
                    x if x > half => 1,
                    x if x < -half => -1,
                    _ => 0,
                }
            }
            Switch::Stop(stop) => {
                let (depth, force) = self.contact(stop, at);
                match (depth.value() > 0.0, force.value() > 0.0) {
                    (false, _) => 0,
                    (true, true) => 1,
                    (true, false) => 2,
                }
            }
            Switch::Velocity(body) => sign(at.state.v[body]),
            Switch::SpringRate(spring) => sign(self.springs[spring].speed(at.state)),
            Switch::Internal(state) => sign(at.state.z[state]),
            switch @ Switch::Yield { spring, .. } => {
                let (z, width) = self.band(switch, at);
                let side = sign(z);
                let outward = self.springs[spring].speed(at.state).value() * f64::from(side) > 0.0;
                if outward && z.value().abs() >= 0.5 * width.value() {
                    side
                } else {
                    0
                }
            }
            Switch::Load(friction, follow) => {
                sign(load[self.frictions[friction].follows[follow].index])
            }
        }
    }

    /// The branch that follows where the present one was left.
    pub(crate) fn next_branch<S: Scalar>(&self, index: usize, at: &Point<S>) -> i8 {
        let branch = at.branches[index];
        let side = |x: S| if x.value() < 0.0 { -1 } else { 1 };
        match self.switches[index] {
            Switch::Slack(_) => 1 - branch,
            switch @ (Switch::SpringGap(_)
            | Switch::TendonGap(_)
            | Switch::LoopBand(_)
            | Switch::LoopLimit(_)) => {
                let (x, width) = self.band(switch, at);
                match branch {
                    0 => side(x),
                    // Without a gap there is nothing between the sides.
                    _ if width.value() <= 0.0 => -branch,
                    _ => 0,
                }
            }
            Switch::Stop(stop) => {
                let (depth, force) = self.contact(stop, at);
                let damping = at.values[self.stops[stop].slot + 2].value();
                match branch {
                    // At a border the numbers are rounding: what is met pushes, unless a damper
                    // below zero, which a fit may try, would pull.
                    0 if damping >= 0.0 => 1,
                    0 => 2,
                    // The force falls to zero before the depth does, without a damper with it.
                    1 if damping > 0.0 => 2,
                    1 => 0,
                    _ if depth.value() <= -force.value() => 0,
                    _ => 1,
                }
            }
            switch @ Switch::Yield { .. } => match branch {
                0 => side(self.band(switch, at).0),
                _ => 0,
            },
            Switch::Velocity(_)
            | Switch::SpringRate(_)
            | Switch::Internal(_)
            | Switch::Load(..) => -branch,
        }
    }

    /// Every branch anew, from the state. Loads come from forces, and forces from branches: those
    /// that follow loads are set last.
    pub(crate) fn initialise_branches<S: Scalar>(
        &self,
        at: Point<S>,
        branches: &mut [i8],
        forces: &mut Forces<S>,
    ) {
        let follows = |index: usize| matches!(self.switches[index], Switch::Load(..));
        for index in (0..self.switches.len()).filter(|&index| !follows(index)) {
            branches[index] = self.branch(index, &at, &forces.load);
        }
        if self.follows > 0 {
            self.forces(
                &Point {
                    branches: &*branches,
                    ..at
                },
                forces,
            );
            for index in (0..self.switches.len()).filter(|&index| follows(index)) {
                branches[index] = self.branch(index, &at, &forces.load);
            }
        }
    }
}
