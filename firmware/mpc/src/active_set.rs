//! The quadratic subproblem of a Newton step: minimise `2 g'p + p'Hp` with `u + p` inside the
//! limits, by a primal active-set method on the chains of `constraint`
//! (docs/explanation/controller.md, section 4).
//!
//! An active edge joins a command to its neighbour, so that both move alike; an active box, or the
//! edge to the last applied command, anchors the whole group. The reduced system adds up the rows
//! and columns of a group, and the multipliers are sums of the residual gradient along it. Every
//! iterate is feasible, so the work may end anywhere.
#![allow(
    clippy::needless_range_loop,
    reason = "one index runs through several arrays and their neighbours, as in the equations"
)]

use crate::budget::{Interrupt, Part, Unlimited};
use crate::constraints::{ActiveSet, Bounds, Constraint, Side};
use crate::cost::{Quadratic, dot};
use crate::ldl;

/// Multipliers above this fraction of the largest gradient element count as not negative.
const MULTIPLIER_TOLERANCE: f32 = 1e-5;

/// Result of the method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// Factorisations.
    pub iterations: u16,
    /// The multipliers proved optimality; otherwise the iteration limit ended it.
    pub optimal: bool,
}

/// Largest number of factorisations for `NV` variables: each limit may be met once and given up
/// once, with some to spare.
pub const fn iteration_limit(nv: usize) -> u16 {
    (3 * nv + 4) as u16
}

/// Finds `w = u + p`. `active` comes in as a guess, what of it is not tight at `u` is dropped, and
/// goes out as the active set at `w`.
///
/// Cost: at most [`iteration_limit`] factorisations of `NV^3 / 6` multiply-adds.
pub fn solve<const NU: usize, const NV: usize>(
    quadratic: &Quadratic<NV>,
    bounds: &Bounds<NU, NV>,
    u: &[f32; NV],
    active: &mut ActiveSet<NV>,
    w: &mut [f32; NV],
) -> Solution {
    solve_within(quadratic, bounds, u, active, w, &mut Unlimited)
}

/// As [`solve`], until `interrupt` ends it, which is asked before every factorisation: `w` is then
/// the best that was found, and inside the limits.
#[inline(never)]
pub(crate) fn solve_within<const NU: usize, const NV: usize>(
    quadratic: &Quadratic<NV>,
    bounds: &Bounds<NU, NV>,
    u: &[f32; NV],
    active: &mut ActiveSet<NV>,
    w: &mut [f32; NV],
    interrupt: &mut impl Interrupt,
) -> Solution {
    *w = *u;
    active.keep_tight(bounds, u);
    let mut residual = quadratic.gradient;
    let mut tolerance = 0.0;
    for g in &residual {
        let size = MULTIPLIER_TOLERANCE * g.abs();
        tolerance = if size > tolerance { size } else { tolerance };
    }
    let mut solution = Solution {
        iterations: 0,
        optimal: false,
    };
    for _ in 0..iteration_limit(NV) {
        if interrupt.ends(Part::Factorisation) {
            break;
        }
        solution.iterations += 1;
        let free = active.is_empty();
        let p = reduced_step::<NU, NV>(quadratic, &residual, active, free);
        let hit = active.ratio_test(bounds, w, &p);
        let fraction = hit.as_ref().map_or(1.0, |hit| hit.fraction);
        for (w, p) in w.iter_mut().zip(&p) {
            *w += fraction * p;
        }
        if let Some(hit) = hit {
            active.set(hit.place, hit.side);
        } else if free {
            solution.optimal = true;
            break;
        }
        for (residual, row) in residual.iter_mut().zip(&quadratic.hessian) {
            *residual += fraction * dot(row, &p);
        }
        if hit.is_none() {
            match worst_multiplier::<NU, NV>(&residual, active, tolerance) {
                Some(place) => active.set(place, Side::Free),
                None => {
                    solution.optimal = true;
                    break;
                }
            }
        }
    }
    // The sums above leave roundings; the plan is inside to the last bit of this arithmetic.
    bounds.project(w);
    solution
}

