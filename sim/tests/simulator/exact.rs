//! Linear rigs, which take a sample interval in one step: against the same rig in sub-steps as fine
//! as they have to be, at even times, at times that jitter and at times whose decimals are rounded.

use crate::complex::Complex;
use crate::mechanisms::{DAMPER, RAMP, SPRING, distance, effect, slide};
use sinew_sim::{Dual, InputTrajectory, Plant, Scalar, SimulationSettings, Stepper};

/// Everything that is linear at once: a spring that creeps, a body that hangs on another, a weight,
/// a tendon that may push.
fn everything() -> String {
    let creep = [("stiffness", 25.0), ("time_constant", 0.2)];
    let hidden = [("inertia", 0.3), ("stiffness", 60.0), ("damping", 0.4)];
    [
        SPRING,
        DAMPER,
        RAMP,
        &effect("viscoelastic_creep", "coil", &creep),
        &effect("hidden_mode", "mass", &hidden),
        &effect("viscous_damping", "mass", &[("damping", 0.3)]),
        &effect("gravity_load", "mass", &[("amplitude", 2.0)]),
        "[[tendon]]\nname = \"line\"\npath = [{ body = \"mass\", arm = 0.5 }]\nstiffness = { value = 40.0 }\n\
         damping = 0.2\npretension = { value = 0.2 }\nunilateral = false\n\
         [[actuator]]\nname = \"winch\"\ndrives = \"line\"\ninput = \"w_m\"\ngain = { value = 0.7 }\n",
    ]
    .concat()
}

/// The same with a stop that is never met: no longer linear, and taken in sub-steps.
fn in_substeps() -> Plant {
    let place = [("position", 1e3), ("stiffness", 1.0), ("damping", 0.0)];
    let far = effect("end_stop", "mass", &place) + "side = 1.0\n";
    slide(0.1, -0.4, &(everything() + &far)).with_settings(SimulationSettings {
        tolerance: Some(1e-13),
        ..SimulationSettings::default()
    })
}

fn inputs(times: &[f64]) -> [Vec<f64>; 2] {
    let of = |f: fn(f64) -> f64| times.iter().map(|&t| f(t)).collect();
    [of(|t| 3.0 * (5.0 * t).sin()), of(|t| 0.1 * (2.0 * t).cos())]
}

fn drive(plant: &Plant, times: &[f64]) -> InputTrajectory {
    let [force, winch] = inputs(times);
    InputTrajectory::new(plant, times.len(), &[&force, &winch]).unwrap()
}

fn start<S: sinew_sim::Simulated>(plant: &Plant, values: &[S]) -> Vec<S> {
    plant.initial_state(values, &[None, None]).unwrap()
}

#[test]
fn a_linear_rig_takes_one_step_a_sample_and_no_error() {
    let even = |k: usize| 0.05 * k as f64;
    let jittered = |k: usize| 0.05 * k as f64 + 0.02 * (7.0 * k as f64).sin();
    let rounded = |k: usize| (1e6 + (k as f64 * 50.0).round()) / 1e3;
    let clocks: [fn(usize) -> f64; 3] = [even, jittered, rounded];
    for (index, clock) in clocks.into_iter().enumerate() {
        let times: Vec<f64> = (0..200).map(clock).collect();
        let [ours, other] = [slide(0.1, -0.4, &everything()), in_substeps()].map(|plant| {
            let values = plant.values();
            plant
                .simulate(
                    &values,
                    &start(&plant, &values),
                    &drive(&plant, &times),
                    &times,
                )
                .unwrap()
        });
        assert_eq!(ours.report.most_substeps, 1, "clock {index}");
        assert!(other.report.most_substeps > 8, "clock {index}");
        for sensor in 0..2 {
            let error = distance(&ours.column(sensor), other.column(sensor));
            assert!(error < 1e-9, "clock {index}, sensor {sensor}: {error:e}");
        }
    }
}

