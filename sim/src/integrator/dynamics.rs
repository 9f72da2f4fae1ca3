//! Parameter values and inertias of a topology, as the integrator needs them.

use crate::plant::forces::{Point, State};
use crate::plant::input_signal::InputSignal;
use crate::plant::topology::Topology;
use crate::scalar::Scalar;

/// A topology's numbers.
#[derive(Clone, Debug)]
pub(super) struct Dynamics<S> {
    pub(super) values: Vec<S>,
    pub(super) inverse_inertia: Vec<S>,
    /// Parameter of the central path; 0: hard laws.
    pub(super) smoothing: f64,
}

impl<S: Scalar> Dynamics<S> {
    pub(super) fn new(topology: &Topology, values: &[S], smoothing: f64) -> Self {
        let inertias = topology.bodies.iter().map(|body| values[body.inertia]);
        Self {
            inverse_inertia: inertias.map(|m| S::constant(1.0) / m).collect(),
            values: topology.shapes.complete(values),
            smoothing,
        }
    }

    /// The same numbers without their derivatives.
    pub(super) fn plain(&self, topology: &Topology) -> Dynamics<f64> {
        // What is derived comes out of the parameters again.
        let parameters = self.values.len() - topology.shapes.derived.len();
        let values = self.values[..parameters].iter().map(|value| value.value());
        Dynamics::new(topology, &values.collect::<Vec<f64>>(), self.smoothing)
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
            branches,
            smoothing: self.smoothing,
        }
    }
}
