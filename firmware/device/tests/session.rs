//! Frames: round trips, refusals, and streams that were damaged on the way.

#[path = "../../mpc/tests/common/mod.rs"]
mod common;

use std::cell::Cell;

use common::{Linear, cases};
use heapless::Vec as Fixed;
use proptest::prelude::*;
use sinew_device::clock::Clock;
use sinew_device::mode::Drive;
use sinew_device::protocol::{
    Accumulator, Fed, FrameError, MAX_FRAME, PROTOCOL, Reason, ToDevice, ToHost, decode, encode,
};
use sinew_device::session::Session;
use sinew_mpc::Horizons;
use sinew_mpc::controller::{ControlLoop, Settings};
use sinew_mpc::limits::Limits;
use sinew_mpc::scaling::ModelScaling;

const N: usize = 4;
type Loop = ControlLoop<Linear, 2, 2, 1, 2, 1, N, 2, 4>;

struct Counter(Cell<u32>);

impl Clock for Counter {
    fn ticks(&self) -> u32 {
        self.0.set(self.0.get().wrapping_add(100));
        self.0.get()
    }
}

/// Armed for a host.
fn session() -> Session<Linear, 2, 2, 1, 2, 1, N, 2, 4> {
    let settings = Settings {
        tracking_weight: [1.0; 2],
        move_suppression: [0.1; 2],
        disturbance_gain: 0.5,
        iterations: 2,
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
    let mut session = Session::new(
        controller,
        Session::<Linear, 2, 2, 1, 2, 1, N, 2, 4>::identity_of(0xdead_beef, 120_000, 2),
    );
    let drive = Drive::Host;
    let blend_steps = 0;
    let answer = session.answer(
        &ToDevice::Arm { drive, blend_steps },
        &Counter(Cell::new(0)),
    );
    assert!(matches!(answer, ToHost::State(_)), "{answer:?}");
    session
}

fn frame<T: serde::Serialize>(message: &T) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    encode(message, &mut buffer)
        .expect("MAX_FRAME holds every message")
        .to_vec()
}

/// All answers to a stream, decoded.
fn talk(session: &mut Session<Linear, 2, 2, 1, 2, 1, N, 2, 4>, bytes: &[u8]) -> Vec<ToHost> {
    let mut answers = Vec::new();
    session.receive(bytes, &Counter(Cell::new(u32::MAX - 50)), |reply| {
        let mut reply = reply.to_vec();
        assert_eq!(reply.pop(), Some(0), "a frame ends with a zero");
        assert!(!reply.contains(&0), "and has no other");
        answers.push(decode(&mut reply).expect("an answer is a sound frame"));
    });
    answers
}

fn fixed<const L: usize>(values: &[f32]) -> Fixed<f32, L> {
    Fixed::from_slice(values).expect("short enough")
}

fn sample(seq: u32) -> ToDevice {
    ToDevice::Sample {
        seq,
        y: fixed(&[0.1, -0.2]),
        s: fixed(&[0.0]),
        reference: fixed(&[0.5; 2 * N]),
    }
}

fn refused(reason: Reason) -> Vec<ToHost> {
    vec![ToHost::Refused { reason }]
}

#[test]
fn hello_says_who_it_is() {
    let answers = talk(&mut session(), &frame(&ToDevice::Hello));
    let [ToHost::Hello(identity)] = answers.as_slice() else {
        panic!("{answers:?}");
    };
    assert_eq!(identity.protocol, PROTOCOL);
    assert_eq!((identity.model, identity.rate_mhz), (0xdead_beef, 120_000));
    assert_eq!((identity.n_u, identity.n_y, identity.n_s), (2, 2, 1));
    assert_eq!((identity.past_inputs, identity.past_outputs), (2, 1));
    assert_eq!((identity.horizon, identity.control_horizon), (4, 2));
}

