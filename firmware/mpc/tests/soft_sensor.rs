//! The soft sensor: its equation, its refusals, and the loop behind it.
use sinew_mpc::limits::Limits;
use sinew_mpc::predictive_loop::PredictiveLoop;
use sinew_mpc::soft_sensor::{REACH, SensedLoop, SoftSensor};
use sinew_mpc::{Model, Propagate, Settings, Tuning};

sinew_mpc::controller! {
    model: Lag,
    inputs: 1,
    outputs: 1,
    channels: 0,
    past_inputs: 1,
    past_outputs: 1,
    horizon: 4,
    move_blocks: 2,
}

struct Lag;

impl Model<INPUTS, OUTPUTS, CHANNELS, PAST_INPUTS, PAST_OUTPUTS> for Lag {
    type Trace = ();
    const TRACE: () = ();

    fn predict(&self, x: &Regressor, _: &mut ()) -> [f32; OUTPUTS] {
        [0.9 * x.y[0][0] + 0.1 * x.u[0][0]]
    }

    fn jacobian(&self, _: &(), jacobian: &mut Jacobian) {
        jacobian.y[0][0][0] = 0.9;
        jacobian.u[0][0][0] = 0.1;
    }
}
impl Propagate<INPUTS, OUTPUTS, CHANNELS, PAST_INPUTS, PAST_OUTPUTS> for Lag {}
impl Tuning for Lag {}

const LIMITS: Limits<1> = Limits {
    lower: [-1.0],
    upper: [1.0],
    rate: [0.5],
    safe: [0.0],
};

fn controller() -> Controller {
    let settings = Settings {
        tracking_weight: [1.0],
        move_suppression: [0.01],
        disturbance_gain: 0.5,
        iterations: 2,
        max_missing_samples: 5,
    };
    Controller::new(
        Lag,
        Scaling::IDENTITY,
        LIMITS,
        settings,
        Horizons::new(1, [1, 2]),
    )
}

/// Two channels that say y = 0.3 + 0.5 z1 - 0.25 z2 + 0.1 z1^2 + 0.2 z1 z2 - 0.05 z2^2.
static SENSOR: SoftSensor<2, 1, 3> = SoftSensor {
    channels: sinew_mpc::scaling::Scaling {
        span: [0.5, 2.0],
        offset: [1.0, -1.0],
    },
    outputs: sinew_mpc::scaling::Scaling {
        span: [1.0],
        offset: [0.0],
    },
    bias: [0.3],
    linear: [[0.5, -0.25]],
    quadratic: [[0.1, 0.2, -0.05]],
};

type Sensed = SensedLoop<Controller, 2, 1, 3, 0, 4>;

#[test]
fn an_output_is_the_quadratic_of_its_channels() {
    for (z1, z2) in [(0.0, 0.0), (1.0, -1.0), (-0.5, 0.25), (2.0, 2.0)] {
        let said = SENSOR.outputs(&[1.0 + 0.5 * z1, -1.0 + 2.0 * z2])[0];
        let wanted = 0.3 + 0.5 * z1 - 0.25 * z2 + 0.1 * z1 * z1 + 0.2 * z1 * z2 - 0.05 * z2 * z2;
        assert!((said - wanted).abs() < 1e-6, "{said} for {wanted}");
    }
}

#[test]
fn a_channel_that_is_missing_or_far_outside_is_no_reading() {
    let far = 1.0 + 0.5 * (REACH + 1e-3);
    for channels in [
        [f32::NAN, -1.0],
        [1.0, f32::INFINITY],
        [far, -1.0],
        [1.0, f32::MAX],
    ] {
        assert!(SENSOR.outputs(&channels)[0].is_nan(), "{channels:?}");
    }
    assert!(SENSOR.outputs(&[1.0 + 0.5 * REACH, -1.0])[0].is_finite());
}

#[test]
fn a_loop_without_outputs_does_what_one_does_that_measures_what_the_channels_say() {
    let (mut sensed, mut measured) = (Sensed::new(controller(), &SENSOR), controller());
    let reference = [[0.4]; 4];
    for k in 0..50 {
        let s = [
            1.0 + 0.4 * (0.1 * f64::from(k)).sin() as f32,
            -1.0 + 0.02 * k as f32,
        ];
        let y = SENSOR.outputs(&s);
        let a = PredictiveLoop::step(&mut sensed, &[f32::NAN], &s, &reference);
        let b = measured.step(&y, &[], &reference);
        assert_eq!(a.u, b.u);
        assert_eq!(a.status, b.status);
    }
    assert_eq!(sensed.missed(), 0);
}

#[test]
fn an_output_that_is_measured_is_taken_as_it_is() {
    let mut sensed = Sensed::new(controller(), &SENSOR);
    assert_eq!(sensed.outputs(&[0.7], &[1.0, -1.0]), [0.7]);
    assert_eq!(sensed.outputs(&[f32::NAN], &[1.0, -1.0]), [0.3]);
}

#[test]
fn a_channel_that_is_lost_ends_in_the_safe_command_within_the_limits() {
    let mut sensed = Sensed::new(controller(), &SENSOR);
    let reference = [[0.9]; 4];
    let mut last = 0.0_f32;
    for k in 0..40 {
        let s = if k < 20 {
            [1.0, -1.0]
        } else {
            [f32::NAN, -1.0]
        };
        let step = PredictiveLoop::step(&mut sensed, &[f32::NAN], &s, &reference);
        assert!(step.u[0].abs() <= 1.0 && (step.u[0] - last).abs() <= 0.5 + 1e-6);
        last = step.u[0];
    }
    assert_eq!(last, 0.0, "the safe command");
    assert_eq!(sensed.missed(), 20);
}
