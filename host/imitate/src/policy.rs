//! A policy: from what is seen to commands inside the limits
//! (docs/explanation/imitation.md, eq. 1 to 4).

use std::collections::VecDeque;

use crate::limits::{Held, Limits};
use crate::network::Network;
use crate::view::{Feature, View, features};

/// A policy that moves each command from the last one by what its network says (eq. 4).
#[derive(Clone, Debug, PartialEq)]
pub struct Policy {
    /// Numbers that it sees.
    pub view: View,
    /// Its network, from features to changes of commands in units of `step`.
    pub network: Network,
    /// Unit of each command's change.
    pub step: Vec<f64>,
    /// Limits of the commands.
    pub limits: Limits,
    pub(crate) features: Vec<Feature>,
}

/// Past of a loop, as far as a policy sees it: latest first.
#[derive(Clone, Debug, PartialEq)]
pub struct Memory {
    /// Measured outputs.
    pub y: VecDeque<Vec<f64>>,
    /// Commands.
    pub u: VecDeque<Vec<f64>>,
}

impl Memory {
    /// A past in which outputs and commands were always these.
    pub fn resting(view: &View, y: &[f64], u: &[f64]) -> Self {
        Self {
            y: vec![y.to_vec(); view.past_outputs].into(),
            u: vec![u.to_vec(); view.past_inputs].into(),
        }
    }

    /// Takes the outputs of a new sample.
    pub fn measure(&mut self, y: &[f64]) {
        self.y.rotate_right(1);
        self.y[0].copy_from_slice(y);
    }

    /// Takes the commands that were applied.
    pub fn apply(&mut self, u: &[f64]) {
        self.u.rotate_right(1);
        self.u[0].copy_from_slice(u);
    }
}

/// A step of a policy, as its gradient needs it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Step {
    pub kept: Vec<f64>,
    pub held: Vec<Held>,
    pub u: Vec<f64>,
}

impl Policy {
    /// A policy that holds its commands, with features scaled by the signals of a demonstration:
    /// `y` and `u` have one row a period.
    pub fn new(
        view: View,
        network: Network,
        limits: Limits,
        (y, u): (&[Vec<f64>], &[Vec<f64>]),
    ) -> Self {
        let step = limits.step();
        Self {
            features: features(&view, y, u, &step),
            view,
            network,
            step,
            limits,
        }
    }

    /// Raw numbers at a step (eq. 1); `ahead` gives the reference so many periods ahead.
    pub fn raw<'a>(&self, memory: &Memory, ahead: impl Fn(usize) -> &'a [f64]) -> Vec<f64> {
        let mut raw = Vec::with_capacity(self.view.len());
        memory.y.iter().for_each(|y| raw.extend_from_slice(y));
        memory.u.iter().for_each(|u| raw.extend_from_slice(u));
        (1..=self.view.ahead).for_each(|j| raw.extend_from_slice(ahead(j)));
        raw
    }

    /// Commands for raw numbers (eq. 2 to 4).
    pub fn commands(&self, raw: &[f64]) -> Vec<f64> {
        self.step(raw).u
    }

    pub(crate) fn z(&self, raw: &[f64]) -> Vec<f64> {
        self.features.iter().map(|f| f.of(raw)).collect()
    }

    pub(crate) fn step(&self, raw: &[f64]) -> Step {
        let mut step = Step::default();
        let mut change = vec![0.0; self.view.inputs];
        self.network
            .forward(&self.z(raw), &mut step.kept, &mut change);
        for (i, change) in change.iter().enumerate() {
            let before = raw[self.view.input(1, i)];
            let asked = before + self.step[i] * change;
            let (u, held) = self.limits.limit(i, asked, before);
            step.u.push(u);
            step.held.push(held);
        }
        step
    }

    /// Gradient by the raw numbers, for the gradient `by_u` of the commands; the one by the weights
    /// is added to `gradient`.
    pub(crate) fn backward(&self, step: &Step, by_u: &[f64], gradient: &mut [f64]) -> Vec<f64> {
        let mut by_raw = vec![0.0; self.view.len()];
        let mut by_change = vec![0.0; by_u.len()];
        for (i, by) in by_u.iter().enumerate() {
            if step.held[i] != Held::Box {
                by_raw[self.view.input(1, i)] += by;
            }
            if step.held[i] == Held::Free {
                by_change[i] = by * self.step[i];
            }
        }
        let mut by_z = vec![0.0; self.view.len()];
        self.network
            .backward(&step.kept, &by_change, gradient, &mut by_z);
        for (feature, by) in self.features.iter().zip(by_z) {
            by_raw[feature.plus] += by * feature.gain;
            if let Some(minus) = feature.minus {
                by_raw[minus] -= by * feature.gain;
            }
        }
        by_raw
    }

    /// Network from raw numbers to changes of commands, SI: features and units are folded into its
    /// first and last weights. It is what a chip runs.
    pub fn folded(&self) -> Network {
        let mut network = self.network.clone();
        let n = self.view.len();
        let (hidden, path) = (network.sizes[1], network.linear_path());
        let inputs = self.view.inputs;
        let mut bias_of_path = vec![0.0; inputs];
        for row in 0..hidden {
            let (weights, rest) = network.weights.split_at_mut(hidden * n);
            rest[row] += self.fold(&mut weights[row * n..(row + 1) * n]);
        }
        for (row, bias) in bias_of_path.iter_mut().enumerate() {
            let first = path + row * n;
            *bias = self.fold(&mut network.weights[first..first + n]);
            for weight in &mut network.weights[first..first + n] {
                *weight *= self.step[row];
            }
        }
        let last = network.sizes[network.sizes.len() - 2];
        let first = path - (last + 1) * inputs;
        for (row, of_path) in bias_of_path.iter().enumerate() {
            for weight in &mut network.weights[first + row * last..first + (row + 1) * last] {
                *weight *= self.step[row];
            }
            let bias = &mut network.weights[first + last * inputs + row];
            *bias = (*bias + of_path) * self.step[row];
        }
        network
    }

    /// Puts a row of weights of features in those of raw numbers; returns what its bias gains.
    fn fold(&self, row: &mut [f64]) -> f64 {
        let of_features = row.to_vec();
        row.fill(0.0);
        let mut bias = 0.0;
        for (feature, weight) in self.features.iter().zip(of_features) {
            row[feature.plus] += weight * feature.gain;
            match feature.minus {
                Some(minus) => row[minus] -= weight * feature.gain,
                None => bias -= weight * feature.gain * feature.offset,
            }
        }
        bias
    }
}
