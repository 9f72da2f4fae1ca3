//! A force that the rig lacks, recovered from a recording without a guess at its law
//! (docs/explanation/diagnosis.md, eq. 12 to 15): the plant as it is fitted, plus a force at one
//! place that wanders as an Ornstein–Uhlenbeck process, through an extended Kalman filter and the
//! Rauch–Tung–Striebel smoother.

use nalgebra::{DMatrix, DVector};
use sinew_sim::effects::Kind;
use sinew_sim::rig::{End, Reads, Site};
use sinew_sim::{Dual, Plant, Rig, Scalar, Stepper};

use crate::diagnose::config::CONFIG;
use crate::diagnose::data::Data;
use crate::error::Result;
use crate::fit::experiment::Experiment;
use crate::fit::start;

/// Directions of one simulation that carries derivatives.
const WIDE: usize = 8;

/// Place of a latent force: forward on one body, backward on another.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    /// The component's name.
    pub component: String,
    /// Body that is pushed.
    pub to: usize,
    /// Body that is pushed back; none: the ground is.
    pub from: Option<usize>,
}

/// Every body, and every spring between two bodies.
pub(crate) fn places(rig: &Rig) -> Vec<Place> {
    let bodies = rig.bodies.iter().enumerate().map(|(to, body)| Place {
        component: body.name.clone(),
        to,
        from: None,
    });
    let springs = rig
        .springs
        .iter()
        .filter_map(|spring| match (spring.from, spring.to) {
            (End::Body(from), End::Body(to)) => Some(Place {
                component: spring.name.clone(),
                to,
                from: Some(from),
            }),
            _ => None,
        });
    bodies.chain(springs).collect()
}

/// A rig with a load of zero at every body, to push by.
pub(crate) struct Pushed {
    plant: Plant,
    values: Vec<f64>,
    /// Slot of each body's load.
    loads: Vec<usize>,
    position: Vec<usize>,
    velocity: Vec<usize>,
    /// Sensors that show a state; a tension depends on the input too and is left out.
    shown: Vec<bool>,
}

impl Pushed {
    /// `None` where a body cannot take a load.
    pub fn new(rig: &Rig) -> Option<Self> {
        let mut rig = rig.clone();
        let names: Vec<String> = rig.bodies.iter().map(|body| body.name.clone()).collect();
        for body in 0..names.len() {
            let site = Site::Body(body);
            if Kind::Constant.sites(&rig).contains(&site) {
                rig = rig.with_effect(Kind::Constant, site, &[0.0]).ok()?;
            }
        }
        let plant = Plant::new(&rig).ok()?;
        let states = plant.state_names();
        let find = |what: &str| {
            let of = |name: &String| states.iter().position(|s| *s == format!("{name}.{what}"));
            names.iter().map(of).collect::<Option<Vec<_>>>()
        };
        let loads = names
            .iter()
            .map(|name| plant.slot(&format!("{name}.constant_load.level")))
            .collect::<Option<Vec<_>>>()?;
        Some(Self {
            values: plant.values(),
            shown: rig
                .sensors
                .iter()
                .map(|sensor| !matches!(sensor.reads, Reads::Tension(_)))
                .collect(),
            position: find("position")?,
            velocity: find("velocity")?,
            loads,
            plant,
        })
    }
}

/// Statistics of a latent force.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wander {
    /// Its standard deviation, N or N m.
    pub size: f64,
    /// Its correlation time, s.
    pub time: f64,
}

/// A recovered force, one entry a row.
#[derive(Clone, Debug, Default)]
pub(crate) struct Trace {
    pub force: Vec<f64>,
    pub deviation: Vec<f64>,
    pub position: Vec<f64>,
    pub velocity: Vec<f64>,
    /// States of the rig, row by row.
    pub states: Vec<Vec<f64>>,
    /// Parameters of the rig in this recording.
    pub values: Vec<f64>,
    /// Log likelihood of the measurements under this place and wander (eq. 14).
    pub evidence: f64,
}

/// One step of the filter, kept for the way back.
struct Step {
    mean: DVector<f64>,
    spread: DMatrix<f64>,
    ahead: DVector<f64>,
    ahead_spread: DMatrix<f64>,
    transition: DMatrix<f64>,
}

/// Simulation of a row: readings and next state with their derivatives in state and force.
struct Linear {
    signals: Vec<(f64, Vec<f64>)>,
    next: Vec<(f64, Vec<f64>)>,
}

