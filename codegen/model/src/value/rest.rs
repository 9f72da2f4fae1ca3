//! The rest of a model whose outputs come nearest to a point.

use super::linear::regressor_at_rest;
use super::matrix::Matrix;
use crate::evaluate;
use crate::spec::ModelSpec;

/// Gauss-Newton steps.
const STEPS: usize = 60;
/// Longest change of a command in one of them, as a part of its range.
const LONGEST: f64 = 0.1;
/// Weight of `y - f` at rest beside that of the distance to the point.
const OF_REST: f64 = 1e4;
/// Weight of the command: of several rests that serve, the one with the least command.
const OF_COMMAND: f64 = 1e-8;

/// Command and outputs of the rest nearest to `target` (weighted by Q), model units; the command is
/// within its limits.
///
/// Minimises `OF_REST |y - f(u, y)|^2 + (y - target)' Q (y - target) + OF_COMMAND |u|^2` over u and
/// y, so that a plant that rests everywhere has its rest at the target.
pub(super) fn nearest(spec: &ModelSpec, target: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (n_u, n_y) = (spec.inputs.len(), spec.outputs.len());
    let limits: Vec<(f64, f64)> = (spec.inputs.iter().zip(&spec.control.lower))
        .zip(&spec.control.upper)
        .map(|((signal, lower), upper)| {
            let scaled = |x: &f64| (x - signal.offset) / signal.span;
            (scaled(lower), scaled(upper))
        })
        .collect();
    let middle = |(lower, upper): &(f64, f64)| 0.0_f64.clamp(*lower, *upper);
    let (mut u, mut y): (Vec<f64>, Vec<f64>) = (limits.iter().map(middle).collect(), target.into());
    for _ in 0..STEPS {
        let x = regressor_at_rest(spec, &u, &y);
        let at = evaluate::predict_with_jacobian(spec, &x);
        // Residuals and their slopes by (u, y), each times the root of its weight.
        let rows = 2 * n_y + n_u;
        let (mut slopes, mut residuals) = (Matrix::zero(rows, n_u + n_y), vec![0.0; rows]);
        let of_outputs = spec.past_inputs * n_u;
        for row in 0..n_y {
            let root = OF_REST.sqrt();
            residuals[row] = root * (y[row] - at.y[row]);
            for (place, slope) in at.jacobian[row].iter().enumerate() {
                let column = match place.checked_sub(of_outputs) {
                    Some(place) => n_u + place % n_y,
                    None => place % n_u,
                };
                slopes[(row, column)] -= root * slope;
            }
            slopes[(row, n_u + row)] += root;
            let root = spec.control.tracking_weight[row].sqrt();
            residuals[n_y + row] = root * (y[row] - target[row]);
            slopes[(n_y + row, n_u + row)] = root;
        }
        for row in 0..n_u {
            let root = OF_COMMAND.sqrt();
            residuals[2 * n_y + row] = root * u[row];
            slopes[(2 * n_y + row, row)] = root;
        }
        let transposed = slopes.transpose();
        let right = transposed.times(&Matrix::column(&residuals));
        let Some(step) = transposed.times(&slopes).solve(&right) else {
            break;
        };
        for (c, u) in u.iter_mut().enumerate() {
            let (lower, upper) = limits[c];
            let range = if upper - lower < f64::INFINITY {
                upper - lower
            } else {
                2.0
            };
            let change = step[(c, 0)].clamp(-LONGEST * range, LONGEST * range);
            *u = (*u - change).clamp(lower, upper);
        }
        for (c, y) in y.iter_mut().enumerate() {
            *y -= step[(n_u + c, 0)];
        }
    }
    (u, y)
}
