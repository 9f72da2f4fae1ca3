//! The image in QEMU: the same bits as on the host, the same instructions twice, nothing left
//! behind.

use sinew::device::{Device, End, decode_log};
use sinew::project::{self, Board, Optimise, board_folder};
use sinew_device::protocol::{Reason, ToDevice, ToHost};
use sinew_model_reference_s::golden::GOLDEN;
use sinew_tests::closed_loop::{self, sample};
use sinew_tests::reference::{INPUT_LIMIT, INPUTS, OUTPUTS, Plant, RATE_LIMIT, Reference, STEPS};
use sinew_tests::{image, skip};

/// The lockstep image in QEMU, or why not.
fn lockstep() -> Option<Device> {
    if let Some(reason) = image::cannot_run() {
        skip(reason);
        return None;
    }
    Some(image::start(Board::Qemu).unwrap_or_else(|error| panic!("{error}")))
}

fn on_the_host() -> Device {
    image::start(Board::Host).unwrap_or_else(|error| panic!("{error}"))
}

/// More than decoding a sample and encoding its answer take: 62,500 instructions.
const TRANSPORT_TICKS: u64 = 50_000;

/// Number of steps that end after their period when each takes its ticks and `overhead` more, and a
/// late one delays the next.
fn late_steps(ticks: &[u64], overhead: u64) -> u64 {
    const PERIOD: u64 = 8333 * 25;
    let (mut now, mut late) = (0, 0);
    for (k, step) in (0..).zip(ticks) {
        now = u64::max(now, k * PERIOD) + step + overhead;
        late += u64::from(now > (k + 1) * PERIOD);
    }
    late
}

/// The published limits of the reference problem, on what left the device.
fn check_limits(k: usize, before: [f32; INPUTS], u: [f32; INPUTS]) {
    for (u, before) in u.into_iter().zip(before) {
        assert!(u.abs() <= INPUT_LIMIT, "step {k}: {u} is outside the box");
        // In double precision, in which the difference of two f32 is exact.
        let change = f64::from(u) - f64::from(before);
        assert!(
            change.abs() <= f64::from(RATE_LIMIT),
            "step {k}: from {before} to {u}"
        );
    }
}

#[test]
fn host_and_qemu_give_the_same_bits() {
    let Some(mut device) = lockstep() else { return };
    let in_qemu = closed_loop::run(&mut device).unwrap_or_else(|error| panic!("{error}"));
    let on_host = closed_loop::run(&mut on_the_host()).unwrap_or_else(|error| panic!("{error}"));

    let moves = in_qemu
        .steps
        .windows(2)
        .filter(|pair| pair[0].u != pair[1].u);
    assert!(
        moves.count() > STEPS / 2,
        "the controller hardly moves: nothing is compared"
    );
    for (k, (a, b)) in in_qemu.steps.iter().zip(&on_host.steps).enumerate() {
        let bits = |u: &[f32]| u.iter().map(|u| u.to_bits()).collect::<Vec<_>>();
        assert_eq!(
            bits(&a.u),
            bits(&b.u),
            "step {k}: {:?} in QEMU, {:?} on the host",
            a.u,
            b.u
        );
    }
    assert_eq!(in_qemu.identity, on_host.identity);
}

/// One probe of the bare network: the outputs, then the rows of the Jacobian.
fn probe(device: &mut Device, x: &[f32]) -> Vec<f32> {
    let x = x.iter().copied().collect();
    let answer = device.ask(&ToDevice::Probe { x });
    let ToHost::Prediction { y, jacobian } = answer.unwrap_or_else(|error| panic!("{error}"))
    else {
        panic!("a probe was not answered by a prediction");
    };
    y.iter().chain(&jacobian).copied().collect()
}

