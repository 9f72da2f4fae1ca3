//! docs/reference/faults.md, row by row, on the board in QEMU: each fault is made, and the rig
//! behind the converters sees what the firmware does about it.

use std::time::{Duration, Instant};

use sinew::device::Device;
use sinew_device::mode::{Cause, Drive, Mode, State};
use sinew_device::protocol::{ToDevice, ToHost};
use sinew_tests::board::{Desk, codes};
use sinew_tests::reference::OUTPUTS;
use sinew_tests::{image, skip};

/// A board that follows 0.1 on its own rig.
fn armed(
    sensors: impl FnMut(usize, [f64; OUTPUTS]) -> [u16; OUTPUTS] + Send + 'static,
    inject: Option<&str>,
) -> Option<(Desk, Device)> {
    if let Some(reason) = image::cannot_run() {
        skip(reason);
        return None;
    }
    let desk = Desk::start(sensors, inject).unwrap_or_else(|error| panic!("{error}"));
    let mut device = desk.connect().unwrap_or_else(|error| panic!("{error}"));
    let (drive, blend_steps) = (Drive::Rig, 0);
    let reference = [0.3_f32, -0.2, 0.1].into_iter().collect();
    for message in [
        ToDevice::Arm { drive, blend_steps },
        ToDevice::Follow { reference },
    ] {
        device
            .insist(&message, |a| matches!(a, ToHost::State(_) | ToHost::Tuned))
            .unwrap_or_else(|error| panic!("{error}"));
    }
    Some((desk, device))
}

/// Asks until the board is no longer armed.
fn disarmed(device: &mut Device) -> State {
    let patience = Instant::now() + Duration::from_secs(60);
    loop {
        let answer = device.insist(&ToDevice::Stream { every: 0 }, |a| {
            matches!(a, ToHost::State(_))
        });
        match answer {
            Ok(ToHost::State(state)) if !matches!(state.mode, Mode::Armed(_)) => return state,
            answer => assert!(Instant::now() < patience, "it is not disarmed: {answer:?}"),
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// The rig was driven, and is so no more.
fn driven_then_off(desk: &Desk) {
    assert!(
        desk.ticks().iter().any(|tick| tick.live),
        "it was never driven: nothing is tested"
    );
    let patience = Instant::now() + Duration::from_secs(20);
    while desk.ticks().last().is_some_and(|tick| tick.live) {
        assert!(Instant::now() < patience, "the outputs stay on");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// When the faults begin: the board is armed by then.
const LATER: usize = 240;

fn ends_with(
    sensors: impl FnMut(usize, [f64; OUTPUTS]) -> [u16; OUTPUTS] + Send + 'static,
    inject: Option<&str>,
    cause: Cause,
) -> Option<Desk> {
    let (desk, mut device) = armed(sensors, inject)?;
    let state = disarmed(&mut device);
    assert_eq!((state.mode, state.cause), (Mode::Disarmed, cause));
    driven_then_off(&desk);
    Some(desk)
}

#[test]
fn a_board_that_nobody_armed_drives_nothing() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let desk = Desk::start(|_, y| codes(y), None).unwrap_or_else(|error| panic!("{error}"));
    let mut device = desk.connect().unwrap_or_else(|error| panic!("{error}"));
    let state = disarmed(&mut device);
    assert_eq!((state.mode, state.cause), (Mode::Disarmed, Cause::Start));
    let patience = Instant::now() + Duration::from_secs(20);
    while desk.ticks().len() <= 10 {
        assert!(Instant::now() < patience, "it does not run");
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(desk.ticks().iter().all(|tick| !tick.live));
}

#[test]
fn a_broken_wire_disarms() {
    ends_with(
        |k, y| if k < LATER { codes(y) } else { [0; OUTPUTS] },
        None,
        Cause::SamplesLost,
    );
}

#[test]
fn a_sensor_at_the_end_of_its_range_disarms() {
    // What a plant that runs away looks like from behind a converter.
    let away = |k, y: [f64; OUTPUTS]| codes(if k < LATER { y } else { y.map(|y| y + 3.0) });
    ends_with(away, None, Cause::SamplesLost);
}

#[test]
fn a_stuck_sensor_disarms() {
    // It reads 0 whatever happens; the controller pushes on towards 0.3.
    let stuck = |_, y: [f64; OUTPUTS]| codes([0.0, y[1], y[2]]);
    ends_with(stuck, None, Cause::Stuck);
}

#[test]
fn steps_that_are_late_in_a_row_disarm() {
    ends_with(|_, y| codes(y), Some("slow 240"), Cause::Late);
}

#[test]
fn a_firmware_that_hangs_is_bitten_and_restarts_disarmed() {
    ends_with(|_, y| codes(y), Some("hang 240"), Cause::Watchdog);
}

#[test]
fn a_fault_restarts_disarmed() {
    ends_with(|_, y| codes(y), Some("undefined 240"), Cause::Fault);
}

#[test]
fn a_host_that_falls_silent_disarms() {
    let Some((desk, mut device)) = armed(|_, y| codes(y), None) else {
        return;
    };
    // Not a byte for longer than the board waits.
    let silence = Instant::now();
    while silence.elapsed() < Duration::from_secs(4) {
        let _ = device.telemetry(Instant::now() + Duration::from_millis(100));
    }
    driven_then_off(&desk);
    let state = disarmed(&mut device);
    assert_eq!((state.mode, state.cause), (Mode::Disarmed, Cause::LinkLost));
}

#[test]
fn a_stack_near_its_end_is_said_in_the_log() {
    let Some((desk, mut device)) = armed(|_, y| codes(y), Some("deep 120")) else {
        return;
    };
    let deadline = Instant::now() + Duration::from_secs(20);
    while desk.ticks().len() < 300 && Instant::now() < deadline {
        let _ = device.insist(&ToDevice::Stream { every: 0 }, |a| {
            matches!(a, ToHost::State(_))
        });
        std::thread::sleep(Duration::from_millis(100));
    }
    let log = desk.log().unwrap_or_else(|error| panic!("{error}"));
    assert!(log.contains("bytes of stack were never used"), "{log}");
}
