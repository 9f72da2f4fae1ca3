//! MuJoCo judges the simulator: `tests/foreign/mujoco_trajectories.py` had it move six devices for 5 s, and wrote each
//! as a rig (`tests/foreign/trajectories/NAME.toml`) with the trajectory beside it.

use sinew_sim::{Drive, Plant, Rig};
use sinew_tests::foreign::{self, Columns};

/// Largest difference allowed, as a part of the range of the motion; none may be above 1e-4. What is left where the
/// laws are the same is the simulator's own error at its automatic steps (docs/plant.md, eq. 14).
const DEVICES: &[(&str, f64)] = &[
    ("mass_spring_damper", 2e-6),
    ("pendulum", 2e-6),
    ("two_mass_drive", 2e-6),
    // Fixed steps across the kinks of a tendon that goes slack, on both sides.
    ("tendon_finger", 1e-5),
    // MuJoCo's friction is a soft constraint and its step first order here: doubling it moves it by 2e-6.
    ("joint_friction", 2e-5),
];

fn rig(device: &str) -> Rig {
    let name = format!("trajectories/{device}.toml");
    Rig::parse(&foreign::text(&name), &name).unwrap_or_else(|error| panic!("{error}"))
}

/// Largest difference over the range, of all signals of a device; one parameter may be scaled.
fn error(device: &str, scaled: Option<(&str, f64)>) -> f64 {
    let plant = Plant::new(&rig(device)).unwrap_or_else(|error| panic!("{device}: {error}"));
    let recording = Columns::read(&format!("trajectories/{device}.csv"));
    let t = recording.get("t");
    assert!(t[t.len() - 1] > 4.9, "{device}: not 5 s");
    let drive = Drive::new(&plant, t.len(), &[recording.get("u_1")]).expect("one input");
    let mut values = plant.values();
    if let Some((name, factor)) = scaled {
        let slot = plant.parameters().iter().position(|p| p.name == name);
        values[slot.unwrap_or_else(|| panic!("{device} has no parameter {name}"))] *= factor;
    }
    let start = plant
        .initial_state(&values, &vec![Some(0.0); plant.sensors().len()])
        .expect("it starts at rest");
    let run = plant
        .simulate(&values, &start, &drive, t)
        .unwrap_or_else(|error| panic!("{device}: {error}"));
    let mut worst: f64 = 0.0;
    for (sensor, name) in recording.beginning("q_").iter().enumerate() {
        let theirs = recording.get(name);
        let range = foreign::range(theirs);
        assert!(range > 0.05, "{device}: {name} hardly moves");
        for (ours, theirs) in run.column(sensor).iter().zip(theirs) {
            worst = worst.max((ours - theirs).abs() / range);
        }
    }
    worst
}

#[test]
fn the_simulator_agrees_with_mujoco() {
    for &(device, tolerance) in DEVICES {
        let error = error(device, None);
        println!("{device}: {error:.1e} of the range");
        assert!(error < tolerance, "{device}: {error:.2e} of the range");
    }
}

#[test]
fn a_parameter_that_is_wrong_by_a_hundredth_would_be_noticed() {
    for (device, parameter) in [
        ("mass_spring_damper", "coil.stiffness"),
        ("pendulum", "weight.amplitude"),
        ("two_mass_drive", "load.inertia"),
        ("tendon_finger", "flexor.stiffness"),
        ("joint_friction", "mass.coulomb_friction.level"),
    ] {
        let error = error(device, Some((parameter, 1.01)));
        assert!(
            error > 3e-4,
            "{device}: {error:.2e} of the range with {parameter} wrong"
        );
    }
}
