//! The loop around plants that it does not know: no steady error, limits, gaps, other numbers.

mod common;

use common::{Linear, Random, Shallow};
use sinew_mpc::Horizons;
use sinew_mpc::controller::{ControlLoop, Settings, Step};
use sinew_mpc::limits::Limits;
use sinew_mpc::model::{Jacobian, Model, Regressor};
use sinew_mpc::scaling::{ModelScaling, Scaling};
use sinew_mpc::sensitivity::Propagate;
use sinew_mpc::status::Status;

const N: usize = 8;
type Loop = ControlLoop<Linear, 1, 1, 0, 2, 1, N, 3, 3>;

const SETTINGS: Settings<1, 1> = Settings {
    tracking_weight: [1.0],
    move_suppression: [0.05],
    disturbance_gain: 0.5,
    iterations: 2,
    max_missing_samples: 5,
};

const LIMITS: Limits<1> = Limits {
    lower: [-2.0],
    upper: [2.0],
    rate: [0.2],
    safe: [0.0],
};

fn controller(a: f32, limits: Limits<1>) -> Loop {
    let model = Linear {
        a,
        b: 0.2,
        b1: 0.05,
    };
    ControlLoop::new(
        model,
        ModelScaling::IDENTITY,
        limits,
        SETTINGS,
        Horizons::every_step(),
    )
}

/// The plant in f64: other gain, other pole, a constant load the model knows nothing of.
struct Plant {
    a: f64,
    b: f64,
    b1: f64,
    load: f64,
    y: f64,
    before: f64,
}

impl Plant {
    fn advance(&mut self, u: f32) {
        let u = f64::from(u);
        self.y = self.a * self.y + self.b * u + self.b1 * self.before + self.load;
        self.before = u;
    }
}

fn run(c: &mut Loop, plant: &mut Plant, reference: f32, steps: usize) -> Step<1> {
    let mut last = c.step(&[plant.y as f32], &[], &[[reference]; N]);
    for _ in 0..steps {
        plant.advance(last.u[0]);
        last = c.step(&[plant.y as f32], &[], &[[reference]; N]);
    }
    last
}

#[test]
fn constant_load_and_gain_error_leave_no_steady_error() {
    // (pole of model, pole, gain, load of plant); the last two plants integrate.
    let cases = [
        (0.9, 0.85, 0.15, 0.05),
        (0.8, 0.9, 0.3, -0.08),
        (1.0, 1.0, 0.15, 0.04),
        (1.0, 1.0, 0.26, -0.06),
    ];
    for (model_pole, a, b, load) in cases {
        let mut c = controller(model_pole, LIMITS);
        let mut plant = Plant {
            a,
            b,
            b1: 0.04,
            load,
            y: 0.3,
            before: 0.0,
        };
        let early = run(&mut c, &mut plant, 1.0, 3);
        assert!((plant.y - 1.0).abs() > 0.1, "there was nothing to control");
        assert!(early.status.is_controlled());
        let end = run(&mut c, &mut plant, 1.0, 300);
        let error = (plant.y - 1.0).abs();
        // The outputs range over 2.
        assert!(error < 2e-4, "pole {a}: steady error {error:e}");
        assert!(end.status.is_controlled());
        let d = c.estimator().disturbance()[0];
        assert!(d.abs() > 0.005, "pole {a}: the load went unnoticed");
    }
}

#[test]
fn without_the_disturbance_estimate_there_is_a_steady_error() {
    let mut c = controller(0.9, LIMITS);
    c.settings_mut().disturbance_gain = 0.0;
    let mut plant = Plant {
        a: 0.85,
        b: 0.15,
        b1: 0.04,
        load: 0.05,
        y: 0.3,
        before: 0.0,
    };
    let _ = run(&mut c, &mut plant, 1.0, 300);
    assert!(
        (plant.y - 1.0).abs() > 0.01,
        "then the test above proves nothing"
    );
}

#[test]
fn unreachable_reference_saturates_and_comes_back_without_windup() {
    let mut c = controller(0.9, LIMITS);
    let mut plant = Plant {
        a: 0.9,
        b: 0.2,
        b1: 0.05,
        load: 0.0,
        y: 0.0,
        before: 0.0,
    };
    let end = run(&mut c, &mut plant, 50.0, 100);
    assert_eq!(end.u, [2.0]);
    // Reachable again: the command leaves the limit at the next step, at the full rate.
    let next = c.step(&[plant.y as f32], &[], &[[0.0]; N]);
    assert!((next.u[0] - 1.8).abs() < 1e-6, "{:?}", next);
    let _ = run(&mut c, &mut plant, 1.0, 200);
    assert!((plant.y - 1.0).abs() < 2e-4);
}

