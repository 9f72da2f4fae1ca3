//! Arming, and everything that ends it: the session on a plant of first order, in physical units.

#[path = "../../mpc/tests/common/mod.rs"]
mod common;

use common::Linear;
use heapless::Vec as Fixed;
use sinew_device::clock::Clock;
use sinew_device::mode::{Cause, Drive, Mode};
use sinew_device::protocol::{Reason, ToDevice, ToHost};
use sinew_device::session::{EXCITATION_ROWS, Outputs, Session};
use sinew_device::supervisor::{ENVELOPE, LATE_LIMIT, OUTSIDE_LIMIT, STUCK_LIMIT};
use sinew_mpc::Horizons;
use sinew_mpc::controller::{ControlLoop, Settings};
use sinew_mpc::limits::Limits;
use sinew_mpc::scaling::ModelScaling;
use sinew_mpc::status::Status;

const N: usize = 4;
const RATE: f32 = 0.5;
const SAFE: f32 = 0.25;
const GAP: u16 = 5;
type Loop = ControlLoop<Linear, 1, 1, 0, 2, 1, N, 2, 2>;
type Own = Session<Linear, 1, 1, 0, 2, 1, N, 2, 2>;

struct NoClock;
impl Clock for NoClock {
    fn ticks(&self) -> u32 {
        0
    }
}

/// A session and the plant y(k+1) = 0.9 y(k) + 0.2 u(k), which is what its model predicts.
struct Bench {
    session: Own,
    y: f32,
    at_us: u64,
}

impl Bench {
    fn new() -> Self {
        let model = Linear {
            a: 0.9,
            b: 0.2,
            b1: 0.0,
        };
        let limits = Limits {
            lower: [-1.0],
            upper: [1.0],
            rate: [RATE],
            safe: [SAFE],
        };
        let settings = Settings {
            tracking_weight: [1.0],
            move_suppression: [0.1],
            disturbance_gain: 0.0,
            iterations: 2,
            max_missing_samples: GAP,
        };
        let controller: Loop = ControlLoop::new(
            model,
            ModelScaling::IDENTITY,
            limits,
            settings,
            Horizons::every_step(),
        );
        Self {
            session: Session::new(controller, Own::identity_of(1, 120_000, 2)),
            y: 0.0,
            at_us: 0,
        }
    }

    fn ask(&mut self, message: ToDevice) -> ToHost {
        self.session.answer(&message, &NoClock)
    }

    fn arm(&mut self, drive: Drive, blend_steps: u16) {
        let answer = self.ask(ToDevice::Arm { drive, blend_steps });
        assert!(matches!(answer, ToHost::State(_)), "{answer:?}");
    }

    fn follow(&mut self, r: f32) {
        let reference = fixed(&[r]);
        assert_eq!(self.ask(ToDevice::Follow { reference }), ToHost::Tuned);
    }

    /// One tick that reads `seen`, and the plant behind it.
    fn tick(&mut self, seen: f32) -> (Outputs<1>, Option<ToHost>) {
        self.at_us += 8_333;
        let result = self.session.tick(self.at_us, &[seen], &[], &NoClock);
        let applied = if result.0.live { result.0.u[0] } else { 0.0 };
        self.y = 0.9 * self.y + 0.2 * applied;
        result
    }

    fn run(&mut self, ticks: usize) -> Outputs<1> {
        let mut last = self.tick(self.y).0;
        for _ in 1..ticks {
            last = self.tick(self.y).0;
        }
        last
    }

    fn mode(&self) -> Mode {
        self.session.state().mode
    }

    fn cause(&self) -> Cause {
        self.session.state().cause
    }
}

fn fixed<const L: usize>(values: &[f32]) -> Fixed<f32, L> {
    Fixed::from_slice(values).expect("short enough")
}

fn refused(reason: Reason) -> ToHost {
    ToHost::Refused { reason }
}

/// Armed on its own rig and following 0.8 for a while.
fn following() -> Bench {
    let mut bench = Bench::new();
    bench.arm(Drive::Rig, 0);
    bench.follow(0.8);
    let outputs = bench.run(60);
    assert!(
        (bench.y - 0.8).abs() < 0.05,
        "it does not follow: {}",
        bench.y
    );
    assert!(outputs.live && outputs.u[0] != SAFE);
    bench
}

