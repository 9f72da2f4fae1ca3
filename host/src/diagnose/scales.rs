//! Typical sizes at every place of a rig, from a run of it: what start values of a fit are made of.

use sinew_sim::Rig;
use sinew_sim::effects::Scales;
use sinew_sim::rig::{Drives, End, Reads, Site};

use super::data::Data;
use super::race::Tried;
use crate::error::Result;

/// States of a run along the data, and what was put in.
pub(super) struct Run {
    /// One entry a body: positions along the run.
    q: Vec<Vec<f64>>,
    /// One entry a body: velocities along the run.
    v: Vec<Vec<f64>>,
    /// One entry a body: mean square of inertia times acceleration.
    thrust: Vec<f64>,
    /// One entry an actuator: largest magnitude and mean square of its input.
    input: Vec<(f64, f64)>,
    interval: f64,
}

impl Run {
    /// Runs a fitted rig over the stretches that it was fitted to.
    ///
    /// # Errors
    /// None that fitting it has not excluded.
    pub fn new(
        tried: &Tried,
        data: &Data,
        stretches: &[(usize, std::ops::Range<usize>)],
    ) -> Result<Self> {
        let (model, point) = (&tried.model, &tried.point);
        let bodies = model.rig.bodies.len();
        let mut run = Self {
            q: vec![Vec::new(); bodies],
            v: vec![Vec::new(); bodies],
            thrust: vec![0.0; bodies],
            input: Vec::new(),
            interval: 0.0,
        };
        let names = model.plant.state_names();
        let state_of = |body: usize, what: &str| {
            let name = format!("{}.{what}", model.rig.bodies[body].name);
            names.iter().position(|known| *known == name).unwrap_or(0)
        };
        let at_q: Vec<usize> = (0..bodies).map(|b| state_of(b, "position")).collect();
        let at_v: Vec<usize> = (0..bodies).map(|b| state_of(b, "velocity")).collect();
        let mut count = 0.0_f64;
        for ((index, rows), start) in stretches.iter().zip(&point.states) {
            let experiment = &data.experiments[*index];
            let drive = experiment.drive(&model.plant, rows.clone())?;
            let times = &experiment.t[rows.clone()];
            let mut before: Option<Vec<f64>> = None;
            let _ = model
                .plant
                .simulate_with(&point.values, start, &drive, times, |row, at| {
                    let state = at.state();
                    for body in 0..bodies {
                        run.q[body].push(state[at_q[body]]);
                        run.v[body].push(state[at_v[body]]);
                        if let Some(before) = &before {
                            let dt = times[row] - times[row - 1];
                            let a = (state[at_v[body]] - before[at_v[body]]) / dt;
                            run.thrust[body] += a * a;
                        }
                    }
                    count += 1.0;
                    before = Some(state);
                });
            if let (Some(first), Some(last)) = (times.first(), times.last()) {
                run.interval = (last - first) / (times.len().max(2) - 1) as f64;
            }
        }
        for (body, thrust) in run.thrust.iter_mut().enumerate() {
            let name = format!("{}.inertia", model.rig.bodies[body].name);
            let inertia = model.plant.slot(&name).map_or(0.0, |s| point.values[s]);
            *thrust = inertia * inertia * *thrust / count.max(1.0);
        }
        for actuator in &model.rig.actuators {
            let column = model
                .plant
                .inputs()
                .iter()
                .position(|input| input.column == actuator.input);
            let values = || {
                data.experiments
                    .iter()
                    .flat_map(|experiment| column.map(|at| &experiment.inputs[at]))
                    .flatten()
            };
            let largest = values().fold(0.0_f64, |most, u| most.max(u.abs()));
            let mean = values().map(|u| u * u).sum::<f64>() / (values().count().max(1)) as f64;
            run.input.push((largest, mean));
        }
        Ok(run)
    }

