//! Typical sizes at every place of a rig in a run of it as written: what a weak instance of an effect is
//! made of (`Kind::starts`).

use sinew_sim::effects::Scales;
use sinew_sim::rig::{Drives, End, Reads, Site};
use sinew_sim::{Rig, Trajectory};

use super::Experiment;

/// States along a run of a rig.
pub(super) struct Run<'a> {
    pub(super) rig: &'a Rig,
    /// One row a time: positions, velocities, internal states.
    pub(super) states: Vec<Vec<f64>>,
    pub(super) trajectory: &'a Trajectory<f64>,
    pub(super) experiment: &'a Experiment,
    /// Which input of the experiment each actuator takes.
    pub(super) inputs: Vec<usize>,
}

/// What moves at a place.
struct Moved {
    position: Vec<f64>,
    velocity: Vec<f64>,
    body: usize,
}

impl Run<'_> {
    /// Sizes at a place.
    pub(super) fn at(&self, site: Site) -> Scales {
        let moved = self.moved(site);
        let (low, high) = range(&moved.position);
        let position = positive(0.5 * (high - low), 1.0);
        let velocity = positive(rms(&moved.velocity), position);
        let inertia = self.rig.bodies[moved.body].inertia.value;
        let force = match site {
            Site::Body(body) => self.push(body),
            Site::Pair(a, b) => self.push(a).min(self.push(b)),
            Site::Spring(s) => (self.rig.springs[s].stiffness.value * rms(&moved.position))
                .max(self.thrust(moved.body)),
            Site::Tendon(t) => {
                let tendon = &self.rig.tendons[t];
                tendon
                    .pretension
                    .value
                    .hypot(tendon.stiffness.value * position)
            }
            Site::Actuator(_) | Site::Sensor(_) => self.thrust(moved.body),
        };
        let t = &self.experiment.t;
        let interval = (t[t.len() - 1] - t[0]) / (t.len() - 1) as f64;
        let input = match site {
            Site::Actuator(actuator) => largest(&self.experiment.inputs[self.inputs[actuator]]),
            _ => self
                .experiment
                .inputs
                .iter()
                .map(|u| largest(u))
                .fold(0.0, f64::max),
        };
        let reading = match site {
            Site::Sensor(sensor) => largest(&self.trajectory.column(sensor)),
            _ => low.abs().max(high.abs()),
        };
        Scales {
            position,
            velocity,
            force: positive(force, inertia * velocity * velocity / position),
            inertia,
            time: position / velocity,
            interval,
            input: positive(input, 1.0),
            reading: positive(reading, 1.0),
            range: (low, high),
        }
    }

    fn column(&self, state: usize) -> Vec<f64> {
        self.states.iter().map(|row| row[state]).collect()
    }

    fn body(&self, body: usize) -> Moved {
        Moved {
            position: self.column(body),
            velocity: self.column(self.rig.bodies.len() + body),
            body,
        }
    }

    /// A weighted sum of coordinates, less a constant.
    fn combined(&self, parts: &[(usize, f64)], less: f64) -> Moved {
        let bodies = self.rig.bodies.len();
        let sum = |row: &Vec<f64>, offset: usize| -> f64 {
            parts
                .iter()
                .map(|&(body, arm)| arm * row[offset + body])
                .sum()
        };
        Moved {
            position: self.states.iter().map(|row| sum(row, 0) - less).collect(),
            velocity: self.states.iter().map(|row| sum(row, bodies)).collect(),
            body: parts.first().map_or(0, |&(body, _)| body),
        }
    }

    fn moved(&self, site: Site) -> Moved {
        let rig = self.rig;
        match site {
            Site::Body(body) => self.body(body),
            Site::Pair(a, b) => self.combined(&[(b, 1.0), (a, -1.0)], 0.0),
            Site::Spring(spring) => {
                let spring = &rig.springs[spring];
                let ends = [(spring.to, 1.0), (spring.from, -1.0)];
                let parts: Vec<(usize, f64)> = (ends.iter())
                    .filter_map(|&(end, sign)| match end {
                        End::Body(body) => Some((body, sign)),
                        End::Ground => None,
                    })
                    .collect();
                self.combined(&parts, spring.rest.value)
            }
            Site::Tendon(tendon) => self.combined(&rig.tendons[tendon].arms(rig), 0.0),
            Site::Actuator(actuator) => match rig.actuators[actuator].drives {
                Drives::Body(body) => self.body(body),
                Drives::Tendon(tendon) => self.moved(Site::Tendon(tendon)),
                // What it moves is as good as what it is: only the order of size counts.
                Drives::Hasel(_) => self.body(0),
            },
            Site::Sensor(sensor) => match rig.sensors[sensor].reads {
                Reads::Position(body) | Reads::Velocity(body) => self.body(body),
                Reads::Tension(tendon) => self.moved(Site::Tendon(tendon)),
                Reads::Shape(_) | Reads::Hasel(..) => self.body(0),
            },
        }
    }

    /// Inertia times acceleration of a body, RMS.
    fn thrust(&self, body: usize) -> f64 {
        let velocity = self.column(self.rig.bodies.len() + body);
        let t = &self.experiment.t;
        let acceleration: Vec<f64> = (1..t.len())
            .map(|k| (velocity[k] - velocity[k - 1]) / (t[k] - t[k - 1]))
            .collect();
        self.rig.bodies[body].inertia.value * rms(&acceleration)
    }

    /// What pushes a body: springs, actuators and what it takes to accelerate it, RMS.
    fn push(&self, body: usize) -> f64 {
        let mut squares = self.thrust(body).powi(2);
        for (index, spring) in self.rig.springs.iter().enumerate() {
            if [spring.from, spring.to].contains(&End::Body(body)) {
                let extension = self.moved(Site::Spring(index)).position;
                squares += (spring.stiffness.value * rms(&extension)).powi(2);
            }
        }
        for (actuator, &input) in self.rig.actuators.iter().zip(&self.inputs) {
            if actuator.drives == Drives::Body(body) {
                squares += (actuator.gain.value * rms(&self.experiment.inputs[input])).powi(2);
            }
        }
        squares.sqrt()
    }
}

fn rms(values: &[f64]) -> f64 {
    let squares: f64 = values.iter().map(|value| value * value).sum();
    (squares / values.len().max(1) as f64).sqrt()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}

/// Smallest and largest.
pub(super) fn range(values: &[f64]) -> (f64, f64) {
    (values.iter()).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| {
        (low.min(value), high.max(value))
    })
}

fn positive(value: f64, otherwise: f64) -> f64 {
    if value.is_finite() && value > 0.0 {
        value
    } else if otherwise.is_finite() && otherwise > 0.0 {
        otherwise
    } else {
        1.0
    }
}