#[test]
fn nothing_moves_before_it_is_armed() {
    let mut bench = Bench::new();
    assert_eq!(
        (bench.mode(), bench.cause()),
        (Mode::Disarmed, Cause::Start)
    );
    for _ in 0..50 {
        let (outputs, _) = bench.tick(0.7);
        assert_eq!(
            outputs,
            Outputs {
                u: [SAFE],
                live: false
            }
        );
    }
    // Nor does what only an armed session takes.
    let reference = fixed(&[0.5]);
    assert_eq!(
        bench.ask(ToDevice::Follow { reference }),
        refused(Reason::Mode)
    );
    // Rows may wait; nothing plays them.
    let (row, u) = (0, fixed(&[0.5]));
    let answer = bench.ask(ToDevice::Excite { row, u });
    assert!(matches!(answer, ToHost::Queued { .. }), "{answer:?}");
    assert_eq!(bench.run(10).u, [SAFE]);
    // A sample from a host gets the safe command, and is told why.
    let sample = ToDevice::Sample {
        seq: 1,
        y: fixed(&[0.1]),
        s: fixed(&[]),
        reference: fixed(&[0.9]),
    };
    let ToHost::Command { u, status, .. } = bench.ask(sample) else {
        panic!("no command");
    };
    assert_eq!((u[0], status), (SAFE, Status::Disarmed));
}

#[test]
fn armed_it_holds_where_it_is_until_something_is_asked() {
    let mut bench = Bench::new();
    // Held by something else at 0.4, where u = 0.2 keeps it.
    bench.y = 0.4;
    bench.arm(Drive::Rig, 0);
    for _ in 0..40 {
        bench.run(1);
        assert!((bench.y - 0.4).abs() < 0.03, "it bumped to {}", bench.y);
    }
    bench.follow(0.6);
    bench.run(60);
    assert!((bench.y - 0.6).abs() < 0.05, "{}", bench.y);
}

#[test]
fn a_blended_start_has_no_bump() {
    let largest_move = |blend_steps| {
        let mut bench = Bench::new();
        bench.y = -0.6;
        bench.arm(Drive::Rig, blend_steps);
        bench.follow(0.6);
        let (mut before, mut largest) = (bench.y, 0.0_f32);
        for _ in 0..100 {
            bench.run(1);
            largest = largest.max((bench.y - before).abs());
            before = bench.y;
        }
        assert!((bench.y - 0.6).abs() < 0.05, "it arrives: {}", bench.y);
        largest
    };
    let (bumpless, at_once) = (largest_move(60), largest_move(0));
    assert!(
        at_once > 0.1,
        "the start at once has no bump either: {at_once}"
    );
    // 1.2 over 60 steps is 0.02 a step.
    assert!(bumpless < 0.07, "{bumpless}");
}

#[test]
fn disarming_walks_to_the_safe_command_and_then_lets_go() {
    let mut bench = following();
    let before = bench.tick(bench.y).0.u[0];
    assert!(
        (before - SAFE).abs() > 0.1,
        "nowhere to walk from: {before}"
    );
    let answer = bench.ask(ToDevice::Disarm);
    assert!(matches!(answer, ToHost::State(state) if state.mode == Mode::Disarmed));
    let (outputs, _) = bench.tick(bench.y);
    assert!((outputs.u[0] - before).abs() <= RATE);
    let last = bench.run(3);
    assert_eq!(
        last,
        Outputs {
            u: [SAFE],
            live: false
        }
    );
}

#[test]
fn an_emergency_stop_is_at_once_and_waits_to_be_acknowledged() {
    let mut bench = following();
    let _ = bench.ask(ToDevice::EmergencyStop);
    assert_eq!(bench.mode(), Mode::Tripped);
    let (outputs, _) = bench.tick(bench.y);
    assert_eq!(
        outputs,
        Outputs {
            u: [SAFE],
            live: false
        }
    );
    let arm = || ToDevice::Arm {
        drive: Drive::Rig,
        blend_steps: 0,
    };
    assert_eq!(bench.ask(arm()), refused(Reason::Mode));
    let _ = bench.ask(ToDevice::Disarm);
    assert!(matches!(bench.ask(arm()), ToHost::State(_)));
    // And it controls again, from where the rig is now.
    bench.follow(0.3);
    bench.run(80);
    assert!((bench.y - 0.3).abs() < 0.05, "{}", bench.y);
}

