//! Rest along several directions that share bodies (docs/plant.md, eq. 6b): what one holds changes
//! what another has to.
//!
//! With B the paths of what rests, M the inertias and f the other forces, the reactions solve
//! `B M^-1 B' lambda = -B M^-1 f`, each within its hold.

use super::dynamics::{Dynamics, Held, Mode};
use crate::plant::forces::{Point, State};
use crate::plant::topology::{Friction, Topology};
use crate::scalar::Scalar;

/// Pivots below this share of their diagonal mean that a path follows from the others.
const DEPENDENT: f64 = 1e-10;

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
            Mode::Slide(direction) => {
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
            hold: friction.hold(at.values, load, at.branches),
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
fn along<S: Scalar>(topology: &Topology, values: &[S], resting: &[usize], x: &[S]) -> Vec<S> {
    let paths = resting.iter().map(|&index| &topology.frictions[index].path);
    paths
        .map(|path| {
            path.iter().fold(S::ZERO, |sum, &(body, arm)| {
                sum + Friction::arm(values, arm) * x[body]
            })
        })
        .collect()
}

/// Solves `B M^-1 B' x = right` by Gauss, without pivoting since it is positive; a path that follows
/// from those before it gets zero.
fn solve<S: Scalar>(
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
    let diagonal: Vec<f64> = (0..n).map(|i| matrix[i * n + i].value()).collect();
    let mut dependent = vec![false; n];
    for pivot in 0..n {
        if matrix[pivot * n + pivot].value() <= DEPENDENT * diagonal[pivot] {
            dependent[pivot] = true;
            continue;
        }
        for row in pivot + 1..n {
            let factor = matrix[row * n + pivot] / matrix[pivot * n + pivot];
            for column in pivot..n {
                let above = matrix[pivot * n + column];
                matrix[row * n + column] -= factor * above;
            }
            let above = x[pivot];
            x[row] -= factor * above;
        }
    }
    for row in (0..n).rev() {
        if dependent[row] {
            x[row] = S::ZERO;
            continue;
        }
        let mut rest = x[row];
        for column in row + 1..n {
            rest -= matrix[row * n + column] * x[column];
        }
        x[row] = rest / matrix[row * n + row];
    }
    x
}

/// b_a M^-1 b_b'.
fn coupling<S: Scalar>(dynamics: &Dynamics<S>, topology: &Topology, a: usize, b: usize) -> S {
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

/// Whether what rests along a path does so within rounding.
pub(super) fn at_rest<S: Scalar>(friction: &Friction, values: &[S], state: &State<S>) -> bool {
    if let [(body, None)] = friction.path[..] {
        return state.v[body].value() == 0.0;
    }
    let part = |&(body, arm): &(usize, Option<usize>)| {
        (Friction::arm(values, arm) * state.v[body]).value()
    };
    let size: f64 = friction.path.iter().map(|p| part(p).abs()).sum();
    friction.speed(values, state).value().abs() <= 1e-13 * size
}

/// Chooses who is held among the frictions at rest (`None` in `wanted`), for the forces at a point:
/// starts with all held, lets go of the one that is overcome most, and takes back one that would
/// slide the wrong way, until all is consistent.
pub(super) fn choose(
    dynamics: &Dynamics<f64>,
    topology: &Topology,
    at: &Point<f64>,
    resting: &[usize],
    modes: &mut [Mode],
    force: &[f64],
    load: &[f64],
) {
    for &index in resting {
        modes[index] = Mode::Stick;
    }
    let mut held = vec![Held::NOTHING; topology.frictions.len()];
    let mut trial = force.to_vec();
    for _ in 0..4 * resting.len() + 4 {
        trial.copy_from_slice(force);
        accelerate(dynamics, topology, at, modes, &mut trial, load, &mut held);
        let excess = |&index: &usize| -held[index].margin();
        let worst = (resting.iter().copied())
            .filter(|&index| modes[index] == Mode::Stick && excess(&index) > 0.0)
            .max_by(|a, b| excess(a).total_cmp(&excess(b)));
        if let Some(index) = worst {
            modes[index] = super::settle::decide(held[index].force, held[index].hold);
            continue;
        }
        let accelerations: Vec<f64> = (trial.iter().zip(&dynamics.inverse_inertia))
            .map(|(force, inverse)| force * inverse)
            .collect();
        let wrong = resting.iter().copied().find(|&index| {
            let Mode::Slide(direction) = modes[index] else {
                return false;
            };
            let [forward, backward] = topology.frictions[index].hold(at.values, load, at.branches);
            let path = &topology.frictions[index].path;
            let part = |&(body, arm): &(usize, Option<usize>)| {
                Friction::arm(at.values, arm) * accelerations.get(body).copied().unwrap_or(0.0)
            };
            let size: f64 = path.iter().map(|p| part(p).abs()).sum();
            // A level below zero, which a fit may try, can hold nothing.
            let can_hold = forward + backward >= 0.0;
            can_hold && direction * path.iter().map(part).sum::<f64>() < -1e-12 * size
        });
        match wrong {
            Some(index) => modes[index] = Mode::Stick,
            None => return,
        }
    }
}