#[test]
fn a_sample_is_answered_by_the_step_of_the_loop() {
    let mut s = session();
    let answers = talk(&mut s, &frame(&sample(41)));
    let mut same = session();
    let step = same
        .controller_mut()
        .step(&[0.1, -0.2], &[0.0], &[[0.5; 2]; N]);
    let [
        ToHost::Command {
            seq,
            u,
            status,
            iterations,
            cost,
            ticks,
            predicted,
        },
    ] = answers.as_slice()
    else {
        panic!("{answers:?}");
    };
    assert_eq!(
        (*seq, u.as_slice(), *status),
        (41, step.u.as_slice(), step.status)
    );
    assert_eq!(
        (*iterations, *cost, *predicted),
        (step.iterations, step.cost, false)
    );
    // The counter wrapped in between.
    assert_eq!(*ticks, 100);
    assert!(u[0] > 0.1, "the command was nothing");
    // A short preview holds its last row.
    let short = ToDevice::Sample {
        seq: 41,
        y: fixed(&[0.1, -0.2]),
        s: fixed(&[0.0]),
        reference: fixed(&[0.5; 2]),
    };
    assert_eq!(talk(&mut session(), &frame(&short)), answers);
}

#[test]
fn a_missing_sample_is_counted_and_said() {
    let mut s = session();
    let _ = talk(&mut s, &frame(&sample(0)));
    let missing = ToDevice::Sample {
        seq: 1,
        y: fixed(&[f32::NAN, 0.0]),
        s: fixed(&[0.0]),
        reference: fixed(&[0.5; 8]),
    };
    let answers = talk(&mut s, &frame(&missing));
    assert!(matches!(
        answers[..],
        [ToHost::Command {
            predicted: true,
            ..
        }]
    ));
    s.note_deadline_miss();
    s.note_stack(1000);
    s.note_stack(900);
    let answers = talk(&mut s, &frame(&ToDevice::Stop));
    let [ToHost::Done(done)] = answers.as_slice() else {
        panic!("{answers:?}");
    };
    assert_eq!(
        (done.steps, done.missed_samples, done.deadline_misses),
        (2, 1, 1)
    );
    assert_eq!(
        (done.stack_high_water_bytes, done.frames_rejected),
        (1000, 0)
    );
    assert!(s.is_stopped());
    assert_eq!(talk(&mut s, &frame(&sample(2))), refused(Reason::Stopped));
}

#[test]
fn shapes_and_settings_are_checked_and_nothing_changes() {
    let mut s = session();
    let wrong = [
        (fixed(&[0.1]), fixed(&[0.0]), fixed(&[0.5; 2])),
        (fixed(&[0.1, 0.2]), fixed(&[]), fixed(&[0.5; 2])),
        (fixed(&[0.1, 0.2]), fixed(&[0.0]), fixed(&[])),
        (fixed(&[0.1, 0.2]), fixed(&[0.0]), fixed(&[0.5; 3])),
        (fixed(&[0.1, 0.2]), fixed(&[0.0]), fixed(&[0.5; 10])),
    ];
    for (y, channels, reference) in wrong {
        let message = ToDevice::Sample {
            seq: 0,
            y,
            s: channels,
            reference,
        };
        assert_eq!(talk(&mut s, &frame(&message)), refused(Reason::Shape));
    }
    let tune = |q: &[f32], gain, iterations| ToDevice::Tune {
        tracking_weight: fixed(q),
        move_suppression: fixed(&[0.2, 0.2]),
        disturbance_gain: gain,
        iterations,
    };
    let before = *s.controller().settings();
    assert_eq!(
        talk(&mut s, &frame(&tune(&[1.0], 0.1, 2))),
        refused(Reason::Shape)
    );
    for (q, gain, iterations) in [
        (-1.0, 0.1, 2),
        (f32::NAN, 0.1, 2),
        (1.0, 1.5, 2),
        (1.0, 0.1, 0),
    ] {
        let answer = talk(&mut s, &frame(&tune(&[1.0, q], gain, iterations)));
        assert_eq!(answer, refused(Reason::Settings));
    }
    assert_eq!(*s.controller().settings(), before);
    assert_eq!(
        talk(&mut s, &frame(&tune(&[3.0, 4.0], 0.25, 3))),
        [ToHost::Tuned]
    );
    assert_eq!(s.controller().settings().tracking_weight, [3.0, 4.0]);
    assert_eq!(s.controller().settings().iterations, 3);
    assert_eq!(s.summary().steps, 0);
}

