//! Long runs on the board in QEMU: random states for the longest step, and hours of control.
//!
//! Short by default; `cargo xtask survive` sets SINEW_WORST_STATES=100000 and
//! SINEW_SOAK_STEPS=432000 (an hour at 120 Hz).

use sinew::device::Device;
use sinew::project::Board;
use sinew_device::protocol::{ToDevice, ToHost};
use sinew_tests::closed_loop::sample;
use sinew_tests::reference::{INPUT_LIMIT, OUTPUTS, Plant, Reference, STEPS};
use sinew_tests::{image, skip, snapshot};

fn lockstep() -> Option<Device> {
    if let Some(reason) = image::cannot_run() {
        skip(reason);
        return None;
    }
    let mut device = image::start(Board::Qemu).unwrap_or_else(|error| panic!("{error}"));
    device.arm().unwrap_or_else(|error| panic!("{error}"));
    Some(device)
}

fn setting(name: &str, default: usize) -> usize {
    std::env::var(name).map_or(default, |n| n.parse().expect("a number"))
}

/// Command and instructions of one step.
fn step(device: &mut Device, question: &ToDevice) -> ([f32; 2], u64) {
    let answer = device
        .ask(question)
        .unwrap_or_else(|error| panic!("{error}"));
    let ToHost::Command { u, ticks, .. } = answer else {
        panic!("{answer:?}");
    };
    // 40 ns a tick, 32 ns an instruction (boards/qemu/README.md).
    ([u[0], u[1]], u64::from(ticks) * 5 / 4)
}

/// Instructions in a period of 120 Hz at one in 32 ns.
const PERIOD: u64 = 260_416;

/// Uniform in -1 to 1, the same on every machine (xorshift).
fn uniform(state: &mut u64) -> f32 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    (*state >> 40) as f32 / (1_u64 << 23) as f32 - 1.0
}

#[test]
fn random_states_and_references_take_less_than_a_period() {
    let Some(mut device) = lockstep() else { return };
    let states = setting("SINEW_WORST_STATES", 400);
    let mut random = 0x9E37_79B9_7F4A_7C15;
    let (mut longest, mut sum, mut solved) = (0, 0, 0_u64);
    for k in 0..states {
        // Every fourth state is a jump from one that is not remembered; the others follow it.
        if k % 4 == 0 {
            device
                .ask(&ToDevice::Reset)
                .unwrap_or_else(|error| panic!("{error}"));
        }
        let question = ToDevice::Sample {
            seq: k as u32,
            y: (0..OUTPUTS).map(|_| 1.2 * uniform(&mut random)).collect(),
            s: heapless::Vec::new(),
            reference: (0..10 * OUTPUTS)
                .map(|_| 1.2 * uniform(&mut random))
                .collect(),
        };
        let (u, instructions) = step(&mut device, &question);
        assert!(u.iter().all(|u| u.abs() <= INPUT_LIMIT), "{u:?}");
        longest = longest.max(instructions);
        sum += instructions;
        solved += u64::from(instructions > 1000);
    }
    assert_eq!(solved, states as u64, "some steps computed nothing");
    println!(
        "{states} random states: {} instructions a step in the mean, {longest} in the longest; a period has {PERIOD}",
        sum / states as u64
    );
    // References that jump at random at every step of the horizon ask far more of the optimisation
    // than a trajectory does: here the deadline is what has to hold, not the budget of the
    // reference run.
    assert!(longest <= PERIOD, "{longest}");
}

#[test]
fn nothing_wears_out() {
    let Some(mut device) = lockstep() else { return };
    let steps = setting("SINEW_SOAK_STEPS", 3 * STEPS).max(3 * STEPS);
    let reference = Reference::load().unwrap_or_else(|error| panic!("{error}"));
    let mut plant = Plant::default();
    let lap_error = |device: &mut Device, plant: &mut Plant, lap: usize| {
        let mut squares = 0.0;
        for k in 0..STEPS {
            let y = plant.outputs();
            for (y, r) in y.iter().zip(reference.at(k)) {
                squares += (y - f64::from(r)).powi(2);
            }
            let mut question = sample(k, y, &reference, 10);
            if let ToDevice::Sample { seq, .. } = &mut question {
                *seq = (lap * STEPS + k) as u32;
            }
            let (u, _) = step(device, &question);
            plant.advance(u.map(f64::from));
        }
        (squares / (STEPS * OUTPUTS) as f64).sqrt()
    };
    // The first lap starts at rest, every other where the one before has ended.
    let _ = lap_error(&mut device, &mut plant, 0);
    let laps = steps.div_ceil(STEPS);
    let second = lap_error(&mut device, &mut plant, 1);
    let mut last = second;
    for lap in 2..laps {
        last = lap_error(&mut device, &mut plant, lap);
    }
    let (summary, end) = device.finish().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(end.status, Some(0));
    assert_eq!(summary.steps as usize, laps * STEPS);
    assert_eq!((summary.missed_samples, summary.frames_rejected), (0, 0));
    println!(
        "{} steps, {:.0} s at 120 Hz: {} late, {} B of stack; tracking error {second:.6} in lap 2, {last:.6} in the last",
        summary.steps,
        f64::from(summary.steps) / 120.0,
        summary.deadline_misses,
        summary.stack_high_water_bytes
    );
    assert!(
        (last - second).abs() < 0.05 * second,
        "it wears out: {second} and {last}"
    );
    let budget = snapshot::budget("reference_s_n10").unwrap_or_else(|error| panic!("{error}"));
    assert!(u64::from(summary.stack_high_water_bytes) <= budget.stack_bytes);
}
