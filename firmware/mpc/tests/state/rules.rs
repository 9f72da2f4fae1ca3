//! Limits, loads, gaps and late readings of the loop that knows its state.

use proptest::prelude::*;
use sinew_mpc::filter::{Filter, MeasurementJacobian, StateSpace, TransitionJacobian};
use sinew_mpc::scaling::{ModelScaling, Scaling};
use sinew_mpc::state_loop::StateLoop;
use sinew_mpc::status::Status;
use sinew_mpc::{Horizons, Limits};

use crate::common::{Random, cases};
use crate::mass::{self, FILTER, LIMITS, Mass, PRIOR, SETTINGS, controller};
use crate::plant::{Plant, noise};

const HELD: [[f32; 1]; 12] = [[0.2]; 12];

fn inside(u: f32, before: f32) -> bool {
    let change = (f64::from(u) - f64::from(before)).abs();
    u.abs() <= 20.0 && change <= f64::from(LIMITS.rate[0])
}

#[test]
fn a_step_stopped_anywhere_stays_inside_the_limits() {
    let stops = std::env::var("SINEW_STOPS").map_or(100_000, |text| {
        text.parse::<usize>().expect("SINEW_STOPS is a count")
    });
    let mut random = Random(17);
    let (mut stopped, mut moved) = (0, 0);
    for _ in 0..stops.div_ceil(200) {
        let mut controller = controller(FILTER);
        let mut plant = Plant::drawn(5);
        let mut before = 0.0;
        for k in 0..200 {
            let reading = match (random.unit() * 40.0) as u32 {
                0 => f64::NAN,
                1 => 1e9,
                _ => plant.q + noise(&mut random),
            };
            let until = (random.unit() * random.unit() * 20.0) as u32;
            let mut asked = 0;
            let reference = [[if k % 50 < 25 { 0.2 } else { 0.0 }]; 12];
            let step = controller.step_until(&[reading as f32], &reference, || {
                asked += 1;
                asked > until
            });
            assert!(inside(step.u[0], before), "{step:?}");
            stopped += usize::from(step.status == Status::CutShort);
            moved += usize::from(step.u[0] != before);
            before = step.u[0];
            plant.advance(f64::from(step.u[0]));
        }
    }
    println!("{stops} steps, {stopped} stopped, {moved} moves");
    assert!(
        stopped > stops / 4 && moved > stops / 4,
        "{stopped}, {moved}"
    );
}

#[test]
fn a_load_leaves_no_steady_error() {
    let mut controller = controller(FILTER);
    let mut plant = Plant::drawn(3);
    let mut random = Random(3);
    let mut sum = 0.0;
    for k in 0..2400 {
        let reading = plant.q + noise(&mut random);
        let step = controller.step(&[reading as f32], &HELD);
        plant.advance(f64::from(step.u[0]) - 2.5);
        if k >= 1200 {
            sum += (plant.q - 0.2) / 1200.0;
        }
    }
    assert!(sum.abs() < 0.1e-3, "{sum}");
}

#[test]
fn a_short_gap_is_predicted_and_a_long_one_goes_to_the_safe_command() {
    let mut controller = controller(FILTER);
    let mut plant = Plant::drawn(3);
    let mut random = Random(3);
    let mut before = 0.0;
    for k in 0..600 {
        let missing = k > 300;
        let reading = if missing {
            f64::NAN
        } else {
            plant.q + noise(&mut random)
        };
        let step = controller.step(&[reading as f32], &HELD);
        assert!(inside(step.u[0], before));
        before = step.u[0];
        if (301..=312).contains(&k) {
            assert!(
                step.status.is_controlled() && step.predicted,
                "{k}: {step:?}"
            );
            assert!((plant.q - 0.2).abs() < 2e-3, "{k}: {}", plant.q);
        } else if missing {
            assert_eq!(step.status, Status::SignalLost, "{k}");
        }
        plant.advance(f64::from(step.u[0]));
    }
    assert_eq!(before, LIMITS.safe[0]);
    // Control starts again with the first reading.
    let step = controller.step(&[plant.q as f32], &HELD);
    assert!(step.status.is_controlled(), "{step:?}");
}

