//! `sinew record` and `sinew monitor` against the board in QEMU, over its serial port, with a
//! simulated rig behind its converters: the code that a real board meets.

use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

use sinew::device::Device;
use sinew::live::Names;
use sinew::live::record::{Recorded, excitation, record};
use sinew_device::mode::{Drive, Mode};
use sinew_device::protocol::{Telemetry, ToDevice, ToHost};
use sinew_ident::recording::Recording;
use sinew_tests::board::{Desk, FULL_SCALE, codes};
use sinew_tests::reference::{INPUT_LIMIT, Plant, RATE_LIMIT};
use sinew_tests::{image, skip};

fn names() -> Names {
    Names::load(&image::root().join("models/reference-s")).unwrap_or_else(|error| panic!("{error}"))
}

/// Two sines inside the limits, as a file holds them.
fn sines(seconds: f64) -> Recording {
    let mut text = String::from("t,u1,u2\n");
    for k in 0..(seconds * 120.0) as usize {
        let t = k as f64 / 120.0;
        text += &format!("{t},{},{}\n", 0.5 * (3.0 * t).sin(), 0.4 * (5.0 * t).sin());
    }
    Recording::parse(text.as_bytes(), "sines.csv").unwrap_or_else(|error| panic!("{error}"))
}

/// So many seconds of sines played on a board, and what came of them.
fn recorded(mut device: Device, seconds: f64) -> Recorded {
    let names = names();
    let identity = names
        .greet(&mut device)
        .unwrap_or_else(|error| panic!("{error}"));
    let rows = excitation(&sines(seconds), &names, identity.rate_mhz)
        .unwrap_or_else(|error| panic!("{error}"));
    let recorded = record(&mut device, &names, &rows, Path::new("out.csv"), true)
        .unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(recorded.ended, None, "the board stopped by itself");
    // Rows that came too late were held: more ticks than rows, and it says so.
    assert_eq!(
        recorded.recording.len(),
        rows.len() + recorded.held_ticks + recorded.lost_ticks
    );
    let u1 = recorded.recording.column("u1");
    let u1 = u1.expect("a signal of the model");
    assert!(
        u1.iter().fold(0.0, |m: f64, u| m.max(u.abs())) > 0.4,
        "it was not excited"
    );
    recorded
}

#[test]
fn a_recording_from_the_board_is_what_the_rig_did() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    // Every 25th sample of one sensor is missing.
    let desk = Desk::start(
        |k, y| {
            let mut codes = codes(y);
            if k % 25 == 0 {
                codes[1] = 0;
            }
            codes
        },
        None,
    );
    let desk = desk.unwrap_or_else(|error| panic!("{error}"));
    let device = desk.connect().unwrap_or_else(|error| panic!("{error}"));
    let recorded = recorded(device, 2.0);
    let recording = &recorded.recording;
    let missing = recording.len() / 25;
    assert!(
        recorded.missing_samples.abs_diff(missing) <= 1,
        "{} missing, {missing} expected",
        recorded.missing_samples
    );
    // The board's clock: every step is one period of its timer.
    for pair in recording.t().windows(2) {
        assert!((pair[1] - pair[0] - 1.0 / 120.0).abs() < 2e-6, "{pair:?}");
    }
    // The same commands on the same rig here give the same outputs, to a converter's step.
    let column = |name: &str| recording.column(name).expect("a signal of the model");
    let (u1, u2, y1) = (column("u1"), column("u2"), column("y1"));
    if recorded.lost_ticks == 0 {
        let mut plant = Plant::default();
        let step = 2.0 / f64::from(FULL_SCALE);
        let mut largest = 0.0_f64;
        for k in 0..recording.len() {
            let y = plant.outputs()[0];
            largest = largest.max(y.abs());
            assert!(
                (y - y1[k]).abs() < 2.0 * step,
                "tick {k}: {y} and {}",
                y1[k]
            );
            plant.advance([u1[k], u2[k]]);
        }
        assert!(largest > 0.2, "the rig hardly moved: {largest}");
    }
    // Disarmed afterwards: outputs off before long.
    std::thread::sleep(Duration::from_millis(500));
    let last = *desk.ticks().last().expect("the rig ran");
    assert!(!last.live, "{last:?}");
}

#[test]
fn a_board_without_a_serial_port_is_recorded_through_its_probe() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let desk = Desk::start(|_, y| codes(y), None).unwrap_or_else(|error| panic!("{error}"));
    let device = desk.probe().unwrap_or_else(|error| panic!("{error}"));
    recorded(device, 1.0);
}

