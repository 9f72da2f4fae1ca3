//! The session of a controller on the estimated state: the frames of the other kind.

use sinew_device::clock::Clock;
use sinew_device::mode::Drive;
use sinew_device::protocol::{
    Identity, PROTOCOL, Parameters, Reason, ToDevice, ToHost, decode, encode,
};
use sinew_device::session::LoopSession;
use sinew_mpc::math::tanh;
use sinew_mpc::network::state::StateNetwork;
use sinew_mpc::{Limits, StateSettings, Weights};

sinew_mpc::state_controller! {
    model: Network,
    states: 2,
    inputs: 1,
    outputs: 1,
    measurements: 1,
    parameters: 1,
    periods_kept: 1,
    horizon: 10,
    move_blocks: 2,
}

type Network = StateNetwork<STATES, INPUTS, MEASUREMENTS, PARAMETERS, 4, 1>;
type Session = LoopSession<Controller, INPUTS, OUTPUTS, 0, 10>;

/// A damped mass: position and velocity; the parameter adds to the force's effect.
const MASS: Network = StateNetwork {
    linear: [[0.0, 0.1, 0.0, 0.0], [-0.1, -0.05, 0.2, 0.0]],
    bias: [0.0; 2],
    hidden: [[0.0, 0.3, 0.0, 0.5]],
    hidden_bias: [0.1],
    output: [[0.0], [-0.1]],
    measurement: [[1.0, 0.0]],
    measurement_bias: [0.0],
};

const LIMITS: Limits<1> = Limits {
    lower: [-1.0],
    upper: [1.0],
    rate: [0.5],
    safe: [0.0],
};

const IDENTITY: Identity = Identity {
    protocol: PROTOCOL,
    model: 1,
    n_u: 1,
    n_y: 1,
    n_s: 0,
    past_inputs: 1,
    past_outputs: 1,
    horizon: 10,
    control_horizon: 3,
    rate_mhz: 100_000,
};

struct NoClock;

impl Clock for NoClock {
    fn ticks(&self) -> u32 {
        0
    }
}

fn session() -> Session {
    let prior = Prior {
        x: [0.0; 2],
        rest_deviation: [1.0; 2],
        state_deviation: [1.0; 2],
        disturbance_deviation: [0.1],
        theta: [0.0],
        parameter_deviation: [1.0],
        lower: [-2.5],
        upper: [2.5],
    };
    let filter = FilterSettings {
        state_noise: [1e-3; 2],
        disturbance_noise: [1e-3],
        parameter_noise: [1e-3],
        measurement_noise: [1e-2],
        gate: 6.0,
        adapt: true,
        max_missing_samples: 3,
    };
    let settings = StateSettings {
        weights: Weights {
            tracking: [1.0],
            moves: [0.01],
        },
        iterations: 2,
    };
    let controller = Controller::new(
        MASS,
        Scaling::IDENTITY,
        LIMITS,
        settings,
        Filter::new(prior, filter),
        Horizons::new(1, [1, 2]),
    );
    let mut session = Session::within(controller, LIMITS, IDENTITY);
    session.answer(
        &ToDevice::Arm {
            drive: Drive::Host,
            blend_steps: 0,
        },
        &NoClock,
    );
    session
}

fn sample(session: &mut Session, y: f32) -> f32 {
    let answer = session.answer(
        &ToDevice::Sample {
            seq: 0,
            y: [y].into_iter().collect(),
            s: [].into_iter().collect(),
            reference: [0.5].into_iter().collect(),
        },
        &NoClock,
    );
    let ToHost::Command { u, .. } = answer else {
        panic!("a sample of these shapes is answered by a command: {answer:?}");
    };
    u[0]
}

#[test]
fn a_reference_is_followed_and_gaps_are_counted() {
    let mut session = session();
    let (mut q, mut v) = (0.0_f32, 0.0_f32);
    for _ in 0..300 {
        let u = sample(&mut session, q);
        assert!((-1.0..=1.0).contains(&u));
        let force = 0.2 * u - 0.1 * tanh(0.3 * v + 0.1);
        (q, v) = (q + 0.1 * v, v - 0.1 * q - 0.05 * v + force);
    }
    assert!((q - 0.5).abs() < 0.02, "{q}");
    assert_eq!(session.summary().missed_samples, 0);
    sample(&mut session, f32::NAN);
    assert_eq!(session.summary().missed_samples, 1);
}

