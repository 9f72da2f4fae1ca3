//! Motion that a recording imposes on a body: a polynomial between two rows.

use super::topology::Topology;
use crate::scalar::Scalar;

/// Inputs of an imposed body: position, velocity, acceleration, deviation of the velocity.
pub(crate) const INPUTS: usize = 4;

/// Imposed motion of a body within a sample interval. It depends on no parameter.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    pub(crate) body: usize,
    /// Position, velocity, acceleration and the deviation of the velocity at the row.
    now: [f64; INPUTS],
    /// Their slopes to the next row.
    slope: [f64; INPUTS],
    /// Coefficients of the position in time since the row.
    c: [f64; 6],
}

impl Motion {
    /// One entry a body that moves as a column says; at rest until inputs are taken.
    pub(crate) fn all(topology: &Topology) -> Vec<Self> {
        let imposed = topology.imposed.iter();
        imposed
            .map(|&body| Self {
                body,
                now: [0.0; INPUTS],
                slope: [0.0; INPUTS],
                c: [0.0; 6],
            })
            .collect()
    }

    /// Takes one of the inputs and its slope from now on.
    pub(crate) fn take(&mut self, which: usize, value: f64, slope: f64) {
        self.now[which] = value;
        self.slope[which] = slope;
        let [q, v, a, _] = self.now;
        self.c = [q, v, 0.5 * a, 0.0, 0.0, 0.0];
    }

    /// The quintic through position, velocity and acceleration at both ends of an interval: the
    /// smoothing spline itself (docs/explanation/plant.md, eq. 24).
    pub(crate) fn span(&mut self, dt: f64) {
        let [_, v, a, _] = self.now;
        let [slope_q, slope_v, slope_a, _] = self.slope;
        // The left-over of each at the end, beyond constant acceleration.
        let dq = slope_q * dt - (v + 0.5 * a * dt) * dt;
        let dv = slope_v * dt - a * dt;
        let da = slope_a * dt;
        let (dt2, dt3) = (dt * dt, dt * dt * dt);
        self.c[3] = (10.0 * dq - 4.0 * dv * dt + 0.5 * da * dt2) / dt3;
        self.c[4] = (-15.0 * dq + 7.0 * dv * dt - da * dt2) / (dt3 * dt);
        self.c[5] = (6.0 * dq - 3.0 * dv * dt + 0.5 * da * dt2) / (dt3 * dt2);
    }

    /// Position `tau` seconds after the row.
    pub(crate) fn position<S: Scalar>(&self, tau: S) -> S {
        let c = &self.c;
        ((((tau * c[5] + c[4]) * tau + c[3]) * tau + c[2]) * tau + c[1]) * tau + c[0]
    }

    /// Velocity there.
    pub(crate) fn velocity<S: Scalar>(&self, tau: S) -> S {
        let c = &self.c;
        (((tau * (5.0 * c[5]) + 4.0 * c[4]) * tau + 3.0 * c[3]) * tau + 2.0 * c[2]) * tau + c[1]
    }

    /// Acceleration there.
    pub(crate) fn acceleration<S: Scalar>(&self, tau: S) -> S {
        let c = &self.c;
        ((tau * (20.0 * c[5]) + 12.0 * c[4]) * tau + 6.0 * c[3]) * tau + 2.0 * c[2]
    }

    /// Standard deviation of the velocity at the row.
    pub(crate) fn deviation(&self) -> f64 {
        self.now[3]
    }
}
