//! Typical sizes at every place of a rig, from a run of it: what start values of a fit and weak
//! instances of an effect are made of (`Kind::starts`).

use sinew_sim::effects::Scales;
use sinew_sim::rig::{Drives, End, Reads, Site};
use sinew_sim::{InputTrajectory, Plant, Rig};

use crate::error::Result;

/// A simulated motion of a rig and its inputs.
pub(crate) struct Run<'a> {
    rig: &'a Rig,
    plant: &'a Plant,
    values: &'a [f64],
    /// kg or kg m^2, one entry a body.
    inertia: Vec<f64>,
    /// One entry a body: positions along the run.
    q: Vec<Vec<f64>>,
    /// One entry a body: velocities along the run.
    v: Vec<Vec<f64>>,
    /// One entry a body: squares of inertia times acceleration, added up.
    thrust: Vec<f64>,
    /// One entry a sensor: largest magnitude of what it reads.
    reading: Vec<f64>,
    /// One entry an actuator: largest magnitude and mean square of its input.
    input: Vec<(f64, f64)>,
    interval: f64,
}

/// Magnitudes of the motion at a site.
struct Moved {
    position: Vec<f64>,
    velocity: Vec<f64>,
    body: usize,
}

impl<'a> Run<'a> {
    /// Nothing run yet. `inputs` has one entry a recording, each one column an input of the plant,
    /// SI.
    pub(crate) fn new(
        rig: &'a Rig,
        plant: &'a Plant,
        values: &'a [f64],
        inputs: &[&[Vec<f64>]],
    ) -> Self {
        let bodies = rig.bodies.len();
        let of_column = |column: &str| {
            let at = plant.inputs().iter().position(|i| i.column == column);
            let taken = || inputs.iter().filter_map(|i| i.get(at?)).flatten();
            let squares: f64 = taken().map(|u| u * u).sum();
            (
                taken().fold(0.0, |most, u| u.abs().max(most)),
                squares / taken().count().max(1) as f64,
            )
        };
        Self {
            rig,
            plant,
            values,
            inertia: plant.inertias(values),
            q: vec![Vec::new(); bodies],
            v: vec![Vec::new(); bodies],
            thrust: vec![0.0; bodies],
            reading: vec![0.0; rig.sensors.len()],
            input: (rig.actuators.iter())
                .map(|actuator| of_column(&actuator.input))
                .collect(),
            interval: 0.0,
        }
    }

    /// Runs the rig with these values from `start` over one stretch of time and takes in what it
    /// does. A run that
    /// ends early leaves what there was.
    ///
    /// # Errors
    /// `Simulation` where the rig cannot be simulated.
    pub(crate) fn take(
        &mut self,
        (values, start): (&[f64], &[f64]),
        drive: &InputTrajectory,
        times: &[f64],
    ) -> Result<()> {
        let plant = self.plant;
        let (bodies, moving) = (self.rig.bodies.len(), plant.bodies());
        let mut before: Option<(f64, Vec<f64>)> = None;
        let signals = self
            .rig
            .sensors
            .iter()
            .map(|s| (s.gain.value, s.offset.value));
        let signals: Vec<(f64, f64)> = signals.collect();
        let taken = plant.simulate_with(values, start, drive, times, |row, at| {
            let (state, time) = (at.state(), times[row]);
            for body in 0..bodies {
                self.q[body].push(state[body]);
                self.v[body].push(state[moving + body]);
                if let Some((earlier, before)) = &before {
                    let change = state[moving + body] - before[moving + body];
                    self.thrust[body] += (self.inertia[body] * change / (time - earlier)).powi(2);
                }
            }
            for (sensor, (gain, offset)) in signals.iter().enumerate() {
                let reading = ((at.signal(sensor) - offset) / gain).abs();
                self.reading[sensor] = self.reading[sensor].max(reading);
            }
            before = Some((time, state));
        });
        if let (Some(first), Some(last)) = (times.first(), times.last()) {
            self.interval = (last - first) / (times.len().max(2) - 1) as f64;
        }
        taken?;
        Ok(())
    }

    /// Sizes at a place.
    pub(crate) fn at(&self, site: Site) -> Scales {
        let moved = self.moved(site);
        let (low, high) = range(&moved.position);
        let half = positive(0.5 * (high - low), 1.0);
        let speed = positive(rms(&moved.velocity), half);
        let inertia = self.inertia[moved.body].abs();
        let force = match site {
            Site::Body(body) => self.push(body),
            Site::Pair(a, b) => self.push(a).min(self.push(b)),
            Site::Spring(spring) => {
                let stiffness = self.stiffness(spring);
                let elastic = stiffness * rms(&moved.position);
                elastic
                    .hypot(self.thrust(moved.body))
                    .hypot(self.effort(moved.body))
            }
            Site::Tendon(tendon) => {
                let name = &self.rig.tendons[tendon].name;
                (self.value(name, "stiffness") * half).hypot(self.value(name, "pretension"))
            }
            Site::Actuator(actuator) => {
                let gain = self.value(&self.rig.actuators[actuator].name, "gain");
                gain.abs() * self.input[actuator].1.sqrt()
            }
            Site::Sensor(_) => self.thrust(moved.body),
        };
        let input = match site {
            Site::Actuator(actuator) => self.input[actuator].0,
            _ => self.input.iter().fold(0.0, |most, (u, _)| u.max(most)),
        };
        let reading = match site {
            Site::Sensor(sensor) => self.reading[sensor],
            _ => low.abs().max(high.abs()),
        };
        Scales {
            position: half,
            velocity: speed,
            force: positive(force, inertia * speed * speed / half),
            inertia: positive(inertia, 1.0),
            time: half / speed,
            interval: self.interval,
            input: positive(input, 1.0),
            reading: positive(reading, 1.0),
            range: (low, high),
        }
    }

