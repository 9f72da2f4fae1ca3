//! Rest along several directions that share bodies (docs/explanation/plant.md, eq. 6b): what one
//! holds changes what another has to.
//!
//! With B the paths of what rests, M the inertias and f the other forces, the reactions solve
//! `B M^-1 B' lambda = -B M^-1 f`, each within its hold.

use super::dynamics::Dynamics;
use super::modes::{Held, Mode};
use crate::plant::forces::{Point, State};
use crate::plant::topology::{Friction, Topology};
use crate::scalar::Scalar;

/// A pivot below this share of its diagonal, the largest that is left, means that a path follows
/// from the others.
pub(super) const DEPENDENT: f64 = 1e-10;

/// Adds friction to `force` by mode, and the reactions of what rests.
pub(super) fn accelerate<S: Scalar>(
    dynamics: &Dynamics<S>,
    topology: &Topology,
    at: &Point<S>,
    modes: &[Mode],
    force: &mut [S],
    load: &[S],
    held: &mut [Held<S>],
) {
    let mut resting = Vec::new();
    for (index, friction) in topology.frictions.iter().enumerate() {
        match modes[index] {
            Mode::Stick => resting.push(index),
            Mode::Yield(direction) | Mode::Slide(direction) => {
                let along = friction.force(at, load, direction);
                for &(body, arm) in &friction.path {
                    force[body] += Friction::arm(at.values, arm) * along;
                }
            }
        }
    }
    if resting.is_empty() {
        return;
    }
    let accelerations: Vec<S> = (force.iter().zip(&dynamics.inverse_inertia))
        .map(|(&force, &inverse)| force * inverse)
        .collect();
    let right = along(topology, at.values, &resting, &accelerations);
    let reaction = solve(dynamics, topology, &resting, right);
    for (&index, &force_to_hold) in resting.iter().zip(&reaction) {
        let friction = &topology.frictions[index];
        held[index] = Held {
            force: force_to_hold,
            hold: friction.hold(at.values, at.state, load, at.branches),
        };
        for &(body, arm) in &friction.path {
            force[body] -= Friction::arm(at.values, arm) * force_to_hold;
        }
    }
    for &index in &resting {
        // A body that is held whole has no acceleration at all, not one of rounding errors.
        if let [(body, None)] = topology.frictions[index].path[..] {
            force[body] = S::ZERO;
        }
    }
}

/// Takes the velocity along paths that rest out of a state: what rounding left of it, and its
/// derivatives, since what is held rests whatever its parameters.
pub(super) fn project<S: Scalar>(
    dynamics: &Dynamics<S>,
    topology: &Topology,
    modes: &[Mode],
    state: &mut State<S>,
) {
    let rests = |&index: &usize| modes[index] == Mode::Stick;
    let resting: Vec<usize> = (0..modes.len()).filter(rests).collect();
    if resting.is_empty() {
        return;
    }
    let values = &dynamics.values;
    let right = along(topology, values, &resting, &state.v);
    let impulse = solve(dynamics, topology, &resting, right);
    for (&index, &impulse) in resting.iter().zip(&impulse) {
        for &(body, arm) in &topology.frictions[index].path {
            let arm = Friction::arm(values, arm);
            // The ground has no inertia and takes every impulse.
            if let Some(&inverse) = dynamics.inverse_inertia.get(body) {
                state.v[body] -= arm * impulse * inverse;
            }
        }
    }
    for &index in &resting {
        if let [(body, None)] = topology.frictions[index].path[..] {
            state.v[body] = S::ZERO;
        }
    }
}

/// B x for the paths of `resting`.
pub(super) fn along<S: Scalar>(
    topology: &Topology,
    values: &[S],
    resting: &[usize],
    x: &[S],
) -> Vec<S> {
    let paths = resting.iter().map(|&index| &topology.frictions[index].path);
    paths
        .map(|path| {
            path.iter().fold(S::ZERO, |sum, &(body, arm)| {
                sum + Friction::arm(values, arm) * x[body]
            })
        })
        .collect()
}

/// Solves `B M^-1 B' x = right`; a path that follows from others gets zero.
pub(super) fn solve<S: Scalar>(
    dynamics: &Dynamics<S>,
    topology: &Topology,
    resting: &[usize],
    mut x: Vec<S>,
) -> Vec<S> {
    let n = resting.len();
    let mut matrix = vec![S::ZERO; n * n];
    for (row, &a) in resting.iter().enumerate() {
        for (column, &b) in resting.iter().enumerate() {
            matrix[row * n + column] = coupling(dynamics, topology, a, b);
        }
    }
    let (order, rank) = eliminate(&mut matrix, n, n, |row, pivot, factor| {
        let above = x[pivot];
        x[row] -= factor * above;
    });
    for &row in &order[rank..] {
        x[row] = S::ZERO;
    }
    for k in (0..rank).rev() {
        let row = order[k];
        let mut rest = x[row];
        for &column in &order[k + 1..rank] {
            rest -= matrix[row * n + column] * x[column];
        }
        x[row] = rest / matrix[row * n + row];
    }
    x
}

/// Gauss on a positive semidefinite matrix of `n` rows, which may have more columns: the first
/// `count` are pivots, the largest share of its diagonal first. Returns their order and how many
/// were independent; `subtract` hears of every multiple of a row that is taken from another.
pub(super) fn eliminate<S: Scalar>(
    matrix: &mut [S],
    n: usize,
    count: usize,
    mut subtract: impl FnMut(usize, usize, S),
) -> (Vec<usize>, usize) {
    let diagonal: Vec<f64> = (0..count).map(|i| matrix[i * n + i].value()).collect();
    let mut order: Vec<usize> = (0..n).collect();
    for step in 0..count {
        let share = |&k: &usize| matrix[k * n + k].value() / diagonal[k];
        let first = (step..count).max_by(|&a, &b| {
            let (a, b) = (share(&order[a]), share(&order[b]));
            // The earlier one of equals.
            a.total_cmp(&b).then(std::cmp::Ordering::Greater)
        });
        let Some(first) = first.filter(|&at| share(&order[at]) > DEPENDENT) else {
            return (order, step);
        };
        order.swap(step, first);
        let pivot = order[step];
        for &row in &order[step + 1..] {
            let factor = matrix[row * n + pivot] / matrix[pivot * n + pivot];
            for &column in &order[step..] {
                let above = matrix[pivot * n + column];
                matrix[row * n + column] -= factor * above;
            }
            subtract(row, pivot, factor);
        }
    }
    (order, count)
}

/// b_a M^-1 b_b'.
pub(super) fn coupling<S: Scalar>(
    dynamics: &Dynamics<S>,
    topology: &Topology,
    a: usize,
    b: usize,
) -> S {
    let values = &dynamics.values;
    let mut sum = S::ZERO;
    for &(body, arm_a) in &topology.frictions[a].path {
        for &(other, arm_b) in &topology.frictions[b].path {
            if body == other {
                let arms = Friction::arm(values, arm_a) * Friction::arm(values, arm_b);
                sum += arms * dynamics.inverse_inertia[body];
            }
        }
    }
    sum
}
