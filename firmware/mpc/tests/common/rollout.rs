//! The rollout and its cost in double precision, from the equations alone
//! (docs/explanation/controller.md, eq. 1, 4 and 4a).
#![allow(
    clippy::needless_range_loop,
    reason = "the indices are those of the equations, over several arrays at once"
)]

use sinew_mpc::Problem;

use super::Shallow;

/// Every prediction and J, by plain f64 loops over the flat regressor.
#[allow(clippy::too_many_arguments)]
pub fn exact_rollout<
    M,
    const NX: usize,
    const H: usize,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
>(
    net: &Shallow<NX, H, NY>,
    problem: &Problem<'_, M, NU, NY, NS, ND, DD, N, NB, NV>,
    ends: &[f64],
) -> (f64, Vec<[f64; NY]>) {
    let wide = |v: &[f32]| v.iter().map(|x| f64::from(*x)).collect::<Vec<_>>();
    let mut u: Vec<Vec<f64>> = problem.start.u.iter().map(|u| wide(u)).collect();
    let mut y: Vec<Vec<f64>> = problem.start.y.iter().map(|y| wide(y)).collect();
    let s = wide(&problem.start.s);
    // Every command written out: equal moves within a block.
    let mut plan: Vec<f64> = Vec::new();
    let mut cost = 0.0;
    let mut before = wide(&problem.bounds.previous);
    for (end, length) in ends.chunks_exact(NU).zip(&problem.horizons.length) {
        let moves: Vec<f64> = (0..NU)
            .map(|c| (end[c] - before[c]) / f64::from(*length))
            .collect();
        for _ in 0..*length {
            for c in 0..NU {
                before[c] += moves[c];
                cost += f64::from(problem.weights.moves[c]) * moves[c] * moves[c];
            }
            plan.extend(&before);
        }
    }
    let steps = plan.len() / NU;
    let mut predictions = Vec::new();
    for j in 0..N {
        let i = j.min(steps - 1);
        if j > 0 {
            u.insert(0, vec![]);
            u.truncate(ND);
        }
        u[0] = plan[i * NU..(i + 1) * NU].to_vec();
        let flat: Vec<f64> = u.iter().chain(&y).flatten().chain(&s).copied().collect();
        let mut next = net.exact(&flat);
        for c in 0..NY {
            next[c] += f64::from(problem.disturbance[c]);
            if net.increment {
                next[c] += y[0][c];
            }
            let error = next[c] - f64::from(problem.reference[j][c]);
            if j + 1 < problem.horizons.first {
                continue;
            }
            cost += f64::from(problem.weights.tracking[c]) * error * error;
        }
        y.insert(0, next.to_vec());
        y.truncate(DD);
        predictions.push(next);
    }
    (cost, predictions)
}
