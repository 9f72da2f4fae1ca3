//! The quadratic subproblem in any scalar, by the firmware's active-set method
//! (docs/explanation/controller.md, section 4). Derivatives of its solution come from the
//! conditions of optimality at the active set, not from the factorisation (eq. 23).

use sinew_mpc::active_set::iteration_limit;
use sinew_mpc::constraints::{Constraint, Side};
use sinew_sim::Scalar;

use super::plan::{Active, Bounds};

/// The firmware's constants of the same names.
const MULTIPLIER_TOLERANCE: f64 = 1e-5;
const PIVOT_FLOOR: f64 = 1e-6;
const FIRST_SHIFT: f64 = 1e-3;

/// `J(U + p) ~ J + 2 g'p + p'Hp`.
pub struct Quadratic<S> {
    /// Half the gradient.
    pub gradient: Vec<S>,
    /// Half the Gauss-Newton Hessian, row after row.
    pub hessian: Vec<Vec<S>>,
}

/// Inner product.
pub fn dot<S: Scalar>(a: &[S], b: &[S]) -> S {
    a.iter().zip(b).fold(S::ZERO, |sum, (a, b)| sum + *a * *b)
}

impl<S: Scalar> Quadratic<S> {
    /// `2 g'p`.
    pub fn slope(&self, p: &[S]) -> S {
        dot(&self.gradient, p) * 2.0
    }

    /// `p'Hp`.
    pub fn curvature(&self, p: &[S]) -> S {
        let rows = p.iter().zip(&self.hessian);
        rows.fold(S::ZERO, |sum, (p_i, row)| sum + *p_i * dot(row, p))
    }

    /// The minimum inside the limits from `u` on; `active` comes in as a guess and goes out as the
    /// active set there.
    pub fn minimum(&self, bounds: &Bounds<S>, u: &[S], active: &mut Active) -> Vec<S> {
        let (mut w, inputs) = (u.to_vec(), bounds.previous.len());
        active.keep_tight(bounds, u);
        let mut residual = self.gradient.clone();
        let sizes = residual.iter().map(|g| g.value().abs());
        let tolerance = MULTIPLIER_TOLERANCE * sizes.fold(0.0, f64::max);
        for _ in 0..iteration_limit(u.len()) {
            let free = active.is_empty();
            let p = self.reduced_step(&residual, active, inputs);
            let hit = active.ratio_test(bounds, &w, &p);
            let fraction = hit.as_ref().map_or(S::constant(1.0), |hit| hit.fraction);
            for (w, p) in w.iter_mut().zip(&p) {
                *w += fraction * *p;
            }
            if let Some(hit) = &hit {
                active.set(hit.place, hit.side);
            } else if free {
                break;
            }
            for (residual, row) in residual.iter_mut().zip(&self.hessian) {
                *residual += fraction * dot(row, &p);
            }
            if hit.is_none() {
                match worst_multiplier(&residual, active, tolerance, inputs) {
                    Some(place) => active.set(place, Side::Free),
                    None => break,
                }
            }
        }
        bounds.project(&mut w);
        w
    }

    /// The step that minimises over the groups of joined commands that are not anchored.
    fn reduced_step(&self, residual: &[S], active: &Active, inputs: usize) -> Vec<S> {
        let n = residual.len();
        let mut p: Vec<S> = residual.iter().map(|r| -*r).collect();
        let mut h = self.hessian.clone();
        let mut anchored: Vec<bool> = active.bound.iter().map(|b| *b != Side::Free).collect();
        let mut removed = vec![false; n];
        for v in (0..n).rev().filter(|v| active.edge[*v] != Side::Free) {
            let Some(root) = v.checked_sub(inputs) else {
                anchored[v] = true;
                continue;
            };
            anchored[root] |= anchored[v];
            let row = h[v].clone();
            for (sum, value) in h[root].iter_mut().zip(&row) {
                *sum += *value;
            }
            for row in &mut h {
                let value = row[v];
                row[root] += value;
            }
            let value = p[v];
            p[root] += value;
            removed[v] = true;
        }
        let kept: Vec<usize> = (0..n).filter(|v| !removed[*v] && !anchored[*v]).collect();
        let mut small: Vec<S> = kept.iter().map(|v| p[*v]).collect();
        let matrix: Vec<Vec<S>> = (kept.iter())
            .map(|row| kept.iter().map(|column| h[*row][*column]).collect())
            .collect();
        // The firmware keeps removed rows with the largest pivot beside the others.
        let diagonal = (0..n).map(|v| self.hessian[v][v]);
        let pivot = diagonal.fold(S::ZERO, Scalar::max);
        let pivot = if kept.len() < n { pivot } else { S::ZERO };
        solve(&matrix, pivot, &mut small);
        p.fill(S::ZERO);
        for (v, value) in kept.iter().zip(&small) {
            p[*v] = *value;
        }
        for v in inputs..n {
            if active.edge[v] != Side::Free {
                p[v] = p[v - inputs];
            }
        }
        p
    }
}