#[test]
fn faults_of_the_loop_disarm_it_and_say_why() {
    type Feed = fn(usize, f32) -> f32;
    let faults: [(&str, Feed, Cause, usize); 3] = [
        (
            "missing samples",
            |_, _| f32::NAN,
            Cause::SamplesLost,
            usize::from(GAP) + 1,
        ),
        (
            "a sensor far outside",
            |k, y| y + ENVELOPE + k as f32,
            Cause::Diverged,
            usize::from(OUTSIDE_LIMIT),
        ),
        // It reads the same whatever is done; the controller pushes on.
        (
            "a stuck sensor",
            |_, _| 0.123,
            Cause::Stuck,
            usize::from(STUCK_LIMIT) + 2,
        ),
    ];
    for (name, feed, cause, within) in faults {
        let mut bench = following();
        bench.follow(-0.9);
        let mut ticks = 0;
        while bench.mode() != Mode::Disarmed {
            let (outputs, _) = bench.tick(feed(ticks, bench.y));
            assert!((-1.0..=1.0).contains(&outputs.u[0]), "{name}");
            ticks += 1;
            assert!(ticks <= within, "{name}: still armed after {ticks}");
        }
        assert_eq!(bench.cause(), cause, "{name}");
        assert!(ticks >= within / 2, "{name}: only {ticks} samples of it");
        let last = bench.run(5);
        assert_eq!(
            last,
            Outputs {
                u: [SAFE],
                live: false
            },
            "{name}"
        );
    }
}

#[test]
fn one_bad_sample_disarms_nothing() {
    for bad in [f32::NAN, 1e9, -40.0] {
        let mut bench = following();
        let _ = bench.tick(bad);
        bench.run(10);
        assert!(matches!(bench.mode(), Mode::Armed(Drive::Rig)), "{bad}");
        assert!((bench.y - 0.8).abs() < 0.1, "{bad}: {}", bench.y);
    }
}

#[test]
fn late_steps_in_a_row_disarm_and_single_ones_do_not() {
    let mut bench = following();
    for k in 0..10 * LATE_LIMIT {
        bench.run(1);
        if k % 2 == 0 {
            bench.session.note_deadline_miss();
        }
    }
    assert!(
        matches!(bench.mode(), Mode::Armed(_)),
        "{:?}",
        bench.cause()
    );
    for _ in 0..=LATE_LIMIT {
        bench.session.note_deadline_miss();
        bench.run(1);
    }
    assert_eq!((bench.mode(), bench.cause()), (Mode::Disarmed, Cause::Late));
}

#[test]
fn an_excitation_is_applied_row_by_row_inside_the_limits() {
    let mut bench = Bench::new();
    bench.arm(Drive::Excitation, 0);
    let _ = bench.ask(ToDevice::Stream { every: 1 });
    let rows = [0.3, 0.35, 0.9, 5.0, -0.2];
    for (row, u) in (0..).zip(rows) {
        let u = fixed(&[u]);
        let ToHost::Queued { room, .. } = bench.ask(ToDevice::Excite { row, u }) else {
            panic!("row {row} was not taken");
        };
        assert_eq!(usize::from(room), EXCITATION_ROWS - row as usize - 1);
    }
    let mut previous = SAFE;
    for (row, asked) in (0..).zip(rows) {
        let (outputs, telemetry) = bench.tick(bench.y);
        let Some(ToHost::Telemetry(telemetry)) = telemetry else {
            panic!("no telemetry");
        };
        assert_eq!(
            (telemetry.row, telemetry.status),
            (Some(row), Status::OpenLoop)
        );
        assert_eq!(telemetry.at_us, bench.at_us);
        let expected = asked
            .clamp(-1.0, 1.0)
            .clamp(previous - RATE, previous + RATE);
        assert!(
            (outputs.u[0] - expected).abs() < 1e-6,
            "row {row}: {outputs:?}"
        );
        assert_eq!(
            telemetry.u[0], outputs.u[0],
            "what is told is what was applied"
        );
        previous = outputs.u[0];
    }
    // No rows left: held, said, and disarmed before long.
    let (outputs, telemetry) = bench.tick(bench.y);
    assert_eq!(outputs.u[0], previous);
    assert!(matches!(telemetry, Some(ToHost::Telemetry(t)) if t.row.is_none()));
    bench.run(usize::from(GAP) + 1);
    assert_eq!(bench.cause(), Cause::Starved);
}

