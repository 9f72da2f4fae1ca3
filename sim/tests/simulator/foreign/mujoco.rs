//! MuJoCo judges the simulator: `tests/foreign/mujoco_trajectories.py` had it move six devices for
//! 5 s, and wrote each as a rig (`tests/foreign/trajectories/NAME.toml`) with the trajectory beside
//! it.

use super::recording::{Columns, error};

/// Largest difference allowed, as a part of the range of the motion; none may be above 1e-4. What
/// is left where the laws are the same is the simulator's own error at its automatic steps
/// (docs/explanation/plant.md, eq. 19).
const DEVICES: &[(&str, f64)] = &[
    ("mass_spring_damper", 2e-6),
    ("pendulum", 2e-6),
    ("two_mass_drive", 2e-6),
    // Fixed steps across the kinks of a tendon that goes slack, on both sides.
    ("tendon_finger", 1e-5),
    // MuJoCo's friction is a soft constraint and its step first order here: doubling it moves it by
    // 2e-6.
    ("joint_friction", 2e-5),
    // MuJoCo's limit gives way to 1e-4 of the other forces.
    ("end_stop", 1e-4),
];

#[test]
fn the_simulator_agrees_with_mujoco() {
    for &(device, tolerance) in DEVICES {
        let recording = Columns::read(&format!("trajectories/{device}.csv"));
        let t = recording.get("t");
        assert!(t[t.len() - 1] > 4.9, "{device}: not 5 s");
        let error = error("trajectories", device, None);
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
        ("end_stop", "mass.end_stop.position"),
    ] {
        let error = error("trajectories", device, Some((parameter, 1.01)));
        assert!(
            error > 3e-4,
            "{device}: {error:.2e} of the range with {parameter} wrong"
        );
    }
}
