//! Accelerations with sticking, and one Runge-Kutta step in which nothing changes its mode.

use super::dynamics::Dynamics;
use super::modes::{Held, Mode, Modes};
use super::sticking;
use crate::plant::forces::{Forces, Point, State};
use crate::plant::input_signal::InputSignal;
use crate::plant::topology::{Friction, Topology};
use crate::scalar::Scalar;
use std::ops::{Add, Mul};

/// Beginning of a step.
#[derive(Clone, Copy)]
pub(super) struct Start<'a, S> {
    pub(super) state: &'a State<S>,
    /// Forces there, without dry friction.
    pub(super) forces: &'a Forces<S>,
    pub(super) input_signals: &'a [InputSignal<S>],
    /// Seconds into the sample interval.
    pub(super) tau: S,
    pub(super) modes: &'a Modes,
}

impl<'a, S> Start<'a, S> {
    pub(super) fn new(
        state: &'a State<S>,
        forces: &'a Forces<S>,
        input_signals: &'a [InputSignal<S>],
        tau: S,
        modes: &'a Modes,
    ) -> Self {
        Self {
            state,
            forces,
            input_signals,
            tau,
            modes,
        }
    }
}

/// Room for one step.
#[derive(Clone, Debug)]
pub(super) struct Scratch<S> {
    stage: State<S>,
    forces: [Forces<S>; 4],
    /// Reaction and hold of each resting friction in the middle of the step.
    pub(super) middle: Vec<Held<S>>,
    /// The same wherever it was asked for last.
    pub(super) last: Vec<Held<S>>,
    /// The state after the step.
    pub(super) end: State<S>,
}

impl<S: Scalar> Scratch<S> {
    pub(super) fn new(topology: &Topology) -> Self {
        let forces = || Forces::new(topology);
        let held = vec![Held::NOTHING; topology.frictions.len()];
        Self {
            stage: State::rest(topology),
            forces: [forces(), forces(), forces(), forces()],
            middle: held.clone(),
            last: held,
            end: State::rest(topology),
        }
    }

    /// Acceleration of a body at the beginning of the step, and (nearly) at its end.
    pub(super) fn accelerations(&self, body: usize) -> (f64, f64) {
        (
            self.forces[0].force[body].value(),
            self.forces[3].force[body].value(),
        )
    }
}