impl Pushed {
    /// Recovers the force at a place over one recording; `None` where the plant cannot be
    /// simulated.
    ///
    /// # Errors
    /// None that reading the recording has not excluded.
    pub fn recover(
        &self,
        rig: &Rig,
        place: &Place,
        wander: Wander,
        data: &Data,
        experiment: usize,
    ) -> Result<Option<Trace>> {
        let recording = &data.experiments[experiment];
        let rows = recording.rows();
        let all = [(experiment, 0..rows)];
        let segments = data.segments(&self.plant, &all)?;
        let start = data
            .starts(rig, &self.plant, &segments, &self.values)?
            .swap_remove(0);
        let problem = data.judging(&self.plant);
        // Own values of the recording without a force, where it has some.
        let start = if problem.local.is_empty() {
            start
        } else {
            start::settle(&problem, &segments, &self.values, vec![start]).swap_remove(0)
        };
        let values = problem.values_at(&self.values, &start);
        let start = problem.plant_state(&start).to_vec();
        let states = start.len();
        let scale = &problem.state_scale[..states];
        let mut mean = DVector::from_iterator(states + 1, start.into_iter().chain([0.0]));
        let mut spread = DMatrix::from_diagonal(&DVector::from_iterator(
            states + 1,
            scale
                .iter()
                .map(|scale| (CONFIG.locate.start_width * scale).powi(2))
                .chain([wander.size.powi(2)]),
        ));
        let mut steps: Vec<Step> = Vec::with_capacity(rows);
        let mut evidence = 0.0;
        for row in 0..rows {
            let here = self.linear(place, &values, (recording, row), &mean, false);
            let Some(here) = here else { return Ok(None) };
            let linearised_at = mean.clone();
            for (sensor, (expected, slope)) in here.signals.iter().enumerate() {
                let measured = recording.signals[sensor][row];
                if measured.is_finite() && self.shown[sensor] {
                    // Readings are linear in the state as far as one update moves it.
                    let h = DVector::from_column_slice(&slope[..=states]);
                    let moved = h.dot(&(&mean - &linearised_at));
                    let gain = &spread * &h;
                    let variance = h.dot(&gain) + data.sigma[sensor].powi(2);
                    let surprise = measured - expected - moved;
                    evidence -= 0.5 * (variance.ln() + surprise * surprise / variance);
                    mean += &gain * (surprise / variance);
                    spread -= &gain * gain.transpose() / variance;
                }
            }
            if row + 1 == rows {
                steps.push(Step {
                    ahead: mean.clone(),
                    ahead_spread: spread.clone(),
                    transition: DMatrix::identity(states + 1, states + 1),
                    mean: mean.clone(),
                    spread: spread.clone(),
                });
                break;
            }
            let Some(on) = self.linear(place, &values, (recording, row), &mean, true) else {
                return Ok(None);
            };
            let fade = (-(recording.t[row + 1] - recording.t[row]) / wander.time).exp();
            let mut transition = DMatrix::zeros(states + 1, states + 1);
            for (i, (_, slope)) in on.next.iter().enumerate() {
                for j in 0..=states {
                    transition[(i, j)] = slope[j];
                }
            }
            transition[(states, states)] = fade;
            let ahead = DVector::from_iterator(
                states + 1,
                on.next
                    .iter()
                    .map(|(value, _)| *value)
                    .chain([fade * mean[states]]),
            );
            let mut ahead_spread = &transition * &spread * transition.transpose();
            ahead_spread[(states, states)] += wander.size.powi(2) * (1.0 - fade * fade);
            for i in 0..states {
                ahead_spread[(i, i)] += (1e-9 * scale[i]).powi(2);
            }
            steps.push(Step {
                mean: mean.clone(),
                spread: spread.clone(),
                ahead: ahead.clone(),
                ahead_spread: ahead_spread.clone(),
                transition,
            });
            mean = ahead;
            spread = ahead_spread;
        }
        Ok(evidence
            .is_finite()
            .then(|| self.smooth(place, &steps, evidence))
            .map(|trace| Trace {
                values: values.to_vec(),
                ..trace
            }))
    }