/// Telemetry until `done`, at most for a while.
fn until(device: &mut Device, what: &str, mut done: impl FnMut(&Telemetry) -> bool) -> Telemetry {
    let patience = Instant::now() + Duration::from_secs(30);
    let mut alive = Instant::now();
    loop {
        assert!(Instant::now() < patience, "never: {what}");
        if alive.elapsed() > Duration::from_millis(300) {
            alive = Instant::now();
            let _ = device.send(&ToDevice::Stream { every: 1 });
        }
        let next = device.telemetry(Instant::now() + Duration::from_millis(100));
        if let Some(telemetry) = next.unwrap_or_else(|error| panic!("{error}"))
            && done(&telemetry)
        {
            return telemetry;
        }
    }
}

#[test]
fn the_board_follows_on_its_own_rig_and_is_steered_while_it_runs() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let desk = Desk::start(|_, y| codes(y), None).unwrap_or_else(|error| panic!("{error}"));
    let mut device = desk.connect().unwrap_or_else(|error| panic!("{error}"));
    let _ = names()
        .greet(&mut device)
        .unwrap_or_else(|error| panic!("{error}"));
    let mut say = |message: &ToDevice| {
        device
            .insist(message, |a| matches!(a, ToHost::State(_) | ToHost::Tuned))
            .map(|_| ())
    };
    let (drive, blend_steps) = (Drive::Rig, 60);
    say(&ToDevice::Arm { drive, blend_steps }).unwrap_or_else(|error| panic!("{error}"));
    say(&ToDevice::Stream { every: 1 }).unwrap_or_else(|error| panic!("{error}"));
    // What an equilibrium of the rig gives (u = 0.5, -0.3).
    let mut plant = Plant::default();
    (0..600).for_each(|_| plant.advance([0.5, -0.3]));
    let goal = plant.outputs();
    let reference = goal.iter().map(|r| *r as f32).collect();
    say(&ToDevice::Follow { reference }).unwrap_or_else(|error| panic!("{error}"));
    let arrived = until(&mut device, "it arrives", |t| {
        t.y.iter()
            .zip(goal)
            .all(|(y, r)| (f64::from(*y) - r).abs() < 0.03)
    });
    assert!(matches!(arrived.state.mode, Mode::Armed(Drive::Rig)));
    assert!(
        arrived.ticks > 1000,
        "a step takes some instructions: {}",
        arrived.ticks
    );

    // A bad limit changes nothing, a good one holds.
    let limit = |most: f32| ToDevice::Limit {
        lower: [-most; 2].into_iter().collect(),
        upper: [most; 2].into_iter().collect(),
        rate: [RATE_LIMIT; 2].into_iter().collect(),
    };
    let tuned = |a: &ToHost| matches!(a, ToHost::Tuned);
    let refused = device.insist(&limit(2.0 * INPUT_LIMIT), tuned);
    assert!(refused.is_err_and(|e| e.to_string().contains("Limits")));
    device
        .insist(&limit(0.6), tuned)
        .unwrap_or_else(|error| panic!("{error}"));
    let far = [0.9_f32; 3].into_iter().collect();
    device
        .insist(&ToDevice::Follow { reference: far }, tuned)
        .unwrap_or_else(|error| panic!("{error}"));
    let mut largest = 0.0_f32;
    let mut seen = 0;
    until(&mut device, "half a second", |t| {
        largest = t.u.iter().fold(largest, |m, u| m.max(u.abs()));
        seen += 1;
        seen > 60
    });
    assert!(largest <= 0.6, "{largest}");
    assert!(
        largest > 0.59,
        "the limit was never met: nothing is tested ({largest})"
    );

    // Emergency stop: off at once.
    device
        .insist(&ToDevice::EmergencyStop, |a| matches!(a, ToHost::State(_)))
        .unwrap_or_else(|error| panic!("{error}"));
    let off = until(&mut device, "it stops", |t| t.state.mode == Mode::Tripped);
    assert_eq!(off.u.as_slice(), [0.0; 2]);
    // What the rig got lies in another pipe than what was told of it, and may be read later.
    let rig_is_off = || desk.ticks().last().is_some_and(|tick| !tick.live);
    let waited = Instant::now();
    while !rig_is_off() {
        assert!(
            waited.elapsed() < Duration::from_secs(2),
            "the rig is still driven"
        );
        sleep(Duration::from_millis(2));
    }
}