#[test]
fn a_full_queue_refuses_and_keeps_its_rows() {
    let mut bench = Bench::new();
    bench.arm(Drive::Excitation, 0);
    let excite = |row| ToDevice::Excite {
        row,
        u: fixed(&[0.25 + 0.01 * row as f32]),
    };
    for row in 0..EXCITATION_ROWS as u32 {
        assert!(matches!(bench.ask(excite(row)), ToHost::Queued { .. }));
    }
    let next = EXCITATION_ROWS as u32;
    assert_eq!(bench.ask(excite(next)), refused(Reason::Full));
    // A row too far, and one that comes twice.
    assert_eq!(bench.ask(excite(next + 1)), refused(Reason::Order));
    assert_eq!(bench.ask(excite(3)), ToHost::Queued { row: 3, room: 0 });
    let (outputs, _) = bench.tick(bench.y);
    assert!((outputs.u[0] - 0.25).abs() < 1e-6);
}

#[test]
fn limits_can_be_narrowed_at_run_time_and_never_widened() {
    let mut bench = following();
    let limit = |lower: f32, upper: f32, rate: f32| ToDevice::Limit {
        lower: fixed(&[lower]),
        upper: fixed(&[upper]),
        rate: fixed(&[rate]),
    };
    let before = *bench.session.controller().limits();
    for (lower, upper, rate) in [
        (-2.0, 1.0, 0.1),
        (-1.0, 1.5, 0.1),
        (-1.0, 1.0, 0.9),
        (-1.0, 1.0, -0.1),
        (f32::NAN, 1.0, 0.1),
        (-1.0, f32::NAN, 0.1),
        (-1.0, 1.0, f32::NAN),
        (0.5, 0.4, 0.1),
        // The safe command would lie outside.
        (0.3, 1.0, 0.1),
        // The command in force would.
        (-1.0, 0.26, 0.1),
    ] {
        let answer = bench.ask(limit(lower, upper, rate));
        assert_eq!(answer, refused(Reason::Limits), "{lower} {upper} {rate}");
        assert_eq!(
            *bench.session.controller().limits(),
            before,
            "a bad message changed something"
        );
    }
    assert_eq!(bench.ask(limit(-0.1, 0.9, 0.05)), ToHost::Tuned);
    bench.follow(-0.9);
    let mut previous = bench.tick(bench.y).0.u[0];
    let mut reached = previous;
    for _ in 0..40 {
        let u = bench.tick(bench.y).0.u[0];
        assert!(
            (-0.1..=0.9).contains(&u) && (u - previous).abs() <= 0.05,
            "{previous} to {u}"
        );
        previous = u;
        reached = reached.min(u);
    }
    assert_eq!(
        reached, -0.1,
        "the new limit was never met: nothing is tested"
    );
}

#[test]
fn bad_messages_change_nothing() {
    let mut bench = following();
    let before = (bench.session.state(), *bench.session.controller().limits());
    for (message, reason) in [
        (
            ToDevice::Follow {
                reference: fixed(&[]),
            },
            Reason::Shape,
        ),
        (
            ToDevice::Follow {
                reference: fixed(&[0.1; N + 1]),
            },
            Reason::Shape,
        ),
        (
            ToDevice::Follow {
                reference: fixed(&[f32::NAN]),
            },
            Reason::Settings,
        ),
        (
            ToDevice::Excite {
                row: 0,
                u: fixed(&[0.1]),
            },
            Reason::Mode,
        ),
        (
            ToDevice::Excite {
                row: 0,
                u: fixed(&[f32::INFINITY]),
            },
            Reason::Settings,
        ),
        (
            ToDevice::Excite {
                row: 0,
                u: fixed(&[]),
            },
            Reason::Shape,
        ),
        (
            ToDevice::Arm {
                drive: Drive::Host,
                blend_steps: 0,
            },
            Reason::Mode,
        ),
        (
            ToDevice::Sample {
                seq: 0,
                y: fixed(&[0.0]),
                s: fixed(&[]),
                reference: fixed(&[0.0]),
            },
            Reason::Mode,
        ),
    ] {
        assert_eq!(bench.ask(message.clone()), refused(reason), "{message:?}");
        assert_eq!(
            (bench.session.state(), *bench.session.controller().limits()),
            before
        );
    }
    bench.run(30);
    assert!(
        (bench.y - 0.8).abs() < 0.05,
        "it follows something else: {}",
        bench.y
    );
}