#[test]
fn golden_vectors_give_the_same_bits_and_are_right() {
    let Some(mut in_qemu) = lockstep() else {
        return;
    };
    let mut on_host = on_the_host();
    for golden in &GOLDEN {
        let values = probe(&mut in_qemu, &golden.x);
        let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(
            bits(&values),
            bits(&probe(&mut on_host, &golden.x)),
            "{:?}",
            golden.x
        );

        let exact: Vec<f64> = golden
            .y
            .iter()
            .chain(golden.jacobian.iter().flatten())
            .copied()
            .collect();
        assert_eq!(values.len(), exact.len());
        let size = exact.iter().fold(0.0, |size: f64, v| size.max(v.abs()));
        assert!(size > 1e-3, "this vector tests nothing");
        for (value, exact) in values.iter().zip(&exact) {
            let error = (f64::from(*value) - exact).abs() / size;
            assert!(
                error < 2e-6,
                "{value} instead of {exact}: {error:e} of the largest"
            );
        }
    }
}

#[test]
fn the_log_is_readable_on_the_host() {
    let Some(mut device) = lockstep() else { return };
    let identity = device.hello(None).unwrap_or_else(|error| panic!("{error}"));
    let (_, end) = device.finish().unwrap_or_else(|error| panic!("{error}"));

    let image = image::build(Board::Qemu)
        .unwrap_or_else(|error| panic!("{error}"))
        .lockstep;
    let log = decode_log(&image, &end.log).unwrap_or_else(|error| panic!("{error}"));
    let lines: Vec<&str> = log.lines().collect();
    assert_eq!(lines.len(), 2, "{lines:?}");
    assert!(
        lines[0].contains(&format!("model {:08x}", identity.model)),
        "{lines:?}"
    );
    assert!(
        lines[1].contains("stopped: Summary { steps: 0"),
        "{lines:?}"
    );
}

#[test]
fn two_runs_take_the_same_instructions() {
    let (Some(mut first), Some(mut second)) = (lockstep(), lockstep()) else {
        return;
    };
    let first = closed_loop::run(&mut first).unwrap_or_else(|error| panic!("{error}"));
    let second = closed_loop::run(&mut second).unwrap_or_else(|error| panic!("{error}"));
    assert!(
        first.steps.iter().all(|step| step.ticks > 0),
        "the counter stands still"
    );
    assert_eq!(first, second);
}

#[test]
fn the_reference_run_meets_its_deadlines_limits_and_reference() {
    let Some(mut device) = lockstep() else { return };
    let run = closed_loop::run(&mut device).unwrap_or_else(|error| panic!("{error}"));
    let end = device.end().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(end.status, Some(0), "Stop ends with status 0");

    assert_eq!(run.summary.steps as usize, STEPS);
    let ticks: Vec<u64> = run.steps.iter().map(|step| step.ticks.into()).collect();
    let counted = u64::from(run.summary.deadline_misses);
    let (least, most) = (late_steps(&ticks, 0), late_steps(&ticks, TRANSPORT_TICKS));
    assert!(
        (least..=most).contains(&counted),
        "{counted} misses, not {least} to {most}"
    );
    assert_eq!(run.summary.frames_rejected, 0);
    assert!(
        run.summary.stack_high_water_bytes > 500,
        "{:?}",
        run.summary
    );
    let mut previous = [0.0; INPUTS];
    for (k, step) in run.steps.iter().enumerate() {
        let u = [step.u[0], step.u[1]];
        check_limits(k, previous, u);
        previous = u;
    }
    // An IPOPT optimum over the same horizon tracks with 0.0218; at rest all the time it would be
    // 0.2.
    assert!(
        run.tracking_rms < 0.03,
        "tracking error {}",
        run.tracking_rms
    );
}

