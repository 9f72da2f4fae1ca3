//! The rows that stand for a cost-to-go in a plan.

use super::linear::{self, Linear};
use super::matrix::Matrix;
use super::rest;
use super::riccati::{StageWeights, cost_to_go};
use crate::spec::{ModelSpec, ValueSpec};

/// Steps of the iteration to an orthogonal matrix.
const POLAR_STEPS: usize = 30;

/// The cost-to-go of a model: rows at operating points along a direction, model units.
#[derive(Clone, Debug, PartialEq)]
pub struct ValueRows {
    /// Direction of the outputs along which the points lie, of length one; zero for one point.
    pub direction: Vec<f64>,
    /// The points, in the order of their places.
    pub points: Vec<PointRows>,
}

/// Rows W at one operating point; every list begins with the newest.
#[derive(Clone, Debug, PartialEq)]
pub struct PointRows {
    /// Place along the direction.
    pub at: f64,
    /// Weights of u(k+N-1) ..: `[lag][row][input]`, as many lags as the model sees.
    pub u: Vec<Vec<Vec<f64>>>,
    /// Weights of y(k+N) ..: `[lag][row][output]`.
    pub y: Vec<Vec<Vec<f64>>>,
    /// Constant of each row.
    pub offset: Vec<f64>,
    /// Weights of the disturbance: `[element][row]`.
    pub disturbance: Vec<Vec<f64>>,
    /// Weights of r(k+N), r(k+N+1) ..: `[step][row][output]`.
    pub reference: Vec<Vec<Vec<f64>>>,
}

/// The rows of a validated model; `None` without `terminal = "value"`.
///
/// With P of the Riccati recursion, S the derivative of h at the end of the horizon by the plan and
/// the eigenvalues l and vectors e of `S' P_hh S`, the rows are `e' S' P / sqrt(l)` of the largest
/// l. They have the gradient and the curvature of the cost-to-go along these directions of the
/// plan, and are exact where there are as many rows as decision variables.
#[must_use]
pub fn rows(spec: &ModelSpec) -> Option<ValueRows> {
    let value = spec.control.value.as_ref()?;
    let (scaled, direction) = value.scaled(&spec.outputs);
    let mut points: Vec<PointRows> = Vec::new();
    let mut before: Option<Matrix> = None;
    for target in &scaled {
        let (u, y) = rest::nearest(spec, target);
        let model = linear::linearise(spec, &u, &y);
        let mut rows = of_point(spec, value, &model)?;
        if let Some(before) = &before {
            // The same rows turned so that they come nearest to those of the point before: only
            // then a mean of the two has a meaning.
            rows = turned(&rows, before);
        }
        let at = target.iter().zip(&direction).map(|(y, d)| y * d).sum();
        points.push(sorted(spec, value, &rows, (&u, &y), at));
        before = Some(rows);
    }
    Some(ValueRows { direction, points })
}

/// Rows over xi = (h, d, reference rows).
fn of_point(spec: &ModelSpec, value: &ValueSpec, model: &Linear) -> Option<Matrix> {
    let weights = StageWeights {
        tracking: &spec.control.tracking_weight,
        moves: &spec.control.move_suppression,
        commands: spec.control.command_weight,
    };
    let p = cost_to_go(model, &weights, value.ahead)?;
    let reach = reach(spec, model);
    let n_h = model.f.rows;
    let forces = reach.transpose().times(&p.part(0..n_h, 0..p.columns));
    let (values, vectors) = forces.part(0..forces.rows, 0..n_h).times(&reach).eigen();
    let rows = value.rows.min(values.len());
    let directions = vectors.part(0..vectors.rows, 0..rows).transpose();
    let unscaled = directions.times(&forces);
    Some(Matrix::from_fn(value.rows, p.columns, |row, column| {
        // A direction without a cost has no row.
        let size = values.get(row).copied().unwrap_or(0.0);
        if size > 1e-12 * values[0] {
            unscaled[(row, column)] / size.sqrt()
        } else {
            0.0
        }
    }))
}

