//! The gradient of J through the whole recursion, and the Gauss-Newton Hessian, against a double
//! precision evaluation of the same cost over random networks, states, plans and shapes.
#![allow(
    clippy::needless_range_loop,
    reason = "the indices are those of the equations, over several arrays at once"
)]

mod common;

use common::rollout::exact_rollout;
use common::{Random, Shallow};
use sinew_mpc::model::{Model, Regressor};
use sinew_mpc::rollout::Trajectory;
use sinew_mpc::{Bounds, Horizons, Problem, Quadratic, Weights};

fn check<
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
    seed: u64,
    cases: usize,
    horizons: &Horizons<N, NB>,
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
            bounds: &Bounds {
                lower: [-1.0; NU],
                upper: [1.0; NU],
                rate: [f32::INFINITY; NV],
                previous: random.array(0.5),
            },
            horizons,
        };
        let plan: [f32; NV] = random.array(0.8);
        let mut quadratic = Quadratic::new();
        let mut trajectory =
            Trajectory::new(<Shallow<NX, H, NY> as Model<NU, NY, NS, ND, DD>>::TRACE, ());
        let cost = problem.rollout(&plan, &mut trajectory);
        problem.linearise(&plan, &trajectory, &mut quadratic);
        let wide: Vec<f64> = plan.iter().map(|u| f64::from(*u)).collect();
        let (exact, _) = exact_rollout(&net, &problem, &wide);
        assert!(
            (f64::from(cost) - exact).abs() < 1e-4 * exact,
            "case {case}: {cost}, {exact}"
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
        // A small gradient is the difference of large terms.
        let size = size.max(0.2);
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
                let tracking: f64 = ((horizons.first - 1) * NY..N * NY)
                    .map(|k| {
                        f64::from(problem.weights.tracking[k % NY]) * slopes[a][k] * slopes[b][k]
                    })
                    .sum();
                let lambda = |v: usize| {
                    let length = horizons.length.get(v / NU);
                    let lambda = f64::from(problem.weights.moves[v % NU]);
                    length.map_or(0.0, |length| lambda / f64::from(*length))
                };
                let moves = if a == b {
                    lambda(a) + lambda(a + NU)
                } else if a.abs_diff(b) == NU {
                    -lambda(a.max(b))
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
    println!(
        "N1 {}, N {N}, blocks {:?}: largest relative error of the gradient {worst:.1e}",
        horizons.first, horizons.length
    );
}

#[test]
fn gradient_and_hessian_of_two_by_three_with_past() {
    check::<12, 10, 2, 3, 0, 3, 2, 10, 3, 6>(1, 1000, &Horizons::every_step());
}

#[test]
fn gradient_and_hessian_with_every_command_free() {
    check::<12, 8, 2, 3, 0, 3, 2, 6, 6, 12>(2, 500, &Horizons::every_step());
}

#[test]
fn gradient_and_hessian_in_blocks_of_equal_moves() {
    check::<12, 10, 2, 3, 0, 3, 2, 10, 4, 8>(5, 1000, &Horizons::new(1, [2, 2, 3, 3]));
    check::<12, 10, 2, 3, 0, 3, 2, 10, 3, 6>(6, 300, &Horizons::new(1, [1, 4, 3]));
}

#[test]
fn gradient_and_hessian_where_the_first_steps_do_not_count() {
    check::<12, 10, 2, 3, 0, 3, 2, 8, 3, 6>(7, 300, &Horizons::new(4, [1, 2, 2]));
}

#[test]
fn gradient_and_hessian_of_one_channel_held_at_once() {
    check::<5, 6, 1, 1, 1, 2, 2, 8, 1, 1>(3, 500, &Horizons::every_step());
}

#[test]
fn gradient_and_hessian_with_channels_and_no_memory() {
    check::<7, 6, 3, 1, 3, 1, 1, 7, 4, 12>(4, 500, &Horizons::every_step());
}