/// Even times, a sample that is missing, and no two intervals alike; the interval that is shared is
/// that of the first.
#[test]
fn simulations_that_share_their_numbers_are_those_that_find_everything_themselves() {
    let plant = slide(0.1, -0.4, &everything());
    let plain = plant.values();
    let slot = plant.free_slots()[0];
    let mut values: Vec<Dual<4>> = plain.iter().map(|&v| Dual::constant(v)).collect();
    values[slot] = Dual::variable(plain[slot], 0);
    let held: Vec<Dual<4>> = (start(&plant, &plain).into_iter())
        .map(Dual::constant)
        .collect();
    let numbers = plant.parameterized(values.clone(), 0.05);
    let even = |k: usize| 0.05 * k as f64;
    let gap = |k: usize| 0.05 * (k + usize::from(k > 20)) as f64;
    let jittered = |k: usize| 0.05 * k as f64 + 0.02 * (7.0 * k as f64).sin();
    let clocks: [fn(usize) -> f64; 3] = [even, gap, jittered];
    for (index, clock) in clocks.into_iter().enumerate() {
        let times: Vec<f64> = (0..60).map(clock).collect();
        let drive = drive(&plant, &times);
        let shared = numbers.simulate(&held, &drive, &times).unwrap();
        let alone = plant.simulate(&values, &held, &drive, &times).unwrap();
        assert_eq!(shared.signals.len(), alone.signals.len());
        for (shared, alone) in shared.signals.iter().zip(&alone.signals) {
            let near = |a: f64, b: f64| (a - b).abs() < 1e-12 * (1.0 + b.abs());
            let derivatives = [shared.derivative[0], alone.derivative[0]];
            assert!(near(shared.value, alone.value), "clock {index}");
            assert!(
                near(derivatives[0], derivatives[1]),
                "clock {index}: {derivatives:?}"
            );
        }
    }
}

#[test]
fn its_derivatives_are_those_of_differences_the_complex_step_and_the_adjoint() {
    const SEEDS: usize = 24;
    let plant = slide(0.1, -0.4, &everything());
    let times: Vec<f64> = (0..100).map(|k| 0.05 * k as f64).collect();
    let plain = plant.values();
    let slots = plant.free_slots();
    let mut values: Vec<Dual<SEEDS>> = plain.iter().map(|&v| Dual::constant(v)).collect();
    for (seed, &slot) in slots.iter().enumerate() {
        values[slot] = Dual::variable(plain[slot], seed);
    }
    let drive = drive(&plant, &times);
    let held: Vec<Dual<SEEDS>> = (start(&plant, &plain).into_iter())
        .map(Dual::constant)
        .collect();
    let dual = plant.simulate(&values, &held, &drive, &times).unwrap();
    let last = dual.signals.len() - 2;
    let adjoint = plant
        .gradient(&plain, &start(&plant, &plain), &drive, &times, |run| {
            let mut by = vec![0.0; run.signals.len()];
            by[last] = 1.0;
            (run.signals[last], by)
        })
        .unwrap();
    let largest = adjoint
        .parameters
        .iter()
        .fold(0.0f64, |m, g| m.max(g.abs()));
    assert!(largest > 1e-3, "{largest}");
    for (seed, &slot) in slots.iter().enumerate() {
        let mut values: Vec<Complex> = plain.iter().map(|&v| Complex::constant(v)).collect();
        values[slot].im = 1e-30;
        let held: Vec<Complex> = (start(&plant, &plain).into_iter())
            .map(Complex::constant)
            .collect();
        let run = plant.simulate(&values, &held, &drive, &times).unwrap();
        // A derivative that is dropped is dropped in every scalar: only differences would show it.
        let step = 1e-5 * (plain[slot].abs() + 0.01);
        let beside = |sign: f64| {
            let mut values = plain.clone();
            values[slot] += sign * step;
            let run = plant.simulate(&values, &start(&plant, &plain), &drive, &times);
            run.unwrap().signals[last]
        };
        let difference = (beside(1.0) - beside(-1.0)) / (2.0 * step);
        let name = &plant.parameters()[slot].name;
        let forward = dual.signals[last].derivative[seed];
        let error = (forward - difference).abs();
        assert!(error < 1e-6 * largest, "{name}: {forward} {difference}");
        for other in [run.signals[last].im / 1e-30, adjoint.parameters[slot]] {
            assert!(
                (forward - other).abs() < 1e-10 * largest,
                "{name}: {forward} {other}"
            );
        }
    }
}

/// Excess length of an interval is taken off the next: none of it gathers.
#[test]
fn a_stepper_keeps_the_time_that_it_was_given() {
    let plant = slide(0.0, 1.0, RAMP);
    let mut stepper = Stepper::new(&plant, &plant.values(), &[0.0, 1.0]).unwrap();
    let mut time = 0.0;
    for k in 0..10_000 {
        let dt = 0.01 * (1.0 + 0.9e-9 * f64::from(k % 2));
        time += dt;
        stepper.advance(dt, &[0.0]).unwrap();
    }
    assert!(
        (stepper.signal(0) - time).abs() < 2e-11,
        "{}",
        stepper.signal(0) - time
    );
}