#[test]
fn saturated_start_and_safe_command_at_the_edge() {
    let limits = Limits {
        safe: [2.0],
        ..LIMITS
    };
    let mut c = controller(0.9, limits);
    let mut plant = Plant {
        a: 0.9,
        b: 0.2,
        b1: 0.05,
        load: 0.0,
        y: 5.0,
        before: 2.0,
    };
    let first = c.step(&[5.0], &[], &[[0.0]; N]);
    assert!((first.u[0] - 1.8).abs() < 1e-6);
    plant.advance(first.u[0]);
    let _ = run(&mut c, &mut plant, 0.0, 200);
    assert!(plant.y.abs() < 2e-4);
}

#[test]
fn a_short_gap_is_predicted_and_a_long_one_goes_to_the_safe_command() {
    let limits = Limits {
        safe: [-1.0],
        ..LIMITS
    };
    let mut c = controller(0.9, limits);
    let mut plant = Plant {
        a: 0.9,
        b: 0.2,
        b1: 0.05,
        load: 0.03,
        y: 0.0,
        before: -1.0,
    };
    let mut last = run(&mut c, &mut plant, 1.0, 100);
    let held = last.u[0];
    let mut before = last.u[0];
    for missing in 1..=30 {
        plant.advance(last.u[0]);
        last = c.step(&[f32::NAN], &[], &[[1.0]; N]);
        assert!((last.u[0] - before).abs() <= 0.2 + 1e-6);
        before = last.u[0];
        if missing <= 5 {
            assert!(
                last.predicted && last.status.is_controlled(),
                "gap {missing}: {last:?}"
            );
            assert!(
                (last.u[0] - held).abs() < 0.02,
                "gap {missing}: the bridge is not steady"
            );
            assert!((plant.y - 1.0).abs() < 0.01);
        } else {
            assert_eq!(last.status, Status::SignalLost, "gap {missing}");
        }
    }
    assert_eq!(last.u, [-1.0], "the safe command was not reached");
    assert_eq!(c.estimator().missed(), 30);
    // Samples return: no jump beyond the rate, and the target is met again.
    plant.advance(last.u[0]);
    let back = c.step(&[plant.y as f32], &[], &[[1.0]; N]);
    assert!(back.status.is_controlled() && (back.u[0] - last.u[0]).abs() <= 0.2 + 1e-6);
    plant.advance(back.u[0]);
    let _ = run(&mut c, &mut plant, 1.0, 200);
    assert!((plant.y - 1.0).abs() < 2e-4);
}

#[test]
fn a_gap_at_rest_is_not_felt() {
    let limits = Limits {
        rate: [f32::INFINITY],
        ..LIMITS
    };
    let mut c = controller(0.9, limits);
    let mut plant = Plant {
        a: 0.85,
        b: 0.15,
        b1: 0.04,
        load: 0.05,
        y: 0.0,
        before: 0.0,
    };
    let steady = run(&mut c, &mut plant, 1.0, 200).u[0];
    for k in 0..8 {
        let y = if k % 4 == 1 { f32::NAN } else { plant.y as f32 };
        let step = c.step(&[y], &[], &[[1.0]; N]);
        assert!(
            (step.u[0] - steady).abs() < 1e-3,
            "step {k}: {} after {steady}",
            step.u[0]
        );
        plant.advance(step.u[0]);
    }
}

#[test]
fn nothing_moves_before_the_first_sample() {
    let mut c = controller(0.9, LIMITS);
    for _ in 0..20 {
        let step = c.step(&[f32::NAN], &[], &[[1.0]; N]);
        assert_eq!((step.u, step.status), ([0.0], Status::SignalLost));
    }
    assert!(c.step(&[0.0], &[], &[[1.0]; N]).status.is_controlled());
}

#[test]
fn bad_requests_follow_the_earlier_plan_and_say_so() {
    let mut c = controller(0.9, LIMITS);
    let mut plant = Plant {
        a: 0.9,
        b: 0.2,
        b1: 0.05,
        load: 0.0,
        y: 0.0,
        before: 0.0,
    };
    let steady = run(&mut c, &mut plant, 1.0, 100);
    let mut reference = [[1.0]; N];
    reference[N - 1] = [f32::NAN];
    let step = c.step(&[plant.y as f32], &[], &reference);
    assert_eq!(step.status, Status::BadReference);
    assert!((step.u[0] - steady.u[0]).abs() < 1e-4);
    c.settings_mut().tracking_weight = [f32::NAN];
    let step = c.step(&[plant.y as f32], &[], &[[1.0]; N]);
    assert_eq!(step.status, Status::BadSettings);
    assert!((step.u[0] - steady.u[0]).abs() < 1e-4);
    *c.settings_mut() = SETTINGS;
    assert!(
        c.step(&[plant.y as f32], &[], &[[1.0]; N])
            .status
            .is_controlled()
    );
}