/// The step `p` that minimises over the free directions: the groups that are not anchored. `free`:
/// nothing is active.
pub(crate) fn reduced_step<const NU: usize, const NV: usize>(
    quadratic: &Quadratic<NV>,
    residual: &[f32; NV],
    active: &ActiveSet<NV>,
    free: bool,
) -> [f32; NV] {
    let mut p = *residual;
    for p in &mut p {
        *p = -*p;
    }
    if free {
        ldl::solve(&quadratic.hessian, &mut p);
        return p;
    }
    // A row that leaves the system becomes a pivot of ordinary size with nothing beside it.
    let mut pivot = 0.0;
    // Row by row: what is copied whole becomes a call of memcpy.
    let mut h: [[f32; NV]; NV] = core::array::from_fn(|i| {
        let row = quadratic.hessian[i];
        pivot = if row[i] > pivot { row[i] } else { pivot };
        row
    });
    let mut anchored: [bool; NV] = core::array::from_fn(|v| active.bound[v] != Side::Free);
    for v in (0..NV).rev() {
        if active.edge[v] == Side::Free {
            continue;
        }
        if v < NU {
            anchored[v] = true;
            continue;
        }
        let root = v - NU;
        anchored[root] |= anchored[v];
        let row = h[v];
        for (sum, value) in h[root].iter_mut().zip(&row) {
            *sum += value;
        }
        for row in &mut h {
            row[root] += row[v];
        }
        p[root] += p[v];
        remove(&mut h, &mut p, v, pivot);
    }
    for v in 0..NV {
        if anchored[v] {
            remove(&mut h, &mut p, v, pivot);
        }
    }
    ldl::solve(&h, &mut p);
    for v in NU..NV {
        if active.edge[v] != Side::Free {
            p[v] = p[v - NU];
        }
    }
    p
}

/// Takes variable `v` out of the system: its solution is zero.
#[inline]
fn remove<const NV: usize>(h: &mut [[f32; NV]; NV], p: &mut [f32; NV], v: usize, pivot: f32) {
    for i in 0..NV {
        h[i][v] = 0.0;
        h[v][i] = 0.0;
    }
    h[v][v] = pivot;
    p[v] = 0.0;
}

/// The active limit whose multiplier has the wrong sign by most, if one has
/// (docs/explanation/controller.md, eq. 8).
///
/// `residual` is the gradient at the minimum over the free directions; it is a combination of the
/// active limits' normals. Within a group the multiplier of an edge is the sum of the residual over
/// the side of the group without the anchor, that of an anchor the sum over all of it.
fn worst_multiplier<const NU: usize, const NV: usize>(
    residual: &[f32; NV],
    active: &ActiveSet<NV>,
    tolerance: f32,
) -> Option<Constraint> {
    // Sums from each command to the end of its group, and whether a box lies there.
    let mut after = *residual;
    let mut boxed: [bool; NV] = core::array::from_fn(|v| active.bound[v] != Side::Free);
    for v in (NU..NV).rev() {
        if active.edge[v] != Side::Free {
            after[v - NU] += after[v];
            boxed[v - NU] |= boxed[v];
        }
    }
    let mut worst = None;
    let mut most = tolerance;
    let mut consider = |place, side, multiplier: f32| {
        let wrong = match side {
            Side::Free => return,
            Side::Lower => -multiplier,
            Side::Upper => multiplier,
        };
        if wrong > most {
            most = wrong;
            worst = Some(place);
        }
    };
    // Sums from the start of each group up to, not including, the command.
    let mut before = [0.0; NV];
    for v in 0..NV {
        let joined = active.edge[v] != Side::Free;
        if joined && v >= NU {
            before[v] = before[v - NU] + residual[v - NU];
        }
        let edge = if boxed[v] && v >= NU {
            -before[v]
        } else {
            after[v]
        };
        consider(Constraint::Edge(v), active.edge[v], edge);
        consider(Constraint::Bound(v), active.bound[v], before[v] + after[v]);
    }
    worst
}