impl<S: Scalar> Dynamics<S> {
    /// Everything that forces depend on, in a state.
    #[inline]
    pub(super) fn point<'a>(
        &'a self,
        start: &Start<'a, S>,
        state: &'a State<S>,
        tau: S,
    ) -> Point<'a, S> {
        self.at(state, start.input_signals, tau, &start.modes.branches)
    }

    /// Turns the other forces into accelerations: adds friction by mode, divides by inertia, holds
    /// what sticks (eq. 1, 6). What rests is noted in `held`.
    #[inline]
    pub(super) fn accelerate(
        &self,
        topology: &Topology,
        at: &Point<S>,
        modes: &[Mode],
        forces: &mut Forces<S>,
        held: &mut [Held<S>],
    ) {
        let Forces { force, load, .. } = forces;
        if self.smoothing > 0.0 {
            for friction in &topology.frictions {
                let along = friction.smoothed(at, load);
                for &(body, arm) in &friction.path {
                    force[body] += Friction::arm(at.values, arm) * along;
                }
            }
        } else if topology.coupled {
            sticking::accelerate(self, topology, at, modes, force, load, held);
        } else {
            for (index, friction) in topology.frictions.iter().enumerate() {
                let body = friction.body();
                match modes[index] {
                    Mode::Stick => {
                        held[index] = Held {
                            force: force[body],
                            hold: friction.hold(at.values, at.state, load, at.branches),
                        };
                        force[body] = S::ZERO;
                    }
                    Mode::Yield(direction) | Mode::Slide(direction) => {
                        force[body] += friction.force(at, load, direction);
                    }
                }
            }
        }
        for (force, &inverse) in force.iter_mut().zip(&self.inverse_inertia) {
            *force = *force * inverse;
        }
        for motion in &self.motions {
            force[motion.body] = motion.acceleration(at.tau);
        }
    }

    /// One step of length `h` from `start` with modes held (eq. 18). The state after it is
    /// `scratch.end`.
    ///
    /// The length may carry derivatives itself: the time of an event depends on the parameters.
    #[inline]
    #[allow(
        clippy::needless_range_loop,
        reason = "arrays of one length by one index"
    )]
    pub(super) fn step<T>(
        &self,
        topology: &Topology,
        start: &Start<S>,
        h: T,
        scratch: &mut Scratch<S>,
    ) where
        T: Copy + Mul<f64, Output = T>,
        S: Mul<T, Output = S> + Add<T, Output = S>,
    {
        let bodies = topology.bodies.len();
        let rated = topology.rated;
        let Scratch {
            stage,
            forces,
            middle,
            last,
            end,
        } = scratch;
        let [f1, f2, f3, f4] = forces;
        let from = start.state;
        let modes = &start.modes.friction;
        let half: T = h * 0.5;
        let (half_way, whole) = (start.tau + half, start.tau + h);

        f1.copy_from(start.forces);
        self.accelerate(
            topology,
            &self.point(start, from, start.tau),
            modes,
            f1,
            last,
        );
        // `end` gathers v1 + 2 v2 + 2 v3 + v4 in its positions while the stages go by.
        for i in 0..bodies {
            stage.q[i] = from.q[i] + from.v[i] * half;
            stage.v[i] = from.v[i] + f1.force[i] * half;
            end.q[i] = from.v[i] + stage.v[i] * 2.0;
        }
        for i in 0..rated {
            stage.z[i] = from.z[i] + f1.rate[i] * half;
        }
        self.impose(stage, half_way);
        let at = self.point(start, stage, half_way);
        topology.forces(&at, f2);
        self.accelerate(topology, &at, modes, f2, last);
        for i in 0..bodies {
            stage.q[i] = from.q[i] + stage.v[i] * half;
            stage.v[i] = from.v[i] + f2.force[i] * half;
            end.q[i] += stage.v[i] * 2.0;
        }
        for i in 0..rated {
            stage.z[i] = from.z[i] + f2.rate[i] * half;
        }
        self.impose(stage, half_way);
        let at = self.point(start, stage, half_way);
        topology.forces(&at, f3);
        self.accelerate(topology, &at, modes, f3, middle);
        for i in 0..bodies {
            stage.q[i] = from.q[i] + stage.v[i] * h;
            stage.v[i] = from.v[i] + f3.force[i] * h;
            end.q[i] += stage.v[i];
        }
        for i in 0..rated {
            stage.z[i] = from.z[i] + f3.rate[i] * h;
        }
        self.impose(stage, whole);
        let at = self.point(start, stage, whole);
        topology.forces(&at, f4);
        self.accelerate(topology, &at, modes, f4, last);
        let sixth: T = h * (1.0 / 6.0);
        for i in 0..bodies {
            let (a1, a2, a3, a4) = (f1.force[i], f2.force[i], f3.force[i], f4.force[i]);
            end.q[i] = from.q[i] + end.q[i] * sixth;
            end.v[i] = from.v[i] + (a1 + (a2 + a3) * 2.0 + a4) * sixth;
        }
        for i in 0..rated {
            let (r1, r2, r3, r4) = (f1.rate[i], f2.rate[i], f3.rate[i], f4.rate[i]);
            end.z[i] = from.z[i] + (r1 + (r2 + r3) * 2.0 + r4) * sixth;
        }
        self.impose(end, whole);
        if !topology.lagging.is_empty() {
            let (a1, a4) = (&f1.force, &f4.force);
            for i in 0..bodies {
                // The cubic through both ends, half way.
                let eighth = h * 0.125;
                stage.q[i] = (from.q[i] + end.q[i]) * 0.5 + (from.v[i] - end.v[i]) * eighth;
                stage.v[i] = (from.v[i] + end.v[i]) * 0.5 + (a1[i] - a4[i]) * eighth;
            }
            for i in 0..rated {
                stage.z[i] = (from.z[i] + end.z[i]) * 0.5;
            }
            self.impose(stage, half_way);
            self.lag_sensors(topology, start, half_way, whole, h, stage, end);
        }
    }

    /// Takes the lagged readings over a step: exact for a reading that is a parabola in time
    /// (eq. 17b).
    #[allow(clippy::too_many_arguments, reason = "three points of one step")]
    fn lag_sensors<T>(
        &self,
        topology: &Topology,
        start: &Start<S>,
        half_way: S,
        whole: S,
        h: T,
        middle: &State<S>,
        end: &mut State<S>,
    ) where
        T: Copy,
        S: Add<T, Output = S>,
    {
        let length = S::ZERO + h;
        for &sensor in &topology.lagging {
            let Some((slot, state)) = topology.sensors[sensor].lag else {
                continue;
            };
            let read =
                |state: &State<S>, tau: S| topology.reading(sensor, &self.point(start, state, tau));
            let readings = [
                read(start.state, start.tau),
                read(middle, half_way),
                read(end, whole),
            ];
            end.z[state] = lagged(start.state.z[state], readings, length, self.values[slot]);
        }
    }
}

