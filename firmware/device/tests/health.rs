//! Session of a controller whose channels are watched: it says which it leaves out.

use sinew_device::clock::Clock;
use sinew_device::mode::Drive;
use sinew_device::protocol::{Health, Identity, PROTOCOL, Reason, ToDevice, ToHost};
use sinew_device::session::LoopSession;
use sinew_mpc::channel_watch::{ChannelWatch, Consistency};
use sinew_mpc::scaling::Scaling as Units;
use sinew_mpc::soft_sensor::{SensedLoop, SoftSensor};
use sinew_mpc::{Limits, Model, Propagate, Settings, Tuning};

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

/// Four channels, each of which is the output.
static SENSOR: SoftSensor<4, 1, 10> = SoftSensor {
    channels: Units::IDENTITY,
    outputs: Units::IDENTITY,
    bias: [0.0],
    linear: [[0.25; 4]],
    quadratic: [[0.0; 10]],
};

const THIRD: f32 = 1.0 / 3.0;
static RELATION: Consistency<4> = Consistency {
    bias: [0.0; 4],
    weights: [
        [0.0, THIRD, THIRD, THIRD],
        [THIRD, 0.0, THIRD, THIRD],
        [THIRD, THIRD, 0.0, THIRD],
        [THIRD, THIRD, THIRD, 0.0],
    ],
    spread: [0.02; 4],
};

type Watched = SensedLoop<Controller, 4, 1, 10, 0, 4, ChannelWatch<4>>;
type Plain = SensedLoop<Controller, 4, 1, 10, 0, 4>;

const IDENTITY: Identity = Identity {
    protocol: PROTOCOL,
    model: 1,
    n_u: 1,
    n_y: 1,
    n_s: 4,
    past_inputs: 1,
    past_outputs: 1,
    horizon: 4,
    control_horizon: 3,
    rate_mhz: 100_000,
};

struct NoClock;

impl Clock for NoClock {
    fn ticks(&self) -> u32 {
        0
    }
}

fn controller() -> Controller {
    let settings = Settings {
        tracking_weight: [1.0],
        move_suppression: [0.01],
        disturbance_gain: 0.5,
        iterations: 2,
        max_missing_samples: 5,
    };
    let horizons = Horizons::new(1, [1, 2]);
    Controller::new(Lag, Scaling::IDENTITY, LIMITS, settings, horizons)
}

#[test]
fn a_session_says_which_channel_it_leaves_out_and_goes_on() {
    let loops = Watched::watched(controller(), &SENSOR, ChannelWatch::new(&RELATION));
    let mut session = LoopSession::within(loops, LIMITS, IDENTITY);
    let arm = ToDevice::Arm {
        drive: Drive::Host,
        blend_steps: 0,
    };
    let _ = session.answer(&arm, &NoClock);
    let health = |session: &mut LoopSession<Watched, 1, 1, 4, 4>| {
        session.answer(&ToDevice::Health, &NoClock)
    };
    assert_eq!(health(&mut session), ToHost::Health(Health::default()));
    let mut y = 0.0_f32;
    for seq in 0..200 {
        let mut s = [y; 4];
        if seq >= 100 {
            s[1] = -0.7;
        }
        let sample = ToDevice::Sample {
            seq,
            y: [f32::NAN].into_iter().collect(),
            s: s.into_iter().collect(),
            reference: [0.5].into_iter().collect(),
        };
        let ToHost::Command {
            u,
            status,
            predicted,
            ..
        } = session.answer(&sample, &NoClock)
        else {
            panic!("a sample is answered by a command");
        };
        assert!(status.is_controlled() && !predicted, "{seq}: {status:?}");
        y = 0.9 * y + 0.1 * u[0];
    }
    assert!((y - 0.5).abs() < 0.01, "it follows on the other three: {y}");
    let left_out = Health {
        left_out: 0b0010,
        times: 1,
    };
    assert_eq!(health(&mut session), ToHost::Health(left_out));
    // A reset forgets it: what was looked at until then may have been other sensors.
    assert_eq!(session.answer(&ToDevice::Reset, &NoClock), ToHost::Tuned);
    assert_eq!(health(&mut session), ToHost::Health(Health::default()));
}

#[test]
fn a_sample_is_judged_once_also_where_too_many_channels_are_missing() {
    let mut once = Watched::watched(controller(), &SENSOR, ChannelWatch::new(&RELATION));
    let loops = Watched::watched(controller(), &SENSOR, ChannelWatch::new(&RELATION));
    let mut session = LoopSession::within(loops, LIMITS, IDENTITY);
    // The evidence against the first channel, sample by sample, in the session and without one.
    for seq in 0..17 {
        let s = [0.9, 0.1, 0.1, if seq % 3 == 0 { f32::NAN } else { 0.1 }];
        let sample = ToDevice::Sample {
            seq,
            y: [f32::NAN].into_iter().collect(),
            s: s.into_iter().collect(),
            reference: [0.5].into_iter().collect(),
        };
        let _ = session.answer(&sample, &NoClock);
        let _ = once.step(&[f32::NAN], &s, &[[0.5]; 4]);
    }
    let watches = [session.controller().watch(), once.watch()];
    let [in_session, alone] = watches.map(|watch| format!("{watch:?}"));
    assert_eq!(in_session, alone);
}

#[test]
fn a_controller_that_judges_no_channel_says_so() {
    let mut session = LoopSession::within(Plain::new(controller(), &SENSOR), LIMITS, IDENTITY);
    let refused = ToHost::Refused {
        reason: Reason::Judges,
    };
    assert_eq!(session.answer(&ToDevice::Health, &NoClock), refused);
}

#[test]
fn a_controller_that_estimates_no_parameter_says_so() {
    let mut session = LoopSession::within(Plain::new(controller(), &SENSOR), LIMITS, IDENTITY);
    let refused = ToHost::Refused {
        reason: Reason::Parameters,
    };
    assert_eq!(session.answer(&ToDevice::Parameters, &NoClock), refused);
}