    /// The way back (eq. 15).
    fn smooth(&self, place: &Place, steps: &[Step], evidence: f64) -> Trace {
        let rows = steps.len();
        let Some(last) = steps.last() else {
            return Trace::default();
        };
        let states = last.mean.len() - 1;
        let mut trace = Trace {
            force: vec![0.0; rows],
            deviation: vec![0.0; rows],
            position: vec![0.0; rows],
            velocity: vec![0.0; rows],
            states: vec![Vec::new(); rows],
            values: Vec::new(),
            evidence,
        };
        let (mut mean, mut spread) = (last.mean.clone(), last.spread.clone());
        for row in (0..rows).rev() {
            if row + 1 < rows {
                let step = &steps[row];
                if let Some(factor) = step.ahead_spread.clone().cholesky() {
                    let gain = factor.solve(&(&step.transition * &step.spread)).transpose();
                    mean = &step.mean + &gain * (&mean - &step.ahead);
                    spread =
                        &step.spread + &gain * (&spread - &step.ahead_spread) * gain.transpose();
                } else {
                    mean = step.mean.clone();
                    spread = step.spread.clone();
                }
            }
            let at = |slots: &[usize]| {
                mean[slots[place.to]] - place.from.map_or(0.0, |from| mean[slots[from]])
            };
            trace.force[row] = mean[states];
            trace.deviation[row] = spread[(states, states)].max(0.0).sqrt();
            trace.position[row] = at(&self.position);
            trace.velocity[row] = at(&self.velocity);
            trace.states[row] = mean.as_slice()[..states].to_vec();
        }
        trace
    }

    /// Force at a place by which a rig that has the named effects differs from this one, row by
    /// row, from the states of a trace (eq. 15a): the force that takes this rig, over one row, to
    /// the velocity that the other one reaches. Empty where that cannot be simulated.
    pub fn named_law(
        &self,
        place: &Place,
        (named, of_named): (&Plant, &[f64]),
        recording: &Experiment,
        trace: &Trace,
    ) -> Vec<f64> {
        let law = self.law_by_rows(place, (named, of_named), recording, trace);
        law.unwrap_or_default()
    }

    fn law_by_rows(
        &self,
        place: &Place,
        (named, of_named): (&Plant, &[f64]),
        recording: &Experiment,
        trace: &Trace,
    ) -> Option<Vec<f64>> {
        let states = &trace.states;
        let own_names = self.plant.state_names();
        let names = named.state_names();
        // States that the effects brought keep what they came to; the others are the trace's.
        let known: Vec<(usize, usize)> = (names.iter().enumerate())
            .filter_map(|(to, name)| Some((to, own_names.iter().position(|n| n == name)?)))
            .collect();
        let index = |body: usize| {
            let name = &own_names[self.velocity[body]];
            names.iter().position(|n| n == name)
        };
        let to = index(place.to)?;
        let from = place.from.map(index);
        let at = |state: &[f64]| match from {
            None => Some(state[to]),
            Some(from) => Some(state[to] - state[from?]),
        };
        let mut state = vec![0.0; names.len()];
        let rows = states.len().min(recording.rows());
        let mut law = Vec::with_capacity(rows);
        for (row, smoothed) in states.iter().enumerate().take(rows) {
            for (to, from) in &known {
                state[*to] = smoothed[*from];
            }
            let Some(&next) = recording.t.get(row + 1).filter(|_| row + 1 < rows) else {
                law.push(law.last().copied()?);
                break;
            };
            let inputs = |row: usize| -> Vec<f64> {
                let columns = recording.inputs.iter();
                columns.map(|column| column[row]).collect()
            };
            let mut stepper = Stepper::new(named, of_named, &state).ok()?;
            stepper
                .advance_between(next - recording.t[row], &inputs(row), &inputs(row + 1))
                .ok()?;
            state = stepper.state();
            let reached = at(&state)?;
            let all = smoothed.iter().copied().chain([0.0]);
            let mean = DVector::from_iterator(smoothed.len() + 1, all);
            let own = self.linear(place, &trace.values, (recording, row), &mean, true)?;
            let force = smoothed.len();
            let part = |of: &[usize], body: usize| {
                let (value, slope) = &own.next[of[body]];
                [*value, slope[force]]
            };
            let here = part(&self.velocity, place.to);
            let there = place
                .from
                .map_or([0.0; 2], |body| part(&self.velocity, body));
            let missing = (reached - (here[0] - there[0])) / (here[1] - there[1]);
            law.push(missing.is_finite().then_some(missing)?);
        }
        Some(law)
    }

