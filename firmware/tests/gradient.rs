//! The gradient of J through the whole recursion, and the Gauss-Newton Hessian, against a double
//! precision evaluation of the same cost over random networks, states, plans and shapes.
#![allow(
    clippy::needless_range_loop,
    reason = "the indices are those of the equations, over several arrays at once"
)]

mod common;

use common::{Random, Shallow};
use sinew_firmware::model::{Model, Regressor};
use sinew_firmware::mpc::{Bounds, Problem, Quadratic, Weights};

/// Every prediction and J, by plain f64 loops over the flat regressor.
#[allow(clippy::too_many_arguments)]
fn exact_rollout<
    const NX: usize,
    const H: usize,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
>(
    net: &Shallow<NX, H, NY>,
    problem: &Problem<'_, Shallow<NX, H, NY>, NU, NY, NS, ND, DD, N>,
    plan: &[f64],
) -> (f64, Vec<[f64; NY]>) {
    let wide = |v: &[f32]| v.iter().map(|x| f64::from(*x)).collect::<Vec<_>>();
    let mut u: Vec<Vec<f64>> = problem.start.u.iter().map(|u| wide(u)).collect();
    let mut y: Vec<Vec<f64>> = problem.start.y.iter().map(|y| wide(y)).collect();
    let s = wide(&problem.start.s);
    let steps = plan.len() / NU;
    let mut cost = 0.0;
    let mut before = wide(&problem.bounds.previous);
    for i in 0..steps {
        for c in 0..NU {
            let change = plan[i * NU + c] - before[c];
            cost += f64::from(problem.weights.moves[c]) * change * change;
            before[c] = plan[i * NU + c];
        }
    }
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
            cost += f64::from(problem.weights.tracking[c]) * error * error;
        }
        y.insert(0, next.to_vec());
        y.truncate(DD);
        predictions.push(next);
    }
    (cost, predictions)
}

fn check<
    const NX: usize,
    const H: usize,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NC: usize,
    const NV: usize,
>(
    seed: u64,
    cases: usize,
) where
    Shallow<NX, H, NY>: Model<NU, NY, NS, ND, DD>,
{
    let mut random = Random(seed);
    let mut worst = 0.0_f64;
    for case in 0..cases {
        let net = Shallow::<NX, H, NY>::random(&mut random, case % 2 == 1);
        let start = Regressor {
            u: random.matrix(0.8),
            y: random.matrix(0.8),
            s: random.array(0.8),
        };
        let reference: [[f32; NY]; N] = random.matrix(1.0);
        let disturbance = random.array(0.1);
        let problem = Problem {
            model: &net,
            start: &start,
            disturbance: &disturbance,
            reference: &reference,
            weights: Weights {
                tracking: core::array::from_fn(|_| 0.2 + random.unit()),
                moves: core::array::from_fn(|_| 0.2 * random.unit()),
            },
            bounds: Bounds {
                lower: [-1.0; NU],
                upper: [1.0; NU],
                rate: [f32::INFINITY; NU],
                previous: random.array(0.5),
            },
        };
        let plan: [f32; NV] = random.array(0.8);
        let mut quadratic = Quadratic::new();
        problem.linearise::<NC, NV>(&plan, &mut quadratic);
        let wide: Vec<f64> = plan.iter().map(|u| f64::from(*u)).collect();
        let (exact, _) = exact_rollout(&net, &problem, &wide);
        let cost = problem.cost(&plan);
        assert!(
            (f64::from(cost) - exact).abs() < 1e-4 * exact,
            "case {case}: {cost}, {exact}"
        );
        assert!(
            (quadratic.cost - cost).abs() <= 2e-6 * cost,
            "the two costs differ"
        );

        // Central differences of J, and of every prediction for the Gauss-Newton Hessian.
        let step = 1e-5;
        let mut slopes = Vec::new();
        let gradient: Vec<f64> = (0..NV)
            .map(|v| {
                let (mut above, mut below) = (wide.clone(), wide.clone());
                above[v] += step;
                below[v] -= step;
                let (above, below) = (
                    exact_rollout(&net, &problem, &above),
                    exact_rollout(&net, &problem, &below),
                );
                let pairs = above.1.iter().zip(&below.1);
                slopes.push(
                    pairs
                        .flat_map(|(a, b)| (0..NY).map(|c| (a[c] - b[c]) / (2.0 * step)))
                        .collect::<Vec<f64>>(),
                );
                (above.0 - below.0) / (2.0 * step)
            })
            .collect();
        let size = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        assert!(
            size > 1e-3,
            "case {case}: the gradient vanished, this point tests nothing"
        );
        for (v, exact) in gradient.iter().enumerate() {
            let error = (2.0 * f64::from(quadratic.gradient[v]) - exact).abs() / size;
            worst = worst.max(error);
            assert!(
                error < 2e-4,
                "case {case}: dJ/du{v} {exact}, relative error {error:e}"
            );
        }
        let mut largest = 0.0_f64;
        for a in 0..NV {
            for b in 0..NV {
                let tracking: f64 = (0..N * NY)
                    .map(|k| {
                        f64::from(problem.weights.tracking[k % NY]) * slopes[a][k] * slopes[b][k]
                    })
                    .sum();
                let lambda = f64::from(problem.weights.moves[a % NU]);
                let moves = if a == b {
                    if a + NU < NV { 2.0 * lambda } else { lambda }
                } else if a.abs_diff(b) == NU {
                    -lambda
                } else {
                    0.0
                };
                let exact = tracking + moves;
                largest = largest.max(exact.abs());
                let error = (f64::from(quadratic.hessian[a][b]) - exact).abs();
                assert!(
                    error < 1e-3 * (0.1 + largest),
                    "case {case}: H[{a}][{b}], {exact}"
                );
            }
        }
        assert!(largest > 1e-3, "case {case}: the Hessian vanished");
    }
    println!("N {N}, NC {NC}: largest relative error of the gradient {worst:.1e}");
}

#[test]
fn gradient_and_hessian_of_two_by_three_with_past() {
    check::<12, 10, 2, 3, 0, 3, 2, 10, 3, 6>(1, 150);
}

#[test]
fn gradient_and_hessian_with_every_command_free() {
    check::<12, 8, 2, 3, 0, 3, 2, 6, 6, 12>(2, 150);
}

#[test]
fn gradient_and_hessian_of_one_channel_held_at_once() {
    check::<5, 6, 1, 1, 1, 2, 2, 8, 1, 1>(3, 150);
}

#[test]
fn gradient_and_hessian_with_channels_and_no_memory() {
    check::<7, 6, 3, 1, 3, 1, 1, 7, 4, 12>(4, 150);
}
