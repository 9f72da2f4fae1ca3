//! A hostile peer: frames cut, flipped, doubled, swapped, floods of nothing. None that was damaged
//! is taken, and the session answers the next good one as if nothing had been.
//!
//! 200,000 frames by default; SINEW_HOSTILE_FRAMES says otherwise (`cargo xtask survive`: 10
//! million).

#[path = "../../mpc/tests/common/mod.rs"]
mod common;

use common::{Linear, Random};
use heapless::Vec as Fixed;
use sinew_device::clock::Clock;
use sinew_device::mode::Drive;
use sinew_device::protocol::{MAX_FRAME, Reason, ToDevice, ToHost, decode, encode};
use sinew_device::session::Session;
use sinew_mpc::Horizons;
use sinew_mpc::controller::{ControlLoop, Settings};
use sinew_mpc::limits::Limits;
use sinew_mpc::scaling::ModelScaling;

const N: usize = 4;
type Loop = ControlLoop<Linear, 2, 2, 1, 2, 1, N, 2, 4>;
type Victim = Session<Linear, 2, 2, 1, 2, 1, N, 2, 4>;

struct NoClock;
impl Clock for NoClock {
    fn ticks(&self) -> u32 {
        0
    }
}

fn victim() -> Victim {
    let settings = Settings {
        tracking_weight: [1.0; 2],
        move_suppression: [0.1; 2],
        disturbance_gain: 0.5,
        iterations: 1,
        max_missing_samples: 5,
    };
    let limits = Limits {
        lower: [-1.0; 2],
        upper: [1.0; 2],
        rate: [0.5; 2],
        safe: [0.0; 2],
    };
    let model = Linear {
        a: 0.9,
        b: 0.2,
        b1: 0.1,
    };
    let controller: Loop = ControlLoop::new(
        model,
        ModelScaling::IDENTITY,
        limits,
        settings,
        Horizons::every_step(),
    );
    Session::new(controller, Victim::identity_of(1, 120_000, 2))
}

fn frame(message: &ToDevice) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    encode(message, &mut buffer)
        .expect("the message fits")
        .to_vec()
}

/// Everything that a peer may say.
fn vocabulary(random: &mut Random) -> Vec<Vec<u8>> {
    let fixed2 = |a: f32, b: f32| Fixed::<f32, 8>::from_slice(&[a, b]).expect("the message fits");
    let mut frames = Vec::new();
    for seq in 0..40 {
        let mut reference = Fixed::new();
        for _ in 0..2 * (1 + seq as usize % N) {
            let _ = reference.push(random.signed());
        }
        frames.push(frame(&ToDevice::Sample {
            seq,
            y: fixed2(random.signed(), random.signed()),
            s: Fixed::from_slice(&[0.0]).expect("the message fits"),
            reference,
        }));
    }
    let x = Fixed::from_slice(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]).expect("the message fits");
    let drive = Drive::Host;
    let blend_steps = 0;
    for message in [
        ToDevice::Hello,
        ToDevice::Probe { x },
        ToDevice::Reset,
        ToDevice::Arm { drive, blend_steps },
        ToDevice::Disarm,
        ToDevice::Stream { every: 3 },
        ToDevice::Limit {
            lower: fixed2(-1.0, -1.0),
            upper: fixed2(1.0, 1.0),
            rate: fixed2(0.5, 0.5),
        },
        ToDevice::Excite {
            row: 0,
            u: fixed2(0.1, 0.2),
        },
    ] {
        frames.push(frame(&message));
    }
    frames
}

/// One of the ways in which a line spoils a frame. The terminator may go too.
fn spoil(bytes: &mut Vec<u8>, random: &mut Random) {
    let below = |random: &mut Random, n: usize| ((random.unit() * n as f32) as usize).min(n - 1);
    match below(random, 6) {
        0 => {
            let at = below(random, bytes.len());
            bytes[at] ^= 1 << below(random, 8);
        }
        1 => bytes.truncate(below(random, bytes.len())),
        2 => {
            let at = below(random, bytes.len());
            bytes.remove(at);
        }
        3 => {
            let at = below(random, bytes.len());
            bytes.insert(at, (random.unit() * 255.0) as u8);
        }
        4 => {
            let (a, b) = (below(random, bytes.len()), below(random, bytes.len()));
            bytes.swap(a, b);
        }
        // A burst.
        _ => {
            let from = below(random, bytes.len());
            for byte in bytes.iter_mut().skip(from).take(6) {
                *byte = (random.unit() * 255.0) as u8;
            }
        }
    }
}

#[test]
fn no_damaged_frame_is_taken_and_every_good_one_is() {
    let frames: usize = std::env::var("SINEW_HOSTILE_FRAMES")
        .map_or(200_000, |n| n.parse().expect("a number of frames"));
    let mut random = Random(0x1234_5678_9abc_def1);
    let vocabulary = vocabulary(&mut random);
    let mut victim = victim();
    let (mut damaged, mut good) = (0_u64, 0_u64);
    for k in 0..frames {
        let pick = (random.unit() * vocabulary.len() as f32) as usize;
        let original = &vocabulary[pick.min(vocabulary.len() - 1)];
        // Three of four are spoiled; now and then the line floods.
        let spoiled = k % 4 != 0;
        let mut bytes = original.clone();
        if spoiled {
            spoil(&mut bytes, &mut random);
            // Zeros before and behind a frame are nothing.
            let inner = |bytes: &[u8]| {
                let first = bytes.iter().position(|b| *b != 0).unwrap_or(bytes.len());
                let last = bytes
                    .iter()
                    .rposition(|b| *b != 0)
                    .map_or(first, |at| at + 1);
                bytes[first..last].to_vec()
            };
            if inner(&bytes) == inner(original) {
                continue;
            }
        }
        if k % 1000 == 999 {
            bytes.splice(0..0, std::iter::repeat_n(0x55, 3000));
        }
        let is_whole = !spoiled && k % 1000 != 999;
        // Whatever was cut off ends here.
        bytes.push(0);
        let (state, applied) = (victim.state(), *victim.controller().applied());
        let (mut taken, mut refused) = (0, 0);
        victim.receive(&bytes, &NoClock, |reply| {
            let mut reply = reply[..reply.len() - 1].to_vec();
            match decode::<ToHost>(&mut reply).expect("an answer is a sound frame") {
                ToHost::Refused {
                    reason: Reason::Damaged,
                } => refused += 1,
                _ => taken += 1,
            }
        });
        if is_whole {
            assert_eq!((taken, refused), (1, 0), "frame {k} was good");
            good += 1;
        } else {
            assert_eq!(
                taken, 0,
                "frame {k} was damaged and taken: {bytes:02x?}, was {original:02x?}"
            );
            assert_eq!(
                (victim.state(), *victim.controller().applied()),
                (state, applied)
            );
            damaged += 1;
        }
        let inside = victim.controller().applied().iter().all(|u| u.abs() <= 1.0);
        assert!(inside, "a command outside its limits after frame {k}");
    }
    assert!(
        damaged > frames as u64 / 2 && good > frames as u64 / 8,
        "{damaged} {good}"
    );
    println!("{damaged} damaged frames, none taken; {good} good ones, every one taken");
}