    /// Readings of a row and, if `on`, the state at the next one, with derivatives.
    fn linear(
        &self,
        place: &Place,
        values: &[f64],
        (recording, row): (&Experiment, usize),
        mean: &DVector<f64>,
        on: bool,
    ) -> Option<Linear> {
        let states = mean.len() - 1;
        let mut linear = Linear {
            signals: Vec::new(),
            next: Vec::new(),
        };
        for first in (0..=states).step_by(WIDE) {
            let seeded = |index: usize| {
                let mut dual = Dual::<WIDE>::constant(mean[index]);
                if (first..first + WIDE).contains(&index) {
                    dual.derivative[index - first] = 1.0;
                }
                dual
            };
            let mut values: Vec<Dual<WIDE>> = values.iter().map(|&v| Dual::constant(v)).collect();
            let force = seeded(states);
            values[self.loads[place.to]] += force;
            if let Some(from) = place.from {
                values[self.loads[from]] -= force;
            }
            let state: Vec<Dual<WIDE>> = (0..states).map(seeded).collect();
            let mut stepper = Stepper::new(&self.plant, &values, &state).ok()?;
            let inputs = |row: usize| -> Vec<Dual<WIDE>> {
                let columns = recording.inputs.iter();
                columns.map(|column| Dual::constant(column[row])).collect()
            };
            let outputs: Vec<Dual<WIDE>> = if on {
                let dt = recording.t[row + 1] - recording.t[row];
                stepper
                    .advance_between(dt, &inputs(row), &inputs(row + 1))
                    .ok()?;
                stepper.state()
            } else {
                if self.plant.only_recordings().is_some() {
                    stepper.hold(&inputs(row)).ok()?;
                }
                stepper.signals()
            };
            let into = if on {
                &mut linear.next
            } else {
                &mut linear.signals
            };
            into.resize(outputs.len(), (0.0, Vec::new()));
            for (known, output) in into.iter_mut().zip(outputs) {
                known.0 = output.value;
                known.1.extend(output.derivative);
            }
        }
        Some(linear)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mass on a spring and a damper that is pushed to and fro.
    fn rig() -> Rig {
        let file = "/../../rigs/mass-spring-damper.toml";
        let rig = Rig::load(env!("CARGO_MANIFEST_DIR").to_owned() + file);
        rig.expect("the demo's rig ships with the project")
    }

    fn experiment(rows: usize) -> Experiment {
        let t: Vec<f64> = (0..rows).map(|k| 0.005 * k as f64).collect();
        Experiment {
            name: "A.csv".into(),
            inputs: vec![t.iter().map(|t| 6.0 * (3.0 * t).sin()).collect()],
            signals: vec![vec![0.0; rows]],
            held: Vec::new(),
            t,
        }
    }

    /// States of a rig over the experiment, and what the other one lacks.
    fn law(named: &Rig, place: &Place, rows: usize) -> (Vec<Vec<f64>>, Vec<f64>) {
        let plant = Plant::new(named).unwrap();
        let experiment = experiment(rows);
        let drive = experiment.drive(&plant, 0..rows).unwrap();
        let mut states = Vec::new();
        let start = vec![0.0; plant.state_len()];
        plant
            .simulate_with(
                &plant.values(),
                &start,
                &drive,
                &experiment.t,
                |_, stepper| {
                    states.push(stepper.state());
                },
            )
            .unwrap();
        let pushed = Pushed::new(&rig()).unwrap();
        let trace = Trace {
            values: pushed.values.clone(),
            states: states.clone(),
            ..Trace::default()
        };
        let found = pushed.named_law(place, (&plant, &plant.values()), &experiment, &trace);
        (states, found)
    }

    fn mass() -> Place {
        places(&rig()).swap_remove(0)
    }

    #[test]
    fn the_law_of_dry_friction_is_its_level_against_the_velocity() {
        let named = rig().with_effect(Kind::Coulomb, Site::Body(0), &[0.6]);
        let (states, law) = law(&named.unwrap(), &mass(), 800);
        assert_eq!(law.len(), 800);
        let mut judged = 0;
        for (state, force) in states.iter().zip(&law).take(799) {
            let velocity = state[1];
            // A row in which the motion turns has less in the mean.
            if velocity.abs() > 0.1 {
                judged += 1;
                let expected = -0.6 * velocity.signum();
                assert!((force - expected).abs() < 0.02, "{force} at {velocity} m/s");
            }
        }
        assert!(judged > 400, "{judged}");
    }

    #[test]
    fn the_law_counts_numbers_that_moved_and_is_zero_where_nothing_did() {
        let (_, nothing) = law(&rig(), &mass(), 200);
        assert!(
            nothing.iter().all(|force| force.abs() < 1e-6),
            "{nothing:?}"
        );
        let damped = std::fs::read_to_string(&rig().file).unwrap();
        let damped = damped.replace("damping = { value = 1.2,", "damping = { value = 1.7,");
        let damped = Rig::parse(&damped, "damped.toml").unwrap();
        let (states, law) = law(&damped, &mass(), 800);
        for (pair, force) in states.windows(2).zip(&law) {
            let velocity = 0.5 * (pair[0][1] + pair[1][1]);
            assert!(
                (force + 0.5 * velocity).abs() < 0.02,
                "{force} at {velocity} m/s"
            );
        }
    }
}