#[test]
fn a_missed_deadline_is_counted() {
    let Some(mut device) = lockstep() else { return };
    let reference = Reference::load().unwrap_or_else(|error| panic!("{error}"));
    device.arm().unwrap_or_else(|error| panic!("{error}"));
    // Damaged frames are worked on in virtual time: some thousands of them make the next step late.
    let long = [vec![0x55; 1000], vec![0]].concat();
    for _ in 0..100 {
        device
            .send_bytes(&long)
            .unwrap_or_else(|error| panic!("{error}"));
        let answer = device.receive().unwrap_or_else(|error| panic!("{error}"));
        let reason = Reason::Damaged;
        assert_eq!(answer, ToHost::Refused { reason });
    }
    let question = sample(0, [0.0; OUTPUTS], &reference, 10);
    let answer = device
        .ask(&question)
        .unwrap_or_else(|error| panic!("{error}"));
    assert!(matches!(answer, ToHost::Command { .. }), "{answer:?}");
    let ToHost::Done(summary) = device
        .ask(&ToDevice::Stop)
        .unwrap_or_else(|error| panic!("{error}"))
    else {
        panic!("Stop was not answered by Done");
    };
    assert_eq!((summary.deadline_misses, summary.frames_rejected), (1, 100));
}

#[test]
fn without_a_host_the_image_ends() {
    let Some(mut device) = lockstep() else { return };
    device.hello(None).unwrap_or_else(|error| panic!("{error}"));
    // What the kernel does for a host that was killed: the pipe is closed and nothing is said.
    let End { status, log } = device.end().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(status, Some(3));
    assert!(!log.is_empty(), "it says why in the log");
}

#[test]
fn without_channel_files_the_image_says_so() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let image = image::build(Board::Qemu)
        .unwrap_or_else(|error| panic!("{error}"))
        .lockstep;
    let empty = tempfile::tempdir().expect("a temporary folder can be made");
    let status = std::process::Command::new(image::runner())
        .arg(&image)
        .env("LOG", empty.path().join("log"))
        .current_dir(empty.path())
        .status();
    assert_eq!(status.expect("QEMU starts").code(), Some(2));
}

#[test]
fn over_the_serial_line_no_frame_is_lost() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    const SAMPLES: usize = 200;
    let built = image::build(Board::Qemu).unwrap_or_else(|error| panic!("{error}"));
    let free = built
        .free
        .expect("this board has a program that paces itself");
    let mut device =
        Device::serial(&image::runner(), &free).unwrap_or_else(|error| panic!("{error}"));
    let reference = Reference::load().unwrap_or_else(|error| panic!("{error}"));

    // It speaks first.
    let ToHost::Hello(identity) = device.receive().unwrap_or_else(|error| panic!("{error}")) else {
        panic!("the first frame is not Hello");
    };
    device.arm().unwrap_or_else(|error| panic!("{error}"));
    let mut plant = Plant::default();
    let mut previous = [0.0; INPUTS];
    let mut moved = 0;
    for k in 0..SAMPLES {
        let horizon = usize::from(identity.horizon);
        let question = sample(k, plant.outputs(), &reference, horizon);
        device
            .send(&question)
            .unwrap_or_else(|error| panic!("{error}"));
        // Every tick brings a command. Those for which no sample came in time are bridged and
        // repeat the number of the last; sooner or later the answer to this one comes.
        loop {
            let answer = device.receive().unwrap_or_else(|error| panic!("{error}"));
            let ToHost::Command { seq, u, .. } = answer else {
                panic!("sample {k} was answered by {answer:?}");
            };
            assert!(
                seq as usize == k || seq as usize + 1 == k,
                "{seq} after sample {k}"
            );
            let u = [u[0], u[1]];
            check_limits(k, previous, u);
            moved += usize::from(u != previous);
            previous = u;
            if seq as usize == k {
                plant.advance(u.map(f64::from));
                break;
            }
        }
    }
    assert!(
        moved > SAMPLES / 2,
        "the controller hardly moves: nothing is tested"
    );

    device
        .send(&ToDevice::Stop)
        .unwrap_or_else(|error| panic!("{error}"));
    let summary = loop {
        match device.receive().unwrap_or_else(|error| panic!("{error}")) {
            ToHost::Command { .. } => {}
            ToHost::Done(summary) => break summary,
            other => panic!("Stop was answered by {other:?}"),
        }
    };
    assert_eq!(summary.frames_rejected, 0);
    assert!(summary.steps as usize >= SAMPLES, "{summary:?}");
    let end = device.end().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(end.status, Some(0));
}

