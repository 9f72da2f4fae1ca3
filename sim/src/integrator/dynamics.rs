//! Parameter values and inertias of a topology, as the integrator needs them.

use crate::plant::forces::{Point, State};
use crate::plant::input_signal::InputSignal;
use crate::plant::motion::Motion;
use crate::plant::topology::{BodySlots, Topology};
use crate::scalar::Scalar;

/// A topology's numbers.
#[derive(Clone, Debug)]
pub(super) struct Dynamics<S> {
    pub(super) values: Vec<S>,
    /// Zero of a body whose motion is imposed: nothing moves it.
    pub(super) inverse_inertia: Vec<S>,
    pub(super) motions: Vec<Motion>,
    /// Values of the parameters that depend on a column, at its zero.
    at_zero: Vec<S>,
    /// Parameter of the central path; 0: hard laws.
    pub(super) smoothing: f64,
}

impl<S: Scalar> Dynamics<S> {
    pub(super) fn new(topology: &Topology, values: &[S], smoothing: f64) -> Self {
        let inverse = |(body, slots): (usize, &BodySlots)| {
            if topology.is_imposed(body) {
                S::ZERO
            } else {
                S::constant(1.0) / values[slots.inertia]
            }
        };
        Self {
            inverse_inertia: topology.bodies.iter().enumerate().map(inverse).collect(),
            motions: Motion::all(topology),
            values: topology.shapes.complete(values),
            at_zero: (topology.depending.iter())
                .map(|depending| values[depending.slot])
                .collect(),
            smoothing,
        }
    }

    /// Puts the parameters where the signals are (docs/explanation/plant.md, eq. 26).
    pub(super) fn depend(&mut self, topology: &Topology, signals: &[S]) {
        for (depending, &at_zero) in topology.depending.iter().zip(&self.at_zero) {
            let change = self.values[depending.slope] * signals[depending.signal];
            self.values[depending.slot] = at_zero + change;
        }
    }

    /// The same numbers without their derivatives.
    pub(super) fn plain(&self, topology: &Topology) -> Dynamics<f64> {
        // What is derived comes out of the parameters again.
        let parameters = self.values.len() - topology.shapes.derived.len();
        let values = self.values[..parameters].iter().map(|value| value.value());
        let mut values: Vec<f64> = values.collect();
        for (depending, at_zero) in topology.depending.iter().zip(&self.at_zero) {
            values[depending.slot] = at_zero.value();
        }
        Dynamics::new(topology, &values, self.smoothing)
    }

    /// Puts the imposed bodies where they are `tau` seconds into the sample interval.
    #[inline]
    pub(super) fn impose(&self, state: &mut State<S>, tau: S) {
        for motion in &self.motions {
            state.q[motion.body] = motion.position(tau);
            state.v[motion.body] = motion.velocity(tau);
        }
    }

    /// The same of any state, inputs and branches.
    #[inline]
    pub(super) fn at<'a>(
        &'a self,
        state: &'a State<S>,
        input_signals: &'a [InputSignal<S>],
        tau: S,
        branches: &'a [i8],
    ) -> Point<'a, S> {
        Point {
            values: &self.values,
            state,
            input_signals,
            tau,
            motions: &self.motions,
            branches,
            smoothing: self.smoothing,
        }
    }
}

impl Dynamics<f64> {
    /// Takes the values of parameters that depend on a column from numbers with derivatives.
    pub(super) fn take_depending<S: Scalar>(&mut self, topology: &Topology, from: &Dynamics<S>) {
        for depending in &topology.depending {
            self.values[depending.slot] = from.values[depending.slot].value();
        }
    }
}