#[test]
fn bad_references_and_settings_follow_the_earlier_plan() {
    let mut controller = controller(FILTER);
    assert!(controller.step(&[0.1], &HELD).status.is_controlled());
    let step = controller.step(&[0.1], &[[f32::NAN]; 12]);
    assert_eq!(step.status, Status::BadReference);
    controller.settings_mut().iterations = 0;
    assert_eq!(controller.step(&[0.1], &HELD).status, Status::BadSettings);
    controller.settings_mut().iterations = 2;
    assert!(controller.step(&[0.1], &HELD).status.is_controlled());
}

/// A camera alone, four periods late, behind a controller that keeps eight periods.
#[test]
fn a_loop_holds_on_late_readings_alone() {
    type Camera = StateLoop<Mass, 2, 1, 1, 1, 4, 7, 8, 12, 4, 4>;
    let run = |age: usize, at_once: usize| {
        let mut controller = Camera::new(
            Mass,
            ModelScaling::IDENTITY,
            LIMITS,
            SETTINGS,
            Filter::new(PRIOR, FILTER),
            Horizons::new(1, [1, 2, 3, 6]),
        );
        let mut plant = Plant::drawn(2);
        let mut random = Random(3);
        let mut readings = Vec::new();
        let mut squares = 0.0;
        for k in 0..1200 {
            readings.push((plant.q + noise(&mut random)) as f32);
            if k > at_once && k % 4 == 0 {
                let late = [readings[k - age]];
                // One more period is over than those that the step has seen.
                assert!(controller.late(age - 1, &late).is_some());
            }
            let reading = if k < at_once { readings[k] } else { f32::NAN };
            let step = controller.step(&[reading], &HELD);
            plant.advance(f64::from(step.u[0]));
            if k >= 600 {
                squares += (plant.q - 0.2) * (plant.q - 0.2) / 600.0;
            }
        }
        squares.sqrt()
    };
    let (late, at_once) = (run(4, 8), run(4, 1200));
    println!("late {:.3} mm, at once {:.3} mm", 1e3 * late, 1e3 * at_once);
    assert!(late < 2.0 * at_once + 0.2e-3, "{late} {at_once}");
}

/// Model units differ from physical ones: the same commands.
#[test]
fn scaling_changes_nothing_but_units() {
    let scaling = ModelScaling {
        u: Scaling {
            span: [1.0],
            offset: [0.0],
        },
        y: Scaling {
            span: [1.0],
            offset: [0.5],
        },
        s: Scaling::IDENTITY,
    };
    let mut shifted = mass::Controller::new(
        Mass,
        scaling,
        LIMITS,
        SETTINGS,
        Filter::new(PRIOR, FILTER),
        Horizons::new(1, [1, 2, 3, 6]),
    );
    let mut plain = controller(FILTER);
    for k in 0..50 {
        let y = 0.01 * k as f32;
        let a = plain.step(&[y], &HELD);
        let b = shifted.step(&[y + 0.5], &HELD.map(|[r]| [r + 0.5]));
        assert!((a.u[0] - b.u[0]).abs() < 2e-3, "{k}: {a:?} {b:?}");
    }
}

/// A second sensor, the speed, is a measurement that is no output.
struct WithSpeed;

impl StateSpace<2, 1, 2, 4> for WithSpeed {
    type Trace = <Mass as StateSpace<2, 1, 1, 4>>::Trace;
    const TRACE: Self::Trace = Mass::TRACE;

    fn transition(
        &self,
        x: &[f32; 2],
        u: &[f32; 1],
        theta: &[f32; 4],
        trace: &mut Self::Trace,
    ) -> [f32; 2] {
        Mass.transition(x, u, theta, trace)
    }

    fn transition_jacobian(&self, trace: &Self::Trace, jacobian: &mut TransitionJacobian<2, 1, 4>) {
        Mass.transition_jacobian(trace, jacobian);
    }

