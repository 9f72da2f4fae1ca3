//! Cost-to-go of a linearised model by a Riccati recursion.

use super::linear::Linear;
use super::matrix::Matrix;

/// Steps of the recursion behind the last row of the reference, which is held.
const HELD: usize = 80;

/// Weights of the stages, model units.
pub(super) struct StageWeights<'a> {
    /// Diagonal of Q.
    pub tracking: &'a [f64],
    /// Diagonal of Lambda.
    pub moves: &'a [f64],
    /// R of eq. 4c.
    pub commands: f64,
}

/// P of the least cost `xi' P xi` of every step after the horizon, no limit active.
///
/// xi holds h at the end of the horizon, the disturbance, and `ahead + 1` rows of the reference
/// from there on, the last one held; these stay what they are. Backwards from `HELD` steps behind
/// the last row, with `M = P + C' Q C` of the next step:
///
/// ```text
/// P = F' M F + E' Lambda E - G' (B' M B + Lambda + R)^-1 G,   G = B' M F - Lambda E
/// ```
///
/// where `E xi` is the last command. R counts from the command of the rest, which is the least one
/// that holds the point: so it shares the work among the inputs and costs no tracking there.
pub(super) fn cost_to_go(
    model: &Linear,
    weights: &StageWeights<'_>,
    ahead: usize,
) -> Option<Matrix> {
    let (n_h, n_u, n_y, n_d) = (model.f.rows, model.b.columns, model.c.rows, model.d.columns);
    let of_reference = n_h + n_d;
    let n = of_reference + (ahead + 1) * n_y;
    let mut f = Matrix::unit(n);
    f.enter(0, 0, &model.f);
    f.enter(0, n_h, &model.d);
    let mut b = Matrix::zero(n, n_u);
    b.enter(0, 0, &model.b);
    let mut last = Matrix::zero(n_u, n);
    last.enter(0, model.last_command, &Matrix::unit(n_u));
    let moves = diagonal(weights.moves);
    let held = moves.plus(weights.commands, &Matrix::unit(n_u));
    let of_moves = last.transpose().times(&moves).times(&last);
    let (f_transposed, b_transposed) = (f.transpose(), b.transpose());
    let mut p = Matrix::zero(n, n);
    for step in (1..=ahead + HELD).rev() {
        let mut error = Matrix::zero(n_y, n);
        error.enter(0, 0, &model.c);
        let row = of_reference + step.min(ahead) * n_y;
        let of_row = Matrix::unit(n_y);
        error.enter(0, row, &Matrix::zero(n_y, n_y).plus(-1.0, &of_row));
        let squares = (error.transpose())
            .times(&diagonal(weights.tracking))
            .times(&error);
        let m = p.plus(1.0, &squares);
        let mf = m.times(&f);
        let g = b_transposed.times(&mf).plus(-1.0, &moves.times(&last));
        let h = b_transposed.times(&m).times(&b).plus(1.0, &held);
        let gain = h.solve(&g)?;
        let full = f_transposed.times(&mf).plus(1.0, &of_moves);
        let next = full.plus(-1.0, &g.transpose().times(&gain));
        // Roundings leave it a little askew, and the recursion would add to that.
        p = Matrix::from_fn(n, n, |i, j| 0.5 * (next[(i, j)] + next[(j, i)]));
    }
    Some(p)
}

fn diagonal(values: &[f64]) -> Matrix {
    let n = values.len();
    Matrix::from_fn(n, n, |i, j| if i == j { values[i] } else { 0.0 })
}
