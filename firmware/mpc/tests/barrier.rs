//! The published barrier: its value and derivatives against the formula in f64, and that it acts
//! before the limit.

mod common;

use common::{Linear, Random, quadratic};
use sinew_mpc::barrier::Barred;
use sinew_mpc::controller::{ControlLoop, Settings};
use sinew_mpc::limits::Limits;
use sinew_mpc::model::Regressor;
use sinew_mpc::scaling::ModelScaling;
use sinew_mpc::{Bounds, Horizons, Problem, Quadratic, Weights};

/// Steady gain 1.
const MODEL: Linear = Linear {
    a: 0.5,
    b: 0.4,
    b1: 0.1,
};

/// Cost, half gradient and half Hessian of a plan of two channels in two blocks.
fn around(plan: &[f32; 4], barrier: f32) -> (f32, Quadratic<4>) {
    let problem = Problem {
        model: &Barred(MODEL, barrier),
        start: &Regressor {
            u: [[0.1, 0.2]; 2],
            y: [[0.3, -0.1]],
            s: [],
        },
        disturbance: &[0.0; 2],
        reference: &[[0.5, 0.2]; 4],
        weights: Weights {
            tracking: [1.0; 2],
            moves: [0.1; 2],
        },
        bounds: &Bounds {
            lower: [-1.0, -2.0],
            upper: [3.0, 1.0],
            rate: [f32::INFINITY; 4],
            previous: [0.0; 2],
        },
        horizons: &Horizons::<4, 2>::every_step(),
    };
    quadratic(&problem, plan)
}

#[test]
fn cost_gradient_and_hessian_are_the_published_formula() {
    let mut random = Random(71);
    // r is the range, b its middle.
    let (range, middle) = ([4.0_f64, 3.0], [1.0_f64, -0.5]);
    for case in 0..2000 {
        let s = f64::from(0.01 + random.unit());
        let plan: [f32; 4] = core::array::from_fn(|v| {
            let c = v % 2;
            (middle[c] + 0.49 * range[c] * f64::from(random.signed())) as f32
        });
        let (with, without) = (around(&plan, s as f32), around(&plan, 0.0));
        let mut cost = 0.0;
        let mut size = 0.1_f64;
        for (v, u) in plan.iter().enumerate() {
            let (r, b, u) = (range[v % 2], middle[v % 2], f64::from(*u));
            let (low, high) = (u + r / 2.0 - b, r / 2.0 + b - u);
            cost += s / low + s / high - 4.0 * s / r;
            let slope = s / (high * high) - s / (low * low);
            let curvature = 2.0 * s / high.powi(3) + 2.0 * s / low.powi(3);
            let got = f64::from(with.1.gradient[v] - without.1.gradient[v]);
            assert!(
                (2.0 * got - slope).abs() < 1e-4 * (1.0 + slope.abs()),
                "case {case}: slope {slope}, {got}"
            );
            let got = f64::from(with.1.hessian[v][v] - without.1.hessian[v][v]);
            assert!(
                (2.0 * got - curvature).abs() < 1e-4 * (1.0 + curvature),
                "case {case}: curvature {curvature}, {got}"
            );
            size = size.max(s / low.min(high));
        }
        let got = f64::from(with.0 - without.0);
        assert!(
            (got - cost).abs() < 1e-5 * (1.0 + size),
            "case {case}: {got}, {cost}"
        );
    }
}

type Loop = ControlLoop<Barred<Linear>, 1, 1, 0, 2, 1, 6, 3, 3>;

fn controller(sharpness: f32, safe: f32) -> Loop {
    let settings = Settings {
        tracking_weight: [1.0],
        move_suppression: [0.05],
        disturbance_gain: 0.5,
        iterations: 4,
        max_missing_samples: 5,
    };
    let limits = Limits {
        lower: [-1.0],
        upper: [1.0],
        rate: [0.3],
        safe: [safe],
    };
    ControlLoop::new(
        Barred(MODEL, sharpness),
        ModelScaling::IDENTITY,
        limits,
        settings,
        Horizons::every_step(),
    )
}

/// Largest command on the way to a reference beyond reach.
fn furthest(sharpness: f32, safe: f32) -> f32 {
    let mut control = controller(sharpness, safe);
    let (mut y, mut before, mut furthest) = (safe, safe, -1.0_f32);
    for k in 0..60 {
        let step = control.step(&[y], &[], &[[1.2]; 6]);
        assert!(step.status.is_controlled());
        y = 0.5 * y + 0.4 * step.u[0] + 0.1 * before;
        before = step.u[0];
        if k >= 10 {
            furthest = furthest.max(before);
        }
    }
    furthest
}

#[test]
fn the_barrier_turns_away_before_the_limit_and_the_limit_alone_does_not() {
    assert_eq!(furthest(0.0, 0.0), 1.0);
    let distances = [1e-3, 1e-2, 1e-1].map(|s| 1.0 - furthest(s, 0.0));
    println!("distance kept at s = 1e-3, 1e-2, 1e-1: {distances:?}");
    assert!(distances[0] > 0.01, "{distances:?}");
    assert!(distances.is_sorted(), "{distances:?}");
}

#[test]
fn from_the_limit_itself_the_barrier_leads_inwards() {
    assert!(furthest(1e-2, 1.0) < 0.99);
    assert_eq!(furthest(0.0, 1.0), 1.0);
}

#[test]
fn a_barrier_that_is_no_number_is_none() {
    for sharpness in [f32::NAN, f32::INFINITY, -1.0] {
        assert_eq!(furthest(sharpness, 0.0), 1.0);
    }
}
