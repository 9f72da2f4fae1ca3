//! The weight of the commands themselves: inputs that can do each other's work share it
//! (docs/explanation/controller.md, eq. 4c).

mod common;

use common::quadratic;
use sinew_mpc::controller::{ControlLoop, Settings};
use sinew_mpc::limits::Limits;
use sinew_mpc::model::{Jacobian, Model, Regressor};
use sinew_mpc::scaling::ModelScaling;
use sinew_mpc::sensitivity::Propagate;
use sinew_mpc::{Bounds, Horizons, Problem, Quadratic, Tuning, Weights};

/// Two inputs that push one output alike; R in millionths.
#[derive(Clone, Copy)]
struct Pair<const MILLIONTHS: u32>;

impl<const MILLIONTHS: u32> Model<2, 1, 0, 1, 1> for Pair<MILLIONTHS> {
    type Trace = ();
    const TRACE: () = ();

    fn predict(&self, x: &Regressor<2, 1, 0, 1, 1>, (): &mut ()) -> [f32; 1] {
        [0.5 * x.y[0][0] + 0.3 * (x.u[0][0] + x.u[0][1])]
    }

    fn jacobian(&self, (): &(), jacobian: &mut Jacobian<2, 1, 1, 1>) {
        jacobian.u[0] = [[0.3, 0.3]];
        jacobian.y[0] = [[0.5]];
    }
}

impl<const MILLIONTHS: u32> Propagate<2, 1, 0, 1, 1> for Pair<MILLIONTHS> {}

impl<const MILLIONTHS: u32> Tuning for Pair<MILLIONTHS> {
    const COMMAND_WEIGHT: f32 = MILLIONTHS as f32 * 1e-6;
}

/// Commands and output after `steps` from commands that pull against each other.
fn after<const MILLIONTHS: u32>(steps: usize, reference: f32) -> ([f32; 2], f32) {
    let settings = Settings {
        tracking_weight: [1.0],
        move_suppression: [0.1; 2],
        disturbance_gain: 0.2,
        iterations: 2,
        max_missing_samples: 5,
    };
    let limits = Limits {
        lower: [-1.0; 2],
        upper: [1.0; 2],
        rate: [0.3; 2],
        safe: [0.9, -0.9],
    };
    let horizons = Horizons::every_step();
    let mut control: ControlLoop<Pair<MILLIONTHS>, 2, 1, 0, 1, 1, 5, 2, 4> =
        ControlLoop::new(Pair, ModelScaling::IDENTITY, limits, settings, horizons);
    let (mut y, mut u) = (0.0, [0.9, -0.9]);
    for _ in 0..steps {
        u = control.step(&[y], &[], &[[reference]; 5]).u;
        y = 0.5 * y + 0.3 * (u[0] + u[1]);
    }
    (u, y)
}

#[test]
fn inputs_that_pull_against_each_other_stop_where_commands_have_a_weight() {
    let (apart, _) = after::<0>(400, 0.0);
    assert!(
        apart[0] > 0.85 && apart[1] < -0.85,
        "they do so anyway: {apart:?}"
    );
    let (shared, y) = after::<2000>(400, 0.0);
    assert!(
        shared.iter().all(|u| u.abs() < 0.01) && y.abs() < 0.01,
        "{shared:?}, {y}"
    );
}

#[test]
fn inputs_share_what_a_reference_takes_and_the_output_is_a_little_short_of_it() {
    let (u, y) = after::<2000>(400, 0.6);
    assert!((u[0] - u[1]).abs() < 0.01, "{u:?}");
    assert!(y < 0.6 && y > 0.59, "{y}");
    let (_, y) = after::<0>(400, 0.6);
    assert!((y - 0.6).abs() < 1e-5, "{y}");
}

/// Cost, half gradient and half Hessian of a plan of two blocks.
fn around<const MILLIONTHS: u32>(plan: &[f32; 4]) -> (f32, Quadratic<4>) {
    let problem = Problem {
        model: &Pair::<MILLIONTHS>,
        start: &Regressor {
            u: [[0.1, 0.2]],
            y: [[0.3]],
            s: [],
        },
        disturbance: &[0.0],
        reference: &[[0.5]; 4],
        weights: Weights {
            tracking: [1.0],
            moves: [0.1; 2],
        },
        bounds: &Bounds {
            lower: [-1.0; 2],
            upper: [1.0; 2],
            rate: [f32::INFINITY; 4],
            previous: [0.1, 0.2],
        },
        horizons: &Horizons::<4, 2>::every_step(),
    };
    quadratic(&problem, plan)
}

#[test]
fn cost_gradient_and_hessian_gain_the_square_of_each_command() {
    let plan = [0.4, -0.7, 0.2, 0.9];
    let (with, without) = (around::<500_000>(&plan), around::<0>(&plan));
    let squares: f32 = plan.iter().map(|u| u * u).sum();
    assert!((with.0 - without.0 - 0.5 * squares).abs() < 1e-5);
    for (v, u) in plan.iter().enumerate() {
        let gained = with.1.gradient[v] - without.1.gradient[v];
        assert!((gained - 0.5 * u).abs() < 1e-6, "{v}: {gained}");
        let gained = with.1.hessian[v][v] - without.1.hessian[v][v];
        assert!((gained - 0.5).abs() < 1e-6, "{v}: {gained}");
    }
}