#[test]
fn an_absurd_measurement_is_a_missing_one() {
    let mut c = controller(0.9, LIMITS);
    let mut plant = Plant {
        a: 0.9,
        b: 0.2,
        b1: 0.05,
        load: 0.0,
        y: 0.0,
        before: 0.0,
    };
    let _ = run(&mut c, &mut plant, 1.0, 100);
    for y in [f32::INFINITY, 1e30, -1e9] {
        assert!(c.step(&[y], &[], &[[1.0]; N]).predicted);
    }
    let _ = run(&mut c, &mut plant, 1.0, 100);
    assert!((plant.y - 1.0).abs() < 2e-4);
}

#[test]
fn flat_cost_holds_the_command() {
    let mut c = controller(0.9, LIMITS);
    let mut plant = Plant {
        a: 0.9,
        b: 0.2,
        b1: 0.05,
        load: 0.0,
        y: 0.0,
        before: 0.0,
    };
    let steady = run(&mut c, &mut plant, 1.0, 100);
    c.settings_mut().tracking_weight = [0.0];
    c.settings_mut().move_suppression = [0.0];
    let step = c.step(&[plant.y as f32], &[], &[[0.0]; N]);
    assert_eq!(step.status, Status::Converged);
    assert!((step.u[0] - steady.u[0]).abs() < 1e-4);
}

#[test]
fn scaling_changes_the_units_and_nothing_else() {
    let scaling = ModelScaling {
        u: Scaling {
            span: [4.0],
            offset: [1.0],
        },
        y: Scaling {
            span: [0.5],
            offset: [-2.0],
        },
        s: Scaling::IDENTITY,
    };
    let limits = Limits {
        lower: [-7.0],
        upper: [9.0],
        rate: [0.8],
        safe: [1.0],
    };
    let model = Linear {
        a: 0.9,
        b: 0.2,
        b1: 0.05,
    };
    let mut scaled: Loop =
        ControlLoop::new(model, scaling, limits, SETTINGS, Horizons::every_step());
    let mut plain = controller(0.9, LIMITS);
    for k in 0..50 {
        let y = 0.125 * (k % 7) as f32;
        let a = plain.step(&[y], &[], &[[1.0]; N]);
        let b = scaled.step(&[0.5 * y - 2.0], &[], &[[-1.5]; N]);
        assert!(
            (b.u[0] - (4.0 * a.u[0] + 1.0)).abs() < 1e-5,
            "step {k}: {a:?} {b:?}"
        );
    }
    // A negative span turns the axis round.
    let turned = ModelScaling {
        u: Scaling {
            span: [-1.0],
            offset: [0.0],
        },
        ..ModelScaling::IDENTITY
    };
    let mut turned: Loop =
        ControlLoop::new(model, turned, LIMITS, SETTINGS, Horizons::every_step());
    let mut plain = controller(0.9, LIMITS);
    for _ in 0..20 {
        let (a, b) = (
            plain.step(&[0.0], &[], &[[9.0]; N]),
            turned.step(&[0.0], &[], &[[9.0]; N]),
        );
        assert_eq!(a.u[0], -b.u[0]);
    }
}

#[test]
fn reset_forgets_the_past_and_keeps_the_command() {
    let mut c = controller(0.9, LIMITS);
    let mut plant = Plant {
        a: 0.85,
        b: 0.15,
        b1: 0.04,
        load: 0.05,
        y: 0.0,
        before: 0.0,
    };
    let before = run(&mut c, &mut plant, 1.0, 100);
    c.reset();
    assert_eq!(c.estimator().disturbance(), &[0.0]);
    let after = c.step(&[plant.y as f32], &[], &[[1.0]; N]);
    assert!((after.u[0] - before.u[0]).abs() <= 0.2 + 1e-6);
    assert!(before.u[0].abs() > 0.5, "the command was small anyway");
}