#[test]
fn parameters_are_told_as_the_filter_knows_them() {
    let mut session = session();
    let ask = |session: &mut Session| match session.answer(&ToDevice::Parameters, &NoClock) {
        ToHost::Parameters(known) => known,
        other => panic!("a filter with a parameter tells it: {other:?}"),
    };
    let of = |theta: f32, variance: f32| Parameters {
        theta: [theta].into_iter().collect(),
        variance: [variance].into_iter().collect(),
    };
    assert_eq!(ask(&mut session), of(0.0, 1.0));
    let (mut q, mut v) = (0.0_f32, 0.0_f32);
    for _ in 0..300 {
        let u = sample(&mut session, q);
        let force = 0.2 * u - 0.1 * tanh(0.3 * v + 0.5 * 0.8 + 0.1);
        (q, v) = (q + 0.1 * v, v - 0.1 * q - 0.05 * v + force);
    }
    let known = ask(&mut session);
    let filter = session.controller().filter();
    let variance = filter.covariance().variance(STATES + INPUTS);
    assert_eq!(known, of(filter.theta()[0], variance));
    assert!(
        variance < 0.9 && known.theta[0] != 0.0,
        "nothing was learned: {known:?}"
    );
    let mut buffer = [0; 64];
    let answer = ToHost::Parameters(known);
    let frame = encode(&answer, &mut buffer).expect("the answer fits").len();
    let read: ToHost = decode(&mut buffer[..frame - 1]).expect("it is a frame");
    assert_eq!(read, answer);
}

#[test]
fn a_probe_is_answered_by_the_next_state_and_its_derivatives() {
    let mut session = session();
    let probe = |x: &[f32]| ToDevice::Probe {
        x: x.iter().copied().collect(),
    };
    let ToHost::Prediction { y, jacobian } =
        session.answer(&probe(&[0.5, 0.2, -0.4, 1.0]), &NoClock)
    else {
        panic!("a point of this length is predicted");
    };
    let unit = tanh(0.3 * -0.4 + 0.5 + 0.1);
    let expected = [0.2 - 0.04, -0.4 - 0.02 + 0.02 + 0.1 - 0.1 * unit];
    for (y, expected) in y.iter().zip(expected) {
        assert!((y - expected).abs() < 1e-5, "{y} {expected}");
    }
    let by_velocity = 1.0 - 0.05 - 0.1 * 0.3 * (1.0 - unit * unit);
    let expected = [0.0, 1.0, 0.1, 0.2, -0.1, by_velocity];
    assert_eq!(jacobian.len(), expected.len());
    for (value, expected) in jacobian.iter().zip(expected) {
        assert!((value - expected).abs() < 1e-5, "{jacobian:?}");
    }
    let refused = session.answer(&probe(&[0.5]), &NoClock);
    assert_eq!(
        refused,
        ToHost::Refused {
            reason: Reason::Shape
        }
    );
}

#[test]
fn weights_are_replaced_or_refused() {
    let mut session = session();
    let mut tune = |gain: f32| {
        session.answer(
            &ToDevice::Tune {
                tracking_weight: [1.0].into_iter().collect(),
                move_suppression: [0.5].into_iter().collect(),
                disturbance_gain: gain,
                iterations: 1,
            },
            &NoClock,
        )
    };
    assert_eq!(
        tune(1.5),
        ToHost::Refused {
            reason: Reason::Settings
        }
    );
    assert_eq!(tune(0.5), ToHost::Tuned);
    let controller = session.controller();
    assert_eq!(controller.settings().weights.moves, [0.5]);
    let noise = controller.filter().settings().disturbance_noise;
    assert_eq!(noise, [0.05]);
}

#[test]
fn limits_are_replaced_within_those_of_the_model_and_hold_the_next_command() {
    let mut session = session();
    let narrow = |session: &mut Session, lower: f32, upper: f32| {
        session.answer(
            &ToDevice::Limit {
                lower: [lower].into_iter().collect(),
                upper: [upper].into_iter().collect(),
                rate: [0.5].into_iter().collect(),
            },
            &NoClock,
        )
    };
    let refused = ToHost::Refused {
        reason: Reason::Limits,
    };
    assert_eq!(narrow(&mut session, -2.0, 1.0), refused);
    // The command applied last is 0.
    assert_eq!(narrow(&mut session, 0.1, 1.0), refused);
    assert_ne!(narrow(&mut session, -0.05, 0.05), refused);
    for _ in 0..20 {
        assert!(sample(&mut session, 0.0).abs() <= 0.05);
    }
}
