//! Effort that an imposed motion needs (docs/explanation/plant.md, eq. 25).

use super::forces::{Forces, Point};
use super::topology::{Friction, Topology};
use crate::scalar::Scalar;

impl Topology {
    /// Force or torque on a body beside those of the rig that gives it the imposed acceleration;
    /// `without` is the line of an actuator whose force is not counted.
    pub(crate) fn effort<S: Scalar>(
        &self,
        body: usize,
        without: Option<usize>,
        at: &Point<S>,
    ) -> S {
        let mut forces = Forces::new(self);
        self.forces(at, &mut forces);
        let motion = at.motions.iter().find(|motion| motion.body == body);
        let deviation = motion.map_or(0.0, |motion| motion.deviation());
        let acceleration = motion.map_or(S::ZERO, |motion| motion.acceleration(at.tau));
        let mut force = forces.force[body];
        if let Some(line) = without {
            force -= self.through(line, at);
        }
        for friction in &self.frictions {
            for &(rubbed, arm) in &friction.path {
                if rubbed == body {
                    let arm = Friction::arm(at.values, arm);
                    let along = deviation * arm.value().abs();
                    force += arm * friction.expected(at, &forces.load, along);
                }
            }
        }
        at.values[self.bodies[body].inertia] * acceleration - force
    }

    /// Effort that is asked of an actuator: that of its body without its own force.
    pub(crate) fn actuator_effort<S: Scalar>(&self, line: usize, at: &Point<S>) -> S {
        let motor = self.motors.iter().find(|motor| motor.line == line);
        motor.map_or(S::ZERO, |motor| self.effort(motor.body, Some(line), at))
    }
}

impl Friction {
    /// Mean friction along its path where the velocity is known to a standard deviation: the two
    /// directions by their probabilities (eq. 25).
    pub(crate) fn expected<S: Scalar>(&self, at: &Point<S>, load: &[S], deviation: f64) -> S {
        let speed = self.speed(at.values, at.state).value();
        let forward = if deviation > 0.0 {
            crate::math::normal_share(speed / deviation)
        } else {
            0.5 + 0.5 * if speed == 0.0 { 0.0 } else { speed.signum() }
        };
        let mut force = S::ZERO;
        for (direction, share) in [(1.0, forward), (-1.0, 1.0 - forward)] {
            if share > 0.0 {
                force += self.force(at, load, direction) * share;
            }
        }
        force
    }
}