    /// Sizes at a place.
    pub fn at(&self, tried: &Tried, site: Site) -> Scales {
        let rig = &tried.model.rig;
        let value = |component: &str, key: &str| {
            let slot = tried.model.plant.slot(&format!("{component}.{key}"));
            slot.map_or(0.0, |slot| tried.point.values[slot])
        };
        let inertia = |body: usize| value(&rig.bodies[body].name, "inertia").abs();
        let (position, velocity, moved) = self.motion(rig, site, &value);
        let (low, high) = position
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| {
                (low.min(*q), high.max(*q))
            });
        let half = non_zero(0.5 * (high - low), 1.0);
        let speed = non_zero(rms(&velocity), half);
        let force = match site {
            Site::Body(body) => self.body_force(rig, body, &value),
            Site::Spring(spring) => {
                let pull = value(&rig.springs[spring].name, "stiffness") * rms(&position);
                pull.hypot(self.thrust[moved].sqrt())
            }
            Site::Tendon(tendon) => {
                let name = &rig.tendons[tendon].name;
                (value(name, "stiffness") * half).hypot(value(name, "pretension"))
            }
            Site::Actuator(actuator) => {
                value(&rig.actuators[actuator].name, "gain").abs() * self.input[actuator].1.sqrt()
            }
            Site::Sensor(_) => self.thrust[moved].sqrt(),
            Site::Pair(a, b) => self
                .body_force(rig, a, &value)
                .min(self.body_force(rig, b, &value)),
        };
        let input = match site {
            Site::Actuator(actuator) => self.input[actuator].0,
            _ => self.input.iter().fold(0.0, |most, (u, _)| u.max(most)),
        };
        Scales {
            position: half,
            velocity: speed,
            force: non_zero(force, inertia(moved) * speed * speed / half),
            inertia: non_zero(inertia(moved), 1.0),
            time: half / speed,
            interval: self.interval,
            input: non_zero(input, 1.0),
            reading: non_zero(low.abs().max(high.abs()), 1.0),
            range: (low, high),
        }
    }

    /// Mean of what pushes a body.
    fn body_force(&self, rig: &Rig, body: usize, value: &dyn Fn(&str, &str) -> f64) -> f64 {
        let mut squares = self.thrust[body];
        for (index, spring) in rig.springs.iter().enumerate() {
            if [spring.from, spring.to].contains(&End::Body(body)) {
                let (x, _, _) = self.motion(rig, Site::Spring(index), value);
                squares += (value(&spring.name, "stiffness") * rms(&x)).powi(2);
            }
        }
        for (index, actuator) in rig.actuators.iter().enumerate() {
            if actuator.drives == Drives::Body(body) {
                squares += value(&actuator.name, "gain").powi(2) * self.input[index].1;
            }
        }
        squares.sqrt()
    }

    /// Position and velocity along the run at a place, and a body that moves there.
    fn motion(
        &self,
        rig: &Rig,
        site: Site,
        value: &dyn Fn(&str, &str) -> f64,
    ) -> (Vec<f64>, Vec<f64>, usize) {
        let of = |body: usize| (self.q[body].clone(), self.v[body].clone(), body);
        let between = |from: End, to: End, rest: f64| {
            let at = |end: End, columns: &[Vec<f64>], row: usize| match end {
                End::Ground => 0.0,
                End::Body(body) => columns[body][row],
            };
            let rows = self.q.first().map_or(0, Vec::len);
            let x = (0..rows).map(|row| at(to, &self.q, row) - at(from, &self.q, row) - rest);
            let v = (0..rows).map(|row| at(to, &self.v, row) - at(from, &self.v, row));
            let body = match (to, from) {
                (End::Body(body), _) | (_, End::Body(body)) => body,
                _ => 0,
            };
            (x.collect(), v.collect(), body)
        };
        match site {
            Site::Body(body) => of(body),
            Site::Spring(spring) => {
                let spring = &rig.springs[spring];
                between(spring.from, spring.to, value(&spring.name, "rest"))
            }
            Site::Pair(a, b) => between(End::Body(a), End::Body(b), 0.0),
            Site::Tendon(tendon) => {
                let tendon = &rig.tendons[tendon];
                let rows = self.q.first().map_or(0, Vec::len);
                let sum = |columns: &[Vec<f64>], row: usize| {
                    let part = |(body, _): &(usize, _)| {
                        let arm = format!("arm.{}", rig.bodies[*body].name);
                        value(&tendon.name, &arm) * columns[*body][row]
                    };
                    tendon.path.iter().map(part).sum()
                };
                (
                    (0..rows).map(|row| sum(&self.q, row)).collect(),
                    (0..rows).map(|row| sum(&self.v, row)).collect(),
                    tendon.path.first().map_or(0, |(body, _)| *body),
                )
            }
            Site::Actuator(actuator) => match rig.actuators[actuator].drives {
                Drives::Body(body) => of(body),
                Drives::Tendon(tendon) => self.motion(rig, Site::Tendon(tendon), value),
                Drives::Hasel(_) => of(0),
            },
            Site::Sensor(sensor) => match rig.sensors[sensor].reads {
                Reads::Position(body) => of(body),
                Reads::Velocity(body) => (self.v[body].clone(), self.v[body].clone(), body),
                Reads::Tension(tendon) => self.motion(rig, Site::Tendon(tendon), value),
                // Any body will do: it only has to be of the right order of size.
                Reads::Shape(_) | Reads::Hasel(..) => of(0),
            },
        }
    }
}

fn rms(values: &[f64]) -> f64 {
    let squares: f64 = values.iter().map(|value| value * value).sum();
    (squares / values.len().max(1) as f64).sqrt()
}

fn non_zero(value: f64, otherwise: f64) -> f64 {
    if value.is_finite() && value > 0.0 {
        value
    } else if otherwise.is_finite() && otherwise > 0.0 {
        otherwise
    } else {
        1.0
    }
}
