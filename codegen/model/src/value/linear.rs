//! A model linearised at rest, as a state space over what the terminal regressor holds.

use super::matrix::Matrix;
use crate::evaluate;
use crate::spec::ModelSpec;

/// `h(k+1) = F h(k) + B u(k) + D d` and `y = C h` in deviations from a rest. For a model on past
/// readings h is `y(k) .. y(k-DD+1), u(k-1) ..`.
pub(super) struct Linear {
    pub f: Matrix,
    pub b: Matrix,
    pub d: Matrix,
    pub c: Matrix,
    /// Place of u(k-1) in h.
    pub last_command: usize,
}

/// Values of each command that h holds: all that the next prediction sees of the past, and the last
/// one in any case, from which a move is counted.
pub(super) fn past_commands(spec: &ModelSpec) -> usize {
    spec.past_inputs.saturating_sub(1).max(1)
}

/// Length of h.
pub(super) fn history_len(spec: &ModelSpec) -> usize {
    spec.past_outputs * spec.outputs.len() + past_commands(spec) * spec.inputs.len()
}

/// The regressor at rest: every command `u`, every output `y`.
pub(super) fn regressor_at_rest(spec: &ModelSpec, u: &[f64], y: &[f64]) -> Vec<f64> {
    let inputs = std::iter::repeat_n(u, spec.past_inputs).flatten();
    let outputs = std::iter::repeat_n(y, spec.past_outputs).flatten();
    inputs.chain(outputs).copied().collect()
}

/// h at rest.
pub(super) fn history_at_rest(spec: &ModelSpec, u: &[f64], y: &[f64]) -> Vec<f64> {
    let outputs = std::iter::repeat_n(y, spec.past_outputs).flatten();
    let inputs = std::iter::repeat_n(u, past_commands(spec)).flatten();
    outputs.chain(inputs).copied().collect()
}

/// The model at rest with the command `u` and the outputs `y`, model units.
pub(super) fn linearise(spec: &ModelSpec, u: &[f64], y: &[f64]) -> Linear {
    let (n_u, n_y) = (spec.inputs.len(), spec.outputs.len());
    let (past_outputs, past) = (spec.past_outputs, past_commands(spec));
    let x = regressor_at_rest(spec, u, y);
    let jacobian = evaluate::predict_with_jacobian(spec, &x).jacobian;
    let of_outputs = spec.past_inputs * n_u;
    let last_command = past_outputs * n_y;
    let n = history_len(spec);
    let mut f = Matrix::zero(n, n);
    let mut b = Matrix::zero(n, n_u);
    for (row, slopes) in jacobian.iter().enumerate() {
        for (column, slope) in slopes[..n_u].iter().enumerate() {
            b[(row, column)] = *slope;
        }
        for (column, slope) in slopes[n_u..of_outputs].iter().enumerate() {
            f[(row, last_command + column)] = *slope;
        }
        for (column, slope) in slopes[of_outputs..].iter().enumerate() {
            f[(row, column)] = *slope;
        }
    }
    // What is newest now is one older in the next step.
    f.enter(n_y, 0, &Matrix::unit((past_outputs - 1) * n_y));
    f.enter(
        last_command + n_u,
        last_command,
        &Matrix::unit((past - 1) * n_u),
    );
    b.enter(last_command, 0, &Matrix::unit(n_u));
    let top = |columns: usize| {
        let mut top = Matrix::zero(n, columns);
        top.enter(0, 0, &Matrix::unit(columns));
        top
    };
    Linear {
        f,
        b,
        d: top(n_y),
        c: top(n_y).transpose(),
        last_command,
    }
}
