//! The control step of a dense model in any scalar: estimator, optimisation and limits, as the
//! firmware takes them (docs/explanation/controller.md, sections 3 to 6) but for its rounding.

use sinew_model::spec::{ModelSpec, Signal};
use sinew_sim::Scalar;

use super::network::{Predictor, Trace};
use super::newton::{Plan, Problem, enter};
use super::plan::{Active, Blocks, Bounds, clamp};
use crate::closed_loop::reference::Reference;

/// Settings that are searched, in the scalar of the loop.
#[derive(Clone)]
pub struct Settings<S> {
    /// Q, one an output.
    pub tracking: Vec<S>,
    /// Lambda, one an input.
    pub moves: Vec<S>,
    /// Gain of the disturbance estimate.
    pub gain: S,
    /// Newton iterations a step.
    pub iterations: u8,
}

/// Controller of a model.
pub struct Controller<'a, S> {
    spec: &'a ModelSpec,
    predictor: Predictor<'a>,
    blocks: Blocks,
    settings: Settings<S>,
    bounds: Bounds<S>,
    /// The command applied last, physical units.
    applied: Vec<S>,
    /// The regressor; its newest command is a place for u(k).
    x: Vec<S>,
    disturbance: Vec<S>,
    /// Samples since the start.
    samples: usize,
    plan: Plan<S>,
}

/// Numbers beyond this are no measurement: the firmware's bound.
const IMPLAUSIBLE: f64 = 1e3;

fn to_model<S: Scalar>(values: &[S], signals: &[Signal]) -> Vec<S> {
    let both = values.iter().zip(signals);
    both.map(|(v, signal)| (*v - signal.offset) / signal.span)
        .collect()
}

impl<'a, S: Scalar> Controller<'a, S> {
    /// A controller at rest at the safe command; `None` for a model without a dense predictor, or
    /// with more around it.
    pub fn new(spec: &'a ModelSpec, settings: Settings<S>) -> Option<Self> {
        if spec.soft_sensor.is_some() || spec.control.value.is_some() {
            return None;
        }
        let predictor = Predictor::new(spec)?;
        let control = &spec.control;
        let blocks = Blocks::new(control.first_step, control.blocks(), control.horizon);
        let variables = blocks.length.len() * predictor.inputs;
        let of_input = |values: &[f64]| -> Vec<f64> { to_model(values, &spec.inputs) };
        let rates = blocks.length.iter().flat_map(|length| {
            let rates = control.rate_limit.iter().zip(&spec.inputs);
            rates.map(move |(rate, u)| rate * spec.period_s / u.span * *length as f64)
        });
        let applied: Vec<S> = control.safe.iter().map(|u| S::constant(*u)).collect();
        let previous = to_model(&applied, &spec.inputs);
        let mut x = vec![S::ZERO; predictor.regressor()];
        for lag in x[..predictor.first_output()].chunks_mut(predictor.inputs) {
            lag.copy_from_slice(&previous);
        }
        Some(Self {
            bounds: Bounds {
                lower: of_input(&control.lower),
                upper: of_input(&control.upper),
                rate: rates.collect(),
                previous,
            },
            applied,
            x,
            disturbance: vec![S::ZERO; predictor.outputs],
            samples: 0,
            plan: Plan {
                u: vec![S::ZERO; variables],
                active: Active::none(variables),
                cost: f64::INFINITY,
            },
            spec,
            predictor,
            blocks,
            settings,
        })
    }

    /// The command for step `k`, physical units, from measured outputs and channels.
    pub fn step(&mut self, k: usize, y: &[S], s: &[S], reference: &Reference) -> Vec<S> {
        self.observe(y, s);
        let spec = self.spec;
        self.bounds.previous = to_model(&self.applied, &spec.inputs);
        if self.samples > 1 {
            self.blocks.shift(&mut self.plan.u, self.predictor.inputs);
            (self.plan.active).shift(&self.blocks.length, self.predictor.inputs);
        } else {
            for ends in self.plan.u.chunks_mut(self.predictor.inputs) {
                ends.copy_from_slice(&self.bounds.previous);
            }
        }
        let ahead = (1..=spec.control.horizon).map(|j| reference.row(k + j));
        let ahead: Vec<Vec<f64>> = ahead.map(|row| to_model(row, &spec.outputs)).collect();
        let problem = Problem {
            predictor: &self.predictor,
            start: &self.x,
            disturbance: &self.disturbance,
            reference: &ahead,
            tracking: &self.settings.tracking,
            moves: &self.settings.moves,
            command_weight: spec.control.command_weight,
            bounds: &self.bounds,
            blocks: &self.blocks,
        };
        problem.improve(&mut self.plan, self.settings.iterations);
        let planned = (self.blocks).command(0, &self.plan.u, &self.bounds.previous);
        for (i, applied) in self.applied.iter_mut().enumerate() {
            let (control, signal) = (&spec.control, &spec.inputs[i]);
            let rate = control.rate_limit[i] * spec.period_s;
            let asked = planned[i] * signal.span + signal.offset;
            let [lower, upper] = [control.lower[i], control.upper[i]].map(S::constant);
            *applied = clamp(clamp(asked, lower, upper), *applied - rate, *applied + rate);
        }
        let newest = to_model(&self.applied, &spec.inputs);
        self.x[..newest.len()].copy_from_slice(&newest);
        self.applied.clone()
    }

    /// The active set of the last step.
    #[cfg(test)]
    pub fn active(&self) -> &Active {
        &self.plan.active
    }

    /// History and disturbance (eq. 10, 10c).
    fn observe(&mut self, y: &[S], s: &[S]) {
        let spec = self.spec;
        let (first, end) = (
            self.predictor.first_output(),
            self.predictor.first_channel(),
        );
        let y: Vec<S> = to_model(y, &spec.outputs);
        if self.samples == 0 {
            for lag in self.x[first..end].chunks_mut(y.len()) {
                lag.copy_from_slice(&y);
            }
        } else {
            let mut predicted = self.predictor.predict(&self.x, &mut Trace::new());
            for (i, predicted) in predicted.iter_mut().enumerate() {
                let value = *predicted + self.disturbance[i];
                *predicted = if plausible(value) {
                    value
                } else {
                    self.x[first + i]
                };
            }
            if self.samples >= self.predictor.past_outputs {
                for (d, (y, predicted)) in self.disturbance.iter_mut().zip(y.iter().zip(&predicted))
                {
                    let corrected = *d + self.settings.gain * (*y - *predicted);
                    if plausible(corrected) {
                        *d = corrected;
                    }
                }
            }
            let gain = spec.control.observer_gain;
            let entered: Vec<S> = (y.iter().zip(&predicted))
                .map(|(y, predicted)| {
                    if gain < 1.0 {
                        *predicted + (*y - *predicted) * gain
                    } else {
                        *y
                    }
                })
                .collect();
            enter(&mut self.x[first..end], &entered);
        }
        self.samples += 1;
        for (kept, s) in self.x[end..].iter_mut().zip(to_model(s, &spec.channels)) {
            *kept = s;
        }
        let last = self.x[..self.predictor.inputs].to_vec();
        enter(&mut self.x[..first], &last);
    }
}

fn plausible<S: Scalar>(value: S) -> bool {
    value.value().abs() <= IMPLAUSIBLE
}