#[test]
fn a_probe_returns_value_and_jacobian_rows() {
    let x = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 9.0];
    let answers = talk(&mut session(), &frame(&ToDevice::Probe { x: fixed(&x) }));
    let [ToHost::Prediction { y, jacobian }] = answers.as_slice() else {
        panic!("{answers:?}");
    };
    assert!((y[0] - (0.9 * 0.5 + 0.2 * 0.1 + 0.1 * 0.3)).abs() < 1e-6);
    assert_eq!(jacobian[..6], [0.2, 0.0, 0.1, 0.0, 0.9, 0.0]);
    assert_eq!(jacobian[6..], [0.0, 0.2, 0.0, 0.1, 0.0, 0.9]);
    let short = ToDevice::Probe { x: fixed(&x[1..]) };
    assert_eq!(talk(&mut session(), &frame(&short)), refused(Reason::Shape));
}

#[test]
fn reset_starts_the_estimate_anew() {
    let mut s = session();
    for seq in 0..5 {
        let _ = talk(&mut s, &frame(&sample(seq)));
    }
    assert!(s.controller().estimator().disturbance() != &[0.0; 2]);
    assert_eq!(talk(&mut s, &frame(&ToDevice::Reset)), [ToHost::Tuned]);
    assert_eq!(s.controller().estimator().disturbance(), &[0.0; 2]);
}

#[test]
fn the_largest_messages_fit_a_frame() {
    let message = ToDevice::Sample {
        seq: u32::MAX,
        y: fixed(&[f32::MAX; 8]),
        s: fixed(&[f32::MAX; 32]),
        reference: fixed(&[f32::MAX; 128]),
    };
    let mut bytes = frame(&message);
    bytes.pop();
    assert_eq!(decode(&mut bytes), Ok(message));
    let answer = ToHost::Prediction {
        y: fixed(&[f32::MIN; 8]),
        jacobian: fixed(&[f32::MIN; 256]),
    };
    let mut bytes = frame(&answer);
    bytes.pop();
    assert_eq!(decode(&mut bytes), Ok(answer));
    assert!(encode(&sample(0), &mut [0; 8]).is_none());
}

/// Our COBS against the cobs crate, around the group length of 254 and with zeros in all places.
#[test]
fn frames_are_cobs_of_content_and_crc() {
    let mut random = common::Random(21);
    for length in (0..20).chain(240..270).chain(500..520) {
        for zeros in [0.0, 0.02, 0.5] {
            let content: Vec<u8> = (0..length)
                .map(|_| {
                    let byte = 1 + (254.0 * random.unit()) as u8;
                    if random.unit() < zeros { 0 } else { byte }
                })
                .collect();
            let ours = frame(&Raw(&content));
            let mut stuffed = ours[..ours.len() - 1].to_vec();
            let mut theirs = vec![0; 1000];
            let plain_length = cobs::decode(&stuffed, &mut theirs).expect("COBS");
            let plain = &theirs[..plain_length];
            assert_eq!(plain[..length], content);
            assert_eq!(encode_cobs(plain), stuffed);
            // And back: no content of ours is a ToDevice of another length.
            let back = decode::<ToDevice>(&mut stuffed);
            assert!(
                !matches!(back, Err(FrameError::Framing | FrameError::Checksum)),
                "{length}"
            );
        }
    }
}

