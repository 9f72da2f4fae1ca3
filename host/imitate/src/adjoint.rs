//! Gradient of a loop's error by the weights of its policy, backwards through plant and policy
//! (docs/explanation/imitation.md, eq. 6).

use crate::policy::Policy;
use crate::rollout::Tape;

impl Tape {
    /// Adds the gradient by the weights to `gradient`, for the gradient `by_y` of the outputs: a
    /// row a sample, as the course has them.
    pub(crate) fn backward(&self, policy: &Policy, by_y: &[Vec<f64>], gradient: &mut [f64]) {
        let view = &policy.view;
        let (states, inputs, outputs) = (self.states, view.inputs, view.outputs);
        let width = states + inputs;
        let mut by_y = by_y.to_vec();
        let mut by_u = vec![vec![0.0; inputs]; self.steps.len()];
        let mut by_x = vec![0.0; states];
        for k in (0..self.steps.len()).rev() {
            let mut by = vec![0.0; width];
            let adjoints = by_x.iter().chain(&by_y[k + 1]);
            for (row, adjoint) in self.slopes[k].chunks(width).zip(adjoints) {
                for (by, slope) in by.iter_mut().zip(row) {
                    *by += slope * adjoint;
                }
            }
            by_x.copy_from_slice(&by[..states]);
            for (all, by) in by_u[k].iter_mut().zip(&by[states..]) {
                *all += by;
            }
            let by_raw = policy.backward(&self.steps[k], &by_u[k], gradient);
            // What was before the first sample is given.
            for back in 0..view.past_outputs.min(k + 1) {
                for i in 0..outputs {
                    by_y[k - back][i] += by_raw[view.output(back, i)];
                }
            }
            for back in 1..=view.past_inputs.min(k) {
                for i in 0..inputs {
                    by_u[k - back][i] += by_raw[view.input(back, i)];
                }
            }
        }
    }
}
