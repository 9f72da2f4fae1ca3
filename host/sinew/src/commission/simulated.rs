//! A board of two actuators and two sensors on this computer: the firmware's own session, its
//! ticks, and a simulated rig behind it. The line is a socket, as QEMU's is.
//!
//! Time passes a tick for each row that waits, and slowly where none does: a test does not wait for
//! motions.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use sinew_device::clock::Clock;
use sinew_device::mode::{Drive, Mode};
use sinew_device::protocol::{Accumulator, Fed, MAX_FRAME, ToHost, decode, encode};
use sinew_device::session::{EXCITATION_ROWS, Session};
use sinew_model::spec::ModelSpec;
use sinew_mpc::limits::Limits;
use sinew_mpc::scaling::Scaling;
use sinew_mpc::{Model, Propagate, Settings, Tuning};
use sinew_sim::Plant;

use super::rehearsal::SimulatedRig;
use crate::device::Device;

/// Actuators, and sensors.
const N: usize = 2;
/// Wait between ticks without a row; a dozen of them starve an excitation.
const IDLE: Duration = Duration::from_millis(2);
const STARVING: Duration = Duration::from_millis(50);

mod control {
    sinew_mpc::controller! {
        model: super::Bare,
        inputs: 2,
        outputs: 2,
        channels: 0,
        past_inputs: 1,
        past_outputs: 1,
        horizon: 1,
        move_blocks: 1,
    }
}

/// The bare model: nothing changes.
struct Bare;

impl Model<N, N, 0, 1, 1> for Bare {
    type Trace = ();
    const TRACE: () = ();

    fn predict(&self, x: &control::Regressor, (): &mut ()) -> [f32; N] {
        x.y[0]
    }

    fn jacobian(&self, (): &(), jacobian: &mut control::Jacobian) {
        for i in 0..N {
            jacobian.y[0][i][i] = 1.0;
        }
    }
}

impl Propagate<N, N, 0, 1, 1> for Bare {}
impl Tuning for Bare {}

struct NoClock;

impl Clock for NoClock {
    fn ticks(&self) -> u32 {
        0
    }
}

/// Commands that reached the rig while its power stages were on, a row a tick.
pub type Driven = Arc<Mutex<Vec<[f64; N]>>>;

/// A board with `plant` behind it. `sensors` may break what it reads.
pub fn start(
    spec: &ModelSpec,
    plant: &Plant,
    sensors: impl FnMut(&mut [f32; N]) + Send + 'static,
) -> (Device, Driven) {
    start_paced(spec, plant, sensors, IDLE)
}

/// The same, with another wait between ticks: that of a real board is the period.
pub fn start_paced(
    spec: &ModelSpec,
    plant: &Plant,
    sensors: impl FnMut(&mut [f32; N]) + Send + 'static,
    idle: Duration,
) -> (Device, Driven) {
    let rig = SimulatedRig::new(spec, plant).expect("the plant has the model's signals");
    let (board, host) = UnixStream::pair().expect("a socket pair");
    let driven = Driven::default();
    let (session, seen) = (session(spec), driven.clone());
    let period_us = (spec.period_s * 1e6) as u64;
    std::thread::spawn(move || run(board, session, rig, sensors, (period_us, idle), &seen));
    let other = host.try_clone().expect("a socket");
    (Device::over(other, host).expect("a line"), driven)
}

/// The same board behind a socket at `path`, for whoever connects first.
pub fn listen(spec: &ModelSpec, plant: &Plant, path: &std::path::Path, idle: Duration) {
    let rig = SimulatedRig::new(spec, plant).expect("the plant has the model's signals");
    let listener = std::os::unix::net::UnixListener::bind(path).expect("a socket");
    let session = session(spec);
    let period_us = (spec.period_s * 1e6) as u64;
    std::thread::spawn(move || {
        let (line, _) = listener.accept().expect("somebody connects");
        let driven = Mutex::default();
        run(line, session, rig, |_| {}, (period_us, idle), &driven);
    });
}

type TheSession = Session<Bare, N, N, 0, 1, 1, 1, 1, N>;