#[test]
fn too_long_and_empty_frames_do_not_stop_the_stream() {
    let mut s = session();
    let mut stream = vec![0, 0, 0];
    stream.extend([7; 5 * MAX_FRAME]);
    stream.push(0);
    stream.extend(frame(&ToDevice::Hello));
    let answers = talk(&mut s, &stream);
    assert_eq!(
        answers[0],
        ToHost::Refused {
            reason: Reason::Damaged
        }
    );
    assert!(matches!(answers[1..], [ToHost::Hello(_)]));
    assert_eq!(s.summary().frames_rejected, 1);
}

#[test]
fn a_sound_checksum_over_other_content_is_refused() {
    let mut buffer = [0; 64];
    // Variant 77 does not exist; trailing bytes after a message are not of it.
    for content in [&[77_u8, 1, 2][..], &[0, 0][..], &[1][..]] {
        let bytes = encode(&Raw(content), &mut buffer).expect("fits");
        let mut bytes = bytes[..bytes.len() - 1].to_vec();
        assert_eq!(
            decode::<ToDevice>(&mut bytes),
            Err(FrameError::Content),
            "{content:?}"
        );
    }
}

fn encode_cobs(plain: &[u8]) -> Vec<u8> {
    let mut stuffed = vec![0; cobs::max_encoding_length(plain.len())];
    let length = cobs::encode(plain, &mut stuffed);
    stuffed.truncate(length);
    stuffed
}

/// Bytes as they are, without a length.
struct Raw<'a>(&'a [u8]);

impl serde::Serialize for Raw<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeTuple;
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        for byte in self.0 {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}

proptest! {
    #![proptest_config(cases(3000))]

    /// Flipped bits anywhere in a stream: what is accepted is what was sent.
    #[test]
    fn no_damaged_frame_is_accepted(
        seqs in prop::collection::vec(any::<u32>(), 1..6),
        flips in prop::collection::vec((any::<prop::sample::Index>(), 1_u8..=255), 1..4),
    ) {
        let mut stream: Vec<u8> = seqs.iter().flat_map(|seq| frame(&sample(*seq))).collect();
        let sent = stream.clone();
        for (place, flip) in &flips {
            let place = place.index(stream.len());
            stream[place] ^= flip;
        }
        prop_assume!(stream != sent);
        let mut accumulator = Accumulator::<MAX_FRAME>::new();
        let mut accepted = 0;
        for byte in &stream {
            let Fed::Frame(bytes) = accumulator.feed(*byte) else {
                continue;
            };
            if let Ok(message) = decode::<ToDevice>(bytes) {
                accepted += 1;
                let known = seqs.iter().any(|seq| sample(*seq) == message);
                prop_assert!(known, "{:?} was never sent", message);
            }
        }
        prop_assert!(accepted < seqs.len() || flips.len() > 1);
    }

    /// Cut off, joined, and with rubbish between: the next whole frame is always understood.
    #[test]
    fn the_stream_finds_its_feet_after_anything(
        rubbish in prop::collection::vec(any::<u8>(), 0..3000),
        cut in 0_usize..60,
        pieces in 1_usize..40,
    ) {
        let mut s = session();
        let mut stream = rubbish;
        let whole = frame(&sample(1));
        stream.extend(&whole[..cut.min(whole.len() - 2)]);
        stream.push(0);
        stream.extend(frame(&sample(2)));
        stream.extend(frame(&ToDevice::Hello));
        let mut answers = Vec::new();
        for piece in stream.chunks(pieces) {
            answers.extend(talk(&mut s, piece));
        }
        let last: Vec<_> = answers.iter().rev().take(2).collect();
        prop_assert!(matches!(last[0], ToHost::Hello(_)));
        let sound = matches!(last[1], ToHost::Command { seq: 2, status, .. } if status.is_controlled());
        prop_assert!(sound, "{:?}", last[1]);
        prop_assert_eq!(s.summary().steps, 1);
    }
}
