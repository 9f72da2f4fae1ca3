//! The exact Hessian of J through the whole recursion against double precision, and what it is good
//! for.
#![allow(
    clippy::needless_range_loop,
    reason = "the indices are those of the equations, over several arrays at once"
)]

mod common;

use common::case::{Case, FAR};
use common::rollout::exact_rollout;
use common::{Random, Shallow};
use sinew_mpc::controller::{ControlLoop, Settings};
use sinew_mpc::exact_hessian::Exact;
use sinew_mpc::limits::Limits;
use sinew_mpc::model::{Model, Regressor, SecondOrder};
use sinew_mpc::rollout::Trajectory;
use sinew_mpc::scaling::ModelScaling;
use sinew_mpc::{Bounds, CostTerm, Horizons, Plan, Problem, Quadratic, Weights, solve};

/// Half of the Hessian of J by second differences of J in f64.
fn second_differences<const NV: usize>(
    j: impl Fn(&[f64]) -> f64,
    at: &[f32; NV],
) -> [[f64; NV]; NV] {
    let h = 2e-4;
    let cost = |moves: &[(usize, f64)]| {
        let mut plan: Vec<f64> = at.iter().map(|u| f64::from(*u)).collect();
        for (v, by) in moves {
            plan[*v] += by;
        }
        j(&plan)
    };
    let mut hessian = [[0.0; NV]; NV];
    for a in 0..NV {
        for b in 0..=a {
            let mixed =
                cost(&[(a, h), (b, h)]) - cost(&[(a, h), (b, -h)]) - cost(&[(a, -h), (b, h)])
                    + cost(&[(a, -h), (b, -h)]);
            hessian[a][b] = mixed / (8.0 * h * h);
            hessian[b][a] = hessian[a][b];
        }
    }
    hessian
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
    const NB: usize,
    const NV: usize,
>(
    seed: u64,
    cases: usize,
    horizons: &Horizons<N, NB>,
) where
    Shallow<NX, H, NY>: SecondOrder<NU, NY, NS, ND, DD>,
{
    let mut random = Random(seed);
    let (mut worst, mut left_out, mut indefinite) = (0.0_f64, 0.0_f64, 0);
    for case in 0..cases {
        let net = Exact(Shallow::<NX, H, NY>::random(&mut random, case % 2 == 1));
        let drawn = Case::<NU, NY, NS, ND, DD, N, NV>::draw(&mut random, FAR);
        let (_, exact) = drawn.derive(&net, horizons);
        let (_, gauss_newton) = drawn.derive(&net.0, horizons);
        assert_eq!(exact.gradient, gauss_newton.gradient, "case {case}");

        let problem = drawn.problem(&net, horizons);
        let plan = drawn.plan;
        let reference = second_differences(|u| exact_rollout(&net.0, &problem, u).0, &plan);
        let largest = reference
            .as_flattened()
            .iter()
            .fold(0.0_f64, |m, h| m.max(h.abs()));
        assert!(largest > 1e-3, "case {case}: the Hessian vanished");
        for a in 0..NV {
            indefinite += usize::from(reference[a][a] < 0.0);
            for b in 0..NV {
                let error = (f64::from(exact.hessian[a][b]) - reference[a][b]).abs();
                let without = (f64::from(gauss_newton.hessian[a][b]) - reference[a][b]).abs();
                worst = worst.max(error / (0.1 + largest));
                left_out = left_out.max(without / (0.1 + largest));
                assert!(
                    error < 2e-4 * (0.1 + largest),
                    "case {case}: H[{a}][{b}] {}, {}",
                    exact.hessian[a][b],
                    reference[a][b]
                );
            }
        }
    }
    assert!(
        left_out > 0.05,
        "Gauss-Newton was as good: nothing was tested"
    );
    println!(
        "N {N}, blocks {:?}: largest error {worst:.1e} of the largest element, Gauss-Newton's {left_out:.1e}; \
         {indefinite} negative diagonal elements in {cases} cases",
        horizons.length
    );
}

#[test]
fn exact_hessian_of_two_by_three_in_blocks() {
    check::<12, 10, 2, 3, 0, 3, 2, 10, 4, 8>(21, 1000, &Horizons::new(1, [2, 2, 3, 3]));
}

#[test]
fn exact_hessian_with_every_command_free_and_late_first_step() {
    check::<12, 8, 2, 3, 0, 3, 2, 6, 5, 10>(22, 500, &Horizons::every_step());
    check::<12, 8, 2, 3, 0, 3, 2, 7, 2, 4>(23, 500, &Horizons::new(3, [1, 2]));
}

#[test]
fn exact_hessian_of_one_channel_and_with_held_channels() {
    check::<5, 6, 1, 1, 1, 2, 2, 8, 1, 1>(24, 1000, &Horizons::every_step());
    check::<7, 6, 3, 1, 3, 1, 1, 7, 2, 6>(25, 500, &Horizons::every_step());
}

type Net = Shallow<12, 10, 3>;

/// The plan and the largest element of the gradient after `rounds` iterations, without limits in
/// the way.
fn descend<M: CostTerm<2, 3, 0, 3, 2>>(
    model: &M,
    start: &Regressor<2, 3, 0, 3, 2>,
    reference: &[[f32; 3]; 8],
    from: &[f32; 4],
    rounds: usize,
) -> ([f32; 4], f32) {
    let problem = Problem {
        model,
        start,
        disturbance: &[0.0; 3],
        reference,
        weights: Weights {
            tracking: [1.0; 3],
            moves: [0.02; 2],
        },
        bounds: &Bounds {
            lower: [-50.0; 2],
            upper: [50.0; 2],
            rate: [f32::INFINITY; 4],
            previous: [0.0; 2],
        },
        horizons: &Horizons::new(1, [3, 5]),
    };
    let mut plan = Plan::new();
    plan.u = *from;
    for _ in 0..rounds {
        let _ = solve(&problem, &mut plan, 1);
    }
    let mut trajectory = Trajectory::new(M::Model::TRACE, M::RESIDUALS);
    let mut quadratic = Quadratic::new();
    problem.rollout(&plan.u, &mut trajectory);
    problem.linearise(&plan.u, &trajectory, &mut quadratic);
    let steepest = quadratic.gradient.iter().fold(0.0, |m, g| g.abs().max(m));
    (plan.u, steepest)
}

/// References out of reach leave large errors at the optimum; there Gauss-Newton converges slowly,
/// and Newton at once.
#[test]
fn near_an_optimum_the_exact_hessian_converges_faster() {
    let mut random = Random(31);
    let (mut flatter, mut cases) = (0, 0);
    for _ in 0..1000 {
        let net = Net::random(&mut random, false);
        let start = Regressor {
            u: random.matrix(0.5),
            y: random.matrix(0.5),
            s: [],
        };
        let reference: [[f32; 3]; 8] = random.matrix(3.0);
        let exact = Exact(net.clone());
        let (optimum, slope) = descend(&exact, &start, &reference, &[0.0; 4], 60);
        if slope > 1e-3 || optimum.iter().any(|u| u.abs() > 3.0) {
            continue;
        }
        let beside = optimum.map(|u| u + 0.1 * random.signed());
        let (_, walked) = descend(&net, &start, &reference, &beside, 2);
        let (_, converged) = descend(&exact, &start, &reference, &beside, 2);
        if walked > 5e-4 || converged > 5e-4 {
            cases += 1;
            flatter += usize::from(converged < walked);
        }
    }
    println!("{flatter} of {cases} plans are flatter after two exact iterations");
    assert!(
        cases > 50,
        "{cases}: every start converged, nothing was compared"
    );
    assert!(10 * flatter > 9 * cases, "{flatter} of {cases}");
}

#[test]
fn commands_with_the_exact_hessian_are_inside_the_limits() {
    let mut random = Random(41);
    for _ in 0..200 {
        let model = Exact(Net::random(&mut random, false));
        let mut control: ControlLoop<Exact<Net>, 2, 3, 0, 3, 2, 6, 2, 4> = ControlLoop::new(
            model,
            ModelScaling::IDENTITY,
            Limits {
                lower: [-0.5; 2],
                upper: [0.5; 2],
                rate: [0.2; 2],
                safe: [0.0; 2],
            },
            Settings {
                tracking_weight: [1.0; 3],
                move_suppression: [0.01; 2],
                disturbance_gain: 0.3,
                iterations: 4,
                max_missing_samples: 3,
            },
            Horizons::every_step(),
        );
        let mut before = [0.0_f32; 2];
        let mut moved = false;
        for _ in 0..10 {
            let step = control.step(&random.array(1.0), &[], &random.matrix(3.0));
            for (u, before) in step.u.iter().zip(&before) {
                assert!(u.abs() <= 0.5 && f64::from((u - before).abs()) <= 0.2 + 1e-7);
                moved |= u != before;
            }
            before = step.u;
        }
        assert!(moved);
    }
}