#[test]
fn ramp_to_safe_goes_to_the_safe_command_and_control_starts_again() {
    let mut c = controller(0.9, LIMITS);
    let mut plant = Plant {
        a: 0.85,
        b: 0.15,
        b1: 0.04,
        load: 0.05,
        y: 0.0,
        before: 0.0,
    };
    let steady = run(&mut c, &mut plant, 1.0, 100).u[0];
    assert!(steady > 0.3, "already at the safe command");
    let first = c.ramp_to_safe()[0];
    assert!(
        (steady - first - 0.2).abs() < 1e-6,
        "{first} after {steady}"
    );
    for _ in 0..10 {
        plant.advance(c.ramp_to_safe()[0]);
    }
    assert_eq!(c.ramp_to_safe(), [0.0]);
    let _ = run(&mut c, &mut plant, 1.0, 300);
    assert!((plant.y - 1.0).abs() < 2e-4);
}

/// The cost that a step reports never exceeds that of the plan it started from, on curved
/// predictors.
#[test]
fn more_iterations_never_cost_more() {
    let mut random = Random(9);
    let (mut better, mut most) = (0, 0);
    for _ in 0..300 {
        let net = Shallow::<12, 10, 3>::random(&mut random, true);
        let y: [f32; 3] = random.array(0.5);
        let reference: [[f32; 3]; 10] = [random.array(1.0); 10];
        let mut last = f32::INFINITY;
        for iterations in 1..=6 {
            let settings = Settings {
                tracking_weight: [1.0, 1.0, 0.5],
                move_suppression: [0.001; 2],
                disturbance_gain: 0.0,
                iterations,
                max_missing_samples: 5,
            };
            let limits = Limits {
                lower: [-1.0; 2],
                upper: [1.0; 2],
                rate: [0.5; 2],
                safe: [0.0; 2],
            };
            let mut c: ControlLoop<_, 2, 3, 0, 3, 2, 10, 3, 6> = ControlLoop::new(
                net.clone(),
                ModelScaling::IDENTITY,
                limits,
                settings,
                Horizons::every_step(),
            );
            let step = c.step(&y, &[], &reference);
            assert!(step.status.is_controlled() && step.iterations <= iterations);
            assert!(
                step.cost <= last * 1.000_01,
                "{iterations}: {} after {last}",
                step.cost
            );
            better += usize::from(step.cost < 0.999 * last && iterations > 1);
            last = step.cost;
            most = most.max(step.iterations);
        }
    }
    assert!(
        better > 100 && most > 3,
        "iterations made no difference: {better}, {most}"
    );
}

/// A device that sticks: below 0.3 of a unit a command does next to nothing, backwards.
#[derive(Clone, Copy)]
struct Sticking;

impl Sticking {
    /// Answer to a command and its slope.
    fn answer(u: f32) -> (f32, f32) {
        if u > 0.3 {
            (0.5 * (u - 0.3), 0.5)
        } else if u < -0.3 {
            (0.5 * (u + 0.3), 0.5)
        } else {
            (-1e-4 * u, -1e-4)
        }
    }
}

impl Model<1, 1, 0, 2, 1> for Sticking {
    /// The command, at which the slope is taken.
    type Trace = f32;
    const TRACE: f32 = 0.0;

    fn predict(&self, x: &Regressor<1, 1, 0, 2, 1>, u: &mut f32) -> [f32; 1] {
        *u = x.u[0][0];
        [x.y[0][0] + Self::answer(*u).0]
    }

    fn jacobian(&self, u: &f32, jacobian: &mut Jacobian<1, 1, 2, 1>) {
        jacobian.u = [[[Self::answer(*u).1]], [[0.0]]];
        jacobian.y = [[[1.0]]];
    }
}

impl Propagate<1, 1, 0, 2, 1> for Sticking {}
impl sinew_mpc::Tuning for Sticking {}

#[test]
fn a_sticking_device_is_broken_free_at_once() {
    let limits = Limits {
        rate: [f32::INFINITY],
        ..LIMITS
    };
    let mut c: ControlLoop<Sticking, 1, 1, 0, 2, 1, N, 3, 3> = ControlLoop::new(
        Sticking,
        ModelScaling::IDENTITY,
        limits,
        SETTINGS,
        Horizons::every_step(),
    );
    let resting = c.step(&[0.0], &[], &[[0.0]; N]);
    assert!(resting.u[0].abs() < 0.3, "nothing is asked: {resting:?}");
    let leaving = c.step(&[0.0], &[], &[[1.0]; N]);
    assert!(
        leaving.u[0] > 0.3,
        "held in the place without a slope: {leaving:?}"
    );
}