/// Network S behind a soft sensor of six channels, of which two say each output; they are watched.
fn sensed() -> sinew_model::spec::ModelSpec {
    use sinew_model::spec::{Signal, SoftSensorSpec, WatchSpec};
    let spec = sinew_model::store::load(&image::root().join("models/reference-s"));
    let spec = spec.unwrap_or_else(|error| panic!("{error}"));
    let mut linear = vec![0.0; 18];
    let mut weights = vec![0.0; 36];
    for i in 0..3 {
        (linear[6 * i + i], linear[6 * i + i + 3]) = (0.5, 0.5);
        (weights[6 * i + i + 3], weights[6 * (i + 3) + i]) = (1.0, 1.0);
    }
    sinew_model::spec::ModelSpec {
        name: "sensed".into(),
        channels: (0..6)
            .map(|i| Signal {
                name: format!("light_{i}"),
                unit: "1".into(),
                span: 2.0,
                offset: 0.5,
            })
            .collect(),
        soft_sensor: Some(SoftSensorSpec {
            error: vec![0.0; 3],
            bias: vec![0.0; 3],
            linear,
            quadratic: (0..63).map(|i| 0.01 * f64::from(i).sin() as f32).collect(),
            watch: Some(WatchSpec {
                bias: vec![0.0; 6],
                weights,
                spread: vec![0.05; 6],
            }),
        }),
        ..spec
    }
}

#[test]
fn a_controller_that_reads_no_output_gives_the_same_bits() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let folder = image::cache().join("sensed");
    let spec = sensed();
    let written = project::write(&folder, &spec, Optimise::Speed);
    written.unwrap_or_else(|error| panic!("{error}"));
    let start = |board| {
        let built = project::build(&folder, board, Some(&image::cache()));
        let built = built.unwrap_or_else(|error| panic!("{error}"));
        let device = match board {
            Board::Host => Device::host(&built.lockstep),
            _ => Device::qemu(
                &board_folder(&folder, board).join("run.sh"),
                &built.lockstep,
            ),
        };
        let mut device = device.unwrap_or_else(|error| panic!("{error}"));
        let identity = device.hello(Some(sinew_model::fingerprint(&spec)));
        let identity = identity.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((identity.n_y, identity.n_s), (3, 6));
        device.arm().unwrap_or_else(|error| panic!("{error}"));
        device
    };
    let run = |mut device: Device| {
        let step = |k: u32| {
            // From step 40 on the fifth channel is dead: its twin says it and the two contradict
            // one another, of which the first is blamed.
            let s = |i: u32| match i {
                4 if k >= 40 => 0.5,
                _ => 0.5 + (0.05 * f64::from(k * (i % 3 + 1))).sin() as f32,
            };
            let question = ToDevice::Sample {
                seq: k,
                y: [f32::NAN; 3].into_iter().collect(),
                s: (0..6).map(s).collect(),
                reference: [0.1, -0.05, 0.2].into_iter().collect(),
            };
            match device.ask(&question) {
                Ok(ToHost::Command { u, status, .. }) => {
                    assert!(status.is_controlled(), "step {k}: {status:?}");
                    u.iter().map(|u| u.to_bits()).collect::<Vec<_>>()
                }
                other => panic!("step {k}: {other:?}"),
            }
        };
        let bits: Vec<Vec<u32>> = (0..40).map(step).collect();
        let (summary, _) = device.finish().unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(summary.missed_samples, 0);
        bits
    };
    let in_qemu = run(start(Board::Qemu));
    assert_eq!(in_qemu, run(start(Board::Host)));
    let moved = in_qemu.windows(2).filter(|pair| pair[0] != pair[1]);
    assert!(moved.count() > 20, "the controller hardly moves");
}