/// A first-order lag over a step: from `z`, through readings at its beginning, middle and end.
///
/// With x = length / time and r(s) = r_0 + a s + b s^2 on the unit interval the end is `z e^-x +
/// r_0 W_0 + a W_1 + b W_2`, `W_k = x int e^(-x (1 - s)) s^k ds`. A time constant below zero
/// continues this without the exponential, so that it goes through zero smoothly.
fn lagged<S: Scalar>(z: S, [start, middle, end]: [S; 3], length: S, time: S) -> S {
    let a = middle * 4.0 - start * 3.0 - end;
    let b = (start + end) * 2.0 - middle * 4.0;
    if length.value() <= 40.0 * time.value() {
        let x = length / time;
        if x.value() < 0.7 {
            // W_k = sum_j (-1)^(j+1) x^j k!/(k + j)!
            let mut sums = [S::ZERO; 3];
            for (k, sum) in sums.iter_mut().enumerate() {
                let mut term = S::constant(-1.0);
                for j in 1..=14 {
                    term = term * x * (-1.0 / (k + j) as f64);
                    *sum += term;
                }
            }
            let [w0, w1, w2] = sums;
            return z * (-x).exp() + start * w0 + a * w1 + b * w2;
        }
        let w0 = S::constant(1.0) - (-x).exp();
        let w1 = S::constant(1.0) - w0 / x;
        let w2 = S::constant(1.0) - w1 * 2.0 / x;
        return z * (-x).exp() + start * w0 + a * w1 + b * w2;
    }
    if length.value() <= 0.0 {
        return z;
    }
    let y = time / length;
    let w1 = S::constant(1.0) - y;
    start + a * w1 + b * (S::constant(1.0) - y * w1 * 2.0)
}

#[cfg(test)]
mod tests {
    use super::lagged;

    /// Against the closed solution for r = 1 + 2 s - 3 s^2 on [0, h].
    #[test]
    fn a_lag_of_a_parabola_is_exact() {
        let h = 0.3;
        let reading = |s: f64| 1.0 + 2.0 * s - 3.0 * s * s;
        for time in [0.01f64, 0.1, 0.42, 0.44, 3.0, 100.0] {
            // y = c0 + c1 s + c2 s^2 + (z - c0) e^(-s/T)
            let (c2, c1) = (-3.0, 2.0 + 6.0 * time);
            let c0 = 1.0 - time * c1;
            let exact = c0 + c1 * h + c2 * h * h + (0.7 - c0) * (-h / time).exp();
            let ours = lagged(0.7, [reading(0.0), reading(0.5 * h), reading(h)], h, time);
            assert!(
                (ours - exact).abs() < 1e-13 * (1.0 + time * time),
                "{time}: {ours} {exact}"
            );
        }
        // No lag: the reading itself; a little less than none: ahead of it.
        let at = |time| lagged(0.7, [reading(0.0), reading(0.5 * h), reading(h)], h, time);
        assert!((at(0.0) - reading(h)).abs() < 1e-15);
        let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
        assert!((slope + (2.0 - 6.0 * h)).abs() < 1e-5, "{slope}");
    }
}