    fn measure(&self, x: &[f32; 2], _: &[f32; 4]) -> [f32; 2] {
        *x
    }

    fn measurement_jacobian(
        &self,
        _: &[f32; 2],
        _: &[f32; 4],
        jacobian: &mut MeasurementJacobian<2, 2, 4>,
    ) {
        jacobian.x = [[1.0, 0.0], [0.0, 1.0]];
    }
}

#[test]
fn another_sensor_alone_bridges_a_gap_of_the_output() {
    let prior = PRIOR;
    let filter = sinew_mpc::FilterSettings {
        measurement_noise: [0.47e-3, 2e-3],
        state_noise: FILTER.state_noise,
        disturbance_noise: FILTER.disturbance_noise,
        parameter_noise: FILTER.parameter_noise,
        gate: FILTER.gate,
        adapt: true,
        max_missing_samples: 12,
    };
    let mut controller: StateLoop<WithSpeed, 2, 1, 1, 2, 4, 7, 1, 12, 4, 4> = StateLoop::new(
        WithSpeed,
        ModelScaling::IDENTITY,
        LIMITS,
        SETTINGS,
        Filter::new(prior, filter),
        Horizons::new(1, [1, 2, 3, 6]),
    );
    let mut plant = Plant::drawn(5);
    let mut random = Random(3);
    for k in 0..600 {
        let output = if k < 300 {
            plant.q + noise(&mut random)
        } else {
            f64::NAN
        };
        let speed = plant.v + 4.0 * noise(&mut random);
        let step = controller.step(&[output as f32, speed as f32], &HELD);
        assert!(step.status.is_controlled(), "{k}: {step:?}");
        plant.advance(f64::from(step.u[0]));
    }
    assert!((plant.q - 0.2).abs() < 5e-3, "{}", plant.q);
}

fn any_bits() -> impl Strategy<Value = f32> {
    prop_oneof![any::<u32>().prop_map(f32::from_bits), -1.0_f32..1.0]
}

proptest! {
    #![proptest_config(cases(200))]
    #[test]
    fn limits_hold_exactly_whatever_comes_in(
        readings in prop::collection::vec(any_bits(), 30),
        reference in prop::array::uniform12(any_bits()),
        weight in any_bits(),
        bounds in prop::array::uniform2(-20.0_f32..20.0),
    ) {
        let limits = Limits {
            lower: [bounds[0].min(bounds[1])],
            upper: [bounds[0].max(bounds[1])],
            rate: [1.3],
            safe: [bounds[0]],
        };
        let mut controller = mass::Controller::new(
            Mass,
            ModelScaling::IDENTITY,
            limits,
            SETTINGS,
            Filter::new(PRIOR, FILTER),
            Horizons::new(1, [1, 2, 3, 6]),
        );
        controller.settings_mut().weights.moves = [weight];
        let mut before = bounds[0];
        for reading in readings {
            let [u] = controller.step(&[reading], &reference.map(|r| [r])).u;
            prop_assert!((limits.lower[0]..=limits.upper[0]).contains(&u), "{u}");
            let change = (f64::from(u) - f64::from(before)).abs();
            prop_assert!(change <= f64::from(1.3_f32), "{before} to {u}");
            before = u;
        }
    }
}

#[test]
fn a_reset_begins_at_rest_and_an_emergency_stop_does_not() {
    let speed = |controller: &mass::Controller| controller.filter().covariance().variance(1);
    let variance = |deviation: f32| deviation * deviation;
    let mut controller = controller(FILTER);
    let _ = controller.step(&[0.1], &HELD);
    controller.emergency_stop();
    assert_eq!(speed(&controller), variance(PRIOR.state_deviation[1]));
    controller.reset();
    assert_eq!(speed(&controller), variance(PRIOR.rest_deviation[1]));
    let _ = controller.ramp_to_safe();
    assert_eq!(speed(&controller), variance(PRIOR.state_deviation[1]));
}
