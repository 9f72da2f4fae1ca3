//! Accelerations with sticking, and one Runge-Kutta step in which nothing changes its mode.

use crate::plant::topology::{Inputs, State, Topology};
use crate::scalar::Scalar;
use std::ops::{Add, Mul};

/// What a body with dry friction does during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mode {
    /// Rests: velocity and acceleration exactly zero.
    Stick,
    /// Slides in this direction, +1 or -1.
    Slide(f64),
}

/// A topology with its numbers.
#[derive(Clone, Debug)]
pub(super) struct Dynamics<S> {
    pub(super) values: Vec<S>,
    inverse_inertia: Vec<S>,
}

/// Room for one step.
#[derive(Clone, Debug)]
pub(super) struct Scratch<S> {
    stage: State<S>,
    acceleration: [Vec<S>; 4],
    /// Other forces on each resting body in the middle of the step; an entry a friction.
    pub(super) middle: Vec<S>,
    /// The state after the step.
    pub(super) end: State<S>,
}

impl<S: Scalar> Scratch<S> {
    pub(super) fn new(bodies: usize, frictions: usize) -> Self {
        let accelerations = || vec![S::ZERO; bodies + 1];
        Self {
            stage: State::rest(bodies),
            acceleration: [
                accelerations(),
                accelerations(),
                accelerations(),
                accelerations(),
            ],
            middle: vec![S::ZERO; frictions],
            end: State::rest(bodies),
        }
    }

    /// Acceleration of a body at the beginning of the step, and (nearly) at its end.
    pub(super) fn accelerations(&self, body: usize) -> (f64, f64) {
        (
            self.acceleration[0][body].value(),
            self.acceleration[3][body].value(),
        )
    }
}

impl<S: Scalar> Dynamics<S> {
    pub(super) fn new(topology: &Topology, values: &[S]) -> Self {
        let inertias = topology.bodies.iter().map(|body| values[body.inertia]);
        Self {
            inverse_inertia: inertias.map(|m| S::constant(1.0) / m).collect(),
            values: topology.shapes.complete(values),
        }
    }

    /// The same numbers without their derivatives.
    pub(super) fn plain(&self, topology: &Topology) -> Dynamics<f64> {
        // What is derived comes out of the parameters again.
        let parameters = self.values.len() - topology.shapes.derived.len();
        let values = self.values[..parameters].iter().map(|value| value.value());
        Dynamics::new(topology, &values.collect::<Vec<f64>>())
    }

    /// Turns the other forces into accelerations: adds friction by mode, divides by inertia, holds
    /// what sticks (eq. 1, 6).
    #[inline]
    pub(super) fn accelerate(
        &self,
        topology: &Topology,
        state: &State<S>,
        modes: &[Mode],
        force: &mut [S],
    ) {
        for (friction, mode) in topology.frictions.iter().zip(modes) {
            match *mode {
                Mode::Stick => force[friction.body] = S::ZERO,
                Mode::Slide(direction) => {
                    force[friction.body] += friction.force(&self.values, state, direction);
                }
            }
        }
        for (force, &inverse) in force.iter_mut().zip(&self.inverse_inertia) {
            *force = *force * inverse;
        }
    }

    /// One step of length `h` from `from`, `tau` seconds into the sample interval, with modes held
    /// (eq. 13); `first` are the other forces at its beginning. The state after it is `scratch.end`.
    ///
    /// The length may carry derivatives itself: the time of an event depends on the parameters.
    #[inline]
    #[allow(
        clippy::too_many_arguments,
        reason = "the step of a hybrid system has these; a struct for them would be built per call"
    )]
    #[allow(
        clippy::needless_range_loop,
        reason = "five arrays of one length by one index"
    )]
    pub(super) fn step<T>(
        &self,
        topology: &Topology,
        inputs: &Inputs<S>,
        modes: &[Mode],
        from: &State<S>,
        first: &[S],
        tau: S,
        h: T,
        scratch: &mut Scratch<S>,
    ) where
        T: Copy + Mul<f64, Output = T>,
        S: Mul<T, Output = S> + Add<T, Output = S>,
    {
        let bodies = topology.bodies.len();
        let Scratch {
            stage,
            acceleration,
            middle,
            end,
        } = scratch;
        let [a1, a2, a3, a4] = acceleration;
        let half: T = h * 0.5;
        let (half_way, whole) = (tau + half, tau + h);

        a1[..bodies].copy_from_slice(&first[..bodies]);
        self.accelerate(topology, from, modes, a1);
        // `end` gathers v1 + 2 v2 + 2 v3 + v4 in its positions while the stages go by.
        for i in 0..bodies {
            stage.q[i] = from.q[i] + from.v[i] * half;
            stage.v[i] = from.v[i] + a1[i] * half;
            end.q[i] = from.v[i] + stage.v[i] * 2.0;
        }
        topology.forces(&self.values, stage, inputs, half_way, a2);
        self.accelerate(topology, stage, modes, a2);
        for i in 0..bodies {
            stage.q[i] = from.q[i] + stage.v[i] * half;
            stage.v[i] = from.v[i] + a2[i] * half;
            end.q[i] += stage.v[i] * 2.0;
        }
        topology.forces(&self.values, stage, inputs, half_way, a3);
        for (middle, friction) in middle.iter_mut().zip(&topology.frictions) {
            *middle = a3[friction.body];
        }
        self.accelerate(topology, stage, modes, a3);
        for i in 0..bodies {
            stage.q[i] = from.q[i] + stage.v[i] * h;
            stage.v[i] = from.v[i] + a3[i] * h;
            end.q[i] += stage.v[i];
        }
        topology.forces(&self.values, stage, inputs, whole, a4);
        self.accelerate(topology, stage, modes, a4);
        let sixth: T = h * (1.0 / 6.0);
        for i in 0..bodies {
            end.q[i] = from.q[i] + end.q[i] * sixth;
            end.v[i] = from.v[i] + (a1[i] + (a2[i] + a3[i]) * 2.0 + a4[i]) * sixth;
        }
    }
}