    /// A parameter of a component; 0 where the rig has none of that name.
    fn value(&self, component: &str, key: &str) -> f64 {
        let slot = self.plant.slot(&format!("{component}.{key}"));
        slot.map_or(0.0, |slot| self.values[slot])
    }

    /// Stiffness of a spring; of one with a learned law, that near its rest.
    fn stiffness(&self, spring: usize) -> f64 {
        let it = &self.rig.springs[spring];
        match it.law {
            Some(_) => self.rig.stiffness_at_rest(spring),
            None => self.value(&it.name, "stiffness"),
        }
    }

    fn body(&self, body: usize) -> Moved {
        Moved {
            position: self.q[body].clone(),
            velocity: self.v[body].clone(),
            body,
        }
    }

    /// A weighted sum of coordinates, less a constant.
    fn combined(&self, parts: &[(usize, f64)], less: f64) -> Moved {
        let rows = self.q.first().map_or(0, Vec::len);
        let sum = |columns: &[Vec<f64>], row: usize| -> f64 {
            parts
                .iter()
                .map(|&(body, arm)| arm * columns[body][row])
                .sum()
        };
        Moved {
            position: (0..rows).map(|row| sum(&self.q, row) - less).collect(),
            velocity: (0..rows).map(|row| sum(&self.v, row)).collect(),
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
                let parts = ends.iter().filter_map(|&(end, sign)| match end {
                    End::Body(body) => Some((body, sign)),
                    End::Ground => None,
                });
                self.combined(&parts.collect::<Vec<_>>(), self.value(&spring.name, "rest"))
            }
            Site::Tendon(tendon) => self.combined(&rig.tendons[tendon].arms(rig), 0.0),
            Site::Actuator(actuator) => match rig.actuators[actuator].drives {
                Drives::Body(body) => self.body(body),
                Drives::Tendon(tendon) => self.moved(Site::Tendon(tendon)),
                // What it moves is as good as what it is: only the order of size counts.
                Drives::Hasel(_) => self.body(0),
            },
            Site::Sensor(sensor) => match rig.sensors[sensor].reads {
                Reads::Position(body) | Reads::Effort(body) => self.body(body),
                Reads::ActuatorEffort(actuator) => self.moved(Site::Actuator(actuator)),
                Reads::Velocity(body) => Moved {
                    position: self.v[body].clone(),
                    ..self.body(body)
                },
                Reads::Tension(tendon) => self.moved(Site::Tendon(tendon)),
                Reads::Shape(_) | Reads::Hasel(..) => self.body(0),
            },
        }
    }

    /// Inertia times acceleration of a body, RMS.
    fn thrust(&self, body: usize) -> f64 {
        (self.thrust[body] / self.q[body].len().max(1) as f64).sqrt()
    }

    /// RMS forces on a body: springs, actuators, inertia.
    fn push(&self, body: usize) -> f64 {
        let mut squares = self.thrust(body).powi(2);
        for (index, spring) in self.rig.springs.iter().enumerate() {
            if [spring.from, spring.to].contains(&End::Body(body)) {
                let extension = self.moved(Site::Spring(index)).position;
                squares += (self.stiffness(index) * rms(&extension)).powi(2);
            }
        }
        for (actuator, (_, square)) in self.rig.actuators.iter().zip(&self.input) {
            // The force of a position loop follows from the other forces.
            if actuator.drives == Drives::Body(body) && actuator.position_loop.is_none() {
                squares += self.value(&actuator.name, "gain").powi(2) * square;
            }
        }
        squares += self.effort(body).powi(2);
        squares.sqrt()
    }

    /// Half the largest effort that sensors show of a body's imposed motion; 0 without any.
    fn effort(&self, body: usize) -> f64 {
        let shows = |reads: Reads| match reads {
            Reads::Effort(of) => of == body,
            Reads::ActuatorEffort(actuator) => {
                self.rig.actuators[actuator].drives == Drives::Body(body)
            }
            _ => false,
        };
        let sensors = self.rig.sensors.iter().zip(&self.reading);
        let readings = sensors.filter(|(sensor, _)| shows(sensor.reads));
        readings.fold(0.0, |most, (_, reading)| (0.5 * reading).max(most))
    }
}

fn rms(values: &[f64]) -> f64 {
    let squares: f64 = values.iter().map(|value| value * value).sum();
    (squares / values.len().max(1) as f64).sqrt()
}

/// Smallest and largest.
pub(crate) fn range(values: &[f64]) -> (f64, f64) {
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