fn session(spec: &ModelSpec) -> TheSession {
    let narrow = |values: &[f64]| [values[0] as f32, values[1] as f32];
    let scaling = |signals: &[sinew_model::spec::Signal]| Scaling {
        span: [signals[0].span as f32, signals[1].span as f32],
        offset: [signals[0].offset as f32, signals[1].offset as f32],
    };
    let rate: Vec<f64> = (spec.control.rate_limit.iter())
        .map(|rate| rate * spec.period_s)
        .collect();
    let limits = Limits {
        lower: narrow(&spec.control.lower),
        upper: narrow(&spec.control.upper),
        rate: narrow(&rate),
        safe: narrow(&spec.control.safe),
    };
    let settings = Settings {
        tracking_weight: [1.0; N],
        move_suppression: [1.0; N],
        disturbance_gain: 0.0,
        iterations: 1,
        max_missing_samples: spec.control.max_missing_samples,
    };
    let scaling = control::Scaling {
        u: scaling(&spec.inputs),
        y: scaling(&spec.outputs),
        s: Scaling::IDENTITY,
    };
    let horizons = control::Horizons::new(1, [1]);
    let controller = control::Controller::new(Bare, scaling, limits, settings, horizons);
    let rate_mhz = (1000.0 / spec.period_s).round() as u32;
    let identity = TheSession::identity_of(sinew_model::fingerprint(spec), rate_mhz, 1);
    Session::new(controller, identity)
}

fn run(
    mut line: UnixStream,
    mut session: TheSession,
    mut rig: SimulatedRig,
    mut sensors: impl FnMut(&mut [f32; N]),
    (period_us, idle): (u64, Duration),
    driven: &Mutex<Vec<[f64; N]>>,
) {
    let mut accumulator: Accumulator = Accumulator::new();
    let (mut waiting, mut playing, mut at_us) = (0, false, 0);
    let mut ticked = Instant::now();
    let mut chunk = [0; 1024];
    let send = |line: &mut UnixStream, answer: &ToHost| {
        let mut buffer = [0; MAX_FRAME];
        let frame = encode(answer, &mut buffer).expect("an answer fits a frame");
        line.write_all(frame).is_ok()
    };
    loop {
        let heard = if idle < IDLE {
            // Timeouts of sockets are those of the system's clock: too coarse for this pace.
            line.set_nonblocking(true).expect("a socket");
            let heard = line.read(&mut chunk);
            line.set_nonblocking(false).expect("a socket");
            if heard.is_err() {
                std::thread::sleep(idle / 10);
            }
            heard
        } else {
            let wait = if waiting > 0 { 50 } else { 1000 };
            line.set_read_timeout(Some(Duration::from_micros(wait)))
                .expect("a timeout");
            line.read(&mut chunk)
        };
        match heard {
            Ok(0) => return,
            Ok(n) => {
                for byte in &chunk[..n] {
                    let Fed::Frame(frame) = accumulator.feed(*byte) else {
                        continue;
                    };
                    let message = decode(frame).expect("a whole frame");
                    let answer = session.answer(&message, &NoClock);
                    if let ToHost::Queued { room, .. } = answer {
                        waiting = EXCITATION_ROWS - usize::from(room);
                    }
                    if !send(&mut line, &answer) {
                        return;
                    }
                }
            }
            Err(_) => {}
        }
        let excited = session.state().mode == Mode::Armed(Drive::Excitation);
        if session.state().drive().is_none() {
            playing = false;
        }
        let pause = match (excited && waiting > 0, excited && playing) {
            (true, _) => Duration::ZERO,
            (_, true) => STARVING,
            _ => idle,
        };
        if ticked.elapsed() < pause {
            continue;
        }
        // A clock of its own catches up where this computer was late.
        ticked = if idle < IDLE && pause == idle {
            ticked + idle
        } else {
            Instant::now()
        };
        at_us += period_us;
        let mut y = [0.0; N];
        for (y, reading) in y.iter_mut().zip(rig.readings()) {
            *y = reading as f32;
        }
        sensors(&mut y);
        let (outputs, telemetry) = session.tick(at_us, &y, &[], &NoClock);
        if excited && waiting > 0 {
            waiting -= 1;
            playing = true;
        }
        let u = outputs.u.map(f64::from);
        if outputs.live
            && let Ok(mut driven) = driven.lock()
        {
            driven.push(u);
        }
        if rig.advance(&u, outputs.live).is_err() {
            return;
        }
        if let Some(telemetry) = telemetry
            && !send(&mut line, &telemetry)
        {
            return;
        }
    }
}