/// Solves `(A + shift I) x = b` with the firmware's shift (eq. 9); `b` becomes x. `other`: the
/// diagonal of what was taken out of A.
///
/// With x0 the solution of the values, dx = (A + shift I)^-1 (db - d(A + shift I) x0): the
/// derivatives take one more substitution with the same factors.
fn solve<S: Scalar>(a: &[Vec<S>], other: S, b: &mut [S]) {
    let n = b.len();
    let scale = (0..n).fold(other, |scale, i| scale.max(a[i][i].abs()));
    let floor = PIVOT_FLOOR * scale.value();
    let mut shift = S::ZERO;
    let mut factors = factor(a, 0.0, floor);
    if factors.is_none() {
        shift = scale * FIRST_SHIFT;
        factors = factor(a, shift.value(), floor);
    }
    let factors = factors.or_else(|| {
        let steepest = b.iter().fold(S::ZERO, |most, b| most.max(b.abs()));
        let rows = a
            .iter()
            .map(|row| row.iter().fold(S::ZERO, |sum, v| sum + v.abs()));
        shift = rows.fold(other, Scalar::max) * 2.0 + steepest * 1e-3 + f64::MIN_POSITIVE;
        factor(a, shift.value(), 0.0)
    });
    let Some(l) = factors else {
        b.fill(S::constant(f64::NAN));
        return;
    };
    let values: Vec<f64> = b.iter().map(|b| b.value()).collect();
    let x0 = substitute(&l, &values);
    let mut rest = b.to_vec();
    for (i, rest) in rest.iter_mut().enumerate() {
        for (a, x) in a[i].iter().zip(&x0) {
            *rest -= *a * *x;
        }
        *rest -= shift * x0[i];
    }
    for (b, (x0, dx)) in b.iter_mut().zip(x0.iter().zip(substitute(&l, &rest))) {
        *b = dx + *x0;
    }
}

/// Rows of L below the diagonal, 1/D on it; `None` at the first pivot that is not above `floor`.
fn factor<S: Scalar>(a: &[Vec<S>], shift: f64, floor: f64) -> Option<Vec<Vec<f64>>> {
    let mut l: Vec<Vec<f64>> = Vec::with_capacity(a.len());
    for (i, row) in a.iter().enumerate() {
        let mut line: Vec<f64> = Vec::with_capacity(i + 1);
        let mut pivot = row[i].value() + shift;
        for j in 0..i {
            let sum: f64 = line.iter().zip(&l[j]).map(|(ld, unit)| ld * unit).sum();
            line.push(row[j].value() - sum);
        }
        for (j, value) in line.iter_mut().enumerate() {
            let unit = *value * l[j][j];
            pivot -= unit * *value;
            *value = unit;
        }
        if pivot.is_nan() || pivot <= floor {
            return None;
        }
        line.push(1.0 / pivot);
        l.push(line);
    }
    Some(l)
}

/// Forward, diagonal and backward substitution.
fn substitute<S: Scalar>(l: &[Vec<f64>], b: &[S]) -> Vec<S> {
    let mut x = b.to_vec();
    for (i, row) in l.iter().enumerate() {
        for j in 0..i {
            x[i] = x[i] - x[j] * row[j];
        }
    }
    for i in (0..x.len()).rev() {
        let mut value = x[i] * l[i][i];
        for j in i + 1..x.len() {
            value -= x[j] * l[j][i];
        }
        x[i] = value;
    }
    x
}

/// The active limit whose multiplier has the wrong sign by most (eq. 8).
fn worst_multiplier<S: Scalar>(
    residual: &[S],
    active: &Active,
    tolerance: f64,
    inputs: usize,
) -> Option<Constraint> {
    let n = residual.len();
    let mut after: Vec<f64> = residual.iter().map(|r| r.value()).collect();
    let mut boxed: Vec<bool> = active.bound.iter().map(|b| *b != Side::Free).collect();
    for v in (inputs..n).rev().filter(|v| active.edge[*v] != Side::Free) {
        after[v - inputs] += after[v];
        boxed[v - inputs] |= boxed[v];
    }
    let (mut worst, mut most) = (None, tolerance);
    let mut consider = |place, side, multiplier: f64| {
        let wrong = match side {
            Side::Free => return,
            Side::Lower => -multiplier,
            Side::Upper => multiplier,
        };
        if wrong > most {
            (most, worst) = (wrong, Some(place));
        }
    };
    let mut before = vec![0.0; n];
    for v in 0..n {
        if active.edge[v] != Side::Free && v >= inputs {
            before[v] = before[v - inputs] + residual[v - inputs].value();
        }
        let edge = if boxed[v] && v >= inputs {
            -before[v]
        } else {
            after[v]
        };
        consider(Constraint::Edge(v), active.edge[v], edge);
        consider(Constraint::Bound(v), active.bound[v], before[v] + after[v]);
    }
    worst
}