/// dh(k+N)/dv of the linearised model, with the blocks of the plan.
fn reach(spec: &ModelSpec, model: &Linear) -> Matrix {
    let n_u = spec.inputs.len();
    let blocks = spec.control.blocks();
    let decisions = blocks.len() * n_u;
    let mut reach = Matrix::zero(model.f.rows, decisions);
    let mut command = Matrix::zero(n_u, decisions);
    let mut end = command.clone();
    let mut step = 0;
    for (block, length) in blocks.iter().enumerate() {
        let start = end;
        end = Matrix::zero(n_u, decisions);
        end.enter(0, block * n_u, &Matrix::unit(n_u));
        for done in 1..=*length {
            let part = done as f64 / *length as f64;
            let way = end.plus(-1.0, &start);
            command = start.plus(part, &way);
            reach = (model.f.times(&reach)).plus(1.0, &model.b.times(&command));
            step += 1;
        }
    }
    for _ in step..spec.control.horizon {
        reach = (model.f.times(&reach)).plus(1.0, &model.b.times(&command));
    }
    reach
}

/// `O rows` with the orthogonal O that brings it nearest to `before`: the orthogonal part of
/// `before rows'`, by Newton's iteration `X <- (X + X'^-1) / 2`.
fn turned(rows: &Matrix, before: &Matrix) -> Matrix {
    let mut turn = before.times(&rows.transpose());
    for _ in 0..POLAR_STEPS {
        let unit = Matrix::unit(turn.rows);
        let Some(inverse) = turn.transpose().solve(&unit) else {
            // Rows that vanish cannot be turned.
            return rows.clone();
        };
        turn = turn.plus(1.0, &inverse);
        turn = Matrix::from_fn(turn.rows, turn.columns, |i, j| 0.5 * turn[(i, j)]);
    }
    turn.times(rows)
}

/// The columns by what they weigh, and the constant that counts everything from the rest.
fn sorted(
    spec: &ModelSpec,
    value: &ValueSpec,
    rows: &Matrix,
    (u, y): (&[f64], &[f64]),
    at: f64,
) -> PointRows {
    let (n_u, n_y) = (spec.inputs.len(), spec.outputs.len());
    let columns = |start: usize, count: usize| -> Vec<Vec<f64>> {
        let row = |r: usize| rows.row(r)[start..start + count].to_vec();
        (0..rows.rows).map(row).collect()
    };
    let of_inputs = spec.past_outputs * n_y;
    let of_disturbance = linear::history_len(spec);
    let of_reference = of_disturbance + n_y;
    let past = linear::past_commands(spec);
    let unseen = vec![vec![0.0; n_u]; rows.rows];
    let h = linear::history_at_rest(spec, u, y);
    let offset = (0..rows.rows).map(|r| {
        let row = rows.row(r);
        let of_history: f64 = row.iter().zip(&h).map(|(w, h)| w * h).sum();
        let of_rows = row[of_reference..].chunks(n_y);
        let followed: f64 = of_rows
            .flat_map(|weights| weights.iter().zip(y))
            .map(|(w, y)| w * y)
            .sum();
        -(of_history + followed)
    });
    PointRows {
        at,
        u: (0..spec.past_inputs)
            .map(|lag| {
                if lag < past {
                    columns(of_inputs + lag * n_u, n_u)
                } else {
                    unseen.clone()
                }
            })
            .collect(),
        y: (0..spec.past_outputs)
            .map(|lag| columns(lag * n_y, n_y))
            .collect(),
        offset: offset.collect(),
        disturbance: (0..n_y)
            .map(|d| {
                (0..rows.rows)
                    .map(|r| rows.row(r)[of_disturbance + d])
                    .collect()
            })
            .collect(),
        reference: (0..=value.ahead)
            .map(|step| columns(of_reference + step * n_y, n_y))
            .collect(),
    }
}
