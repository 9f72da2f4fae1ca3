//! Somebody else's physics judges ours: `tests/foreign/mass_spring_damper.py` solves the same
//! device in closed form between its stops, shares no code with the simulator, and wrote the
//! recording that is compared here.

use sinew_sim::{InputTrajectory, Plant, Rig};

use super::recording::{Columns, range, text};

/// Error that is allowed, as a part of the range of the motion. The recording is exact to rounding.
const TOLERANCE: f64 = 1e-6;

/// The device with the parameters that the recording was made with, dry friction included.
fn plant(friction: f64) -> Plant {
    let truth: serde_json::Value =
        serde_json::from_str(&text("mass_spring_damper.truth.json")).expect("truth.json is JSON");
    let number = |key: &str| truth[key].as_f64().expect("truth.json holds this number");
    let rig = format!(
        r#"
format = "sinew-rig/1"
name = "truth"
[[body]]
name = "mass"
motion = "slide"
inertia = {mass:?}
[[spring]]
name = "coil"
from = "ground"
to = "mass"
stiffness = {stiffness:?}
[[damper]]
name = "dashpot"
from = "ground"
to = "mass"
damping = {damping:?}
[[actuator]]
name = "push"
drives = "mass"
input = "u_N"
gain = 1.0
[[sensor]]
name = "encoder"
reads = "mass.position"
signal = "q_m"
[[effect]]
kind = "coulomb_friction"
component = "mass"
level = {level:?}
"#,
        mass = number("mass_kg"),
        stiffness = number("stiffness_N_m"),
        damping = number("damping_N_s_m"),
        level = friction * number("coulomb_friction_N"),
    );
    Plant::new(&Rig::parse(&rig, "truth.toml").expect("the rig is sound"))
        .expect("the rig compiles")
}

/// Largest difference from the recording, as a part of the range of the motion.
fn largest_error(plant: &Plant) -> f64 {
    let recording = Columns::read("mass_spring_damper.exact.csv");
    let [t, u, q] = ["t", "u_N", "q_m"].map(|name| recording.get(name));
    let drive = InputTrajectory::new(plant, t.len(), &[u]).expect("one input");
    let run = plant
        .simulate(&plant.values(), &[0.0, 0.0], &drive, t)
        .expect("the rig can be simulated");
    let range = range(q);
    assert!(
        range > 0.1,
        "the recorded mass hardly moves: this tests nothing"
    );
    let error = q
        .iter()
        .zip(run.column(0))
        .map(|(ours, theirs)| (ours - theirs).abs())
        .fold(0.0, f64::max);
    error / range
}

#[test]
fn the_simulator_agrees_with_a_closed_solution_through_every_stop() {
    let recording = Columns::read("mass_spring_damper.exact.csv");
    let q = recording.get("q_m");
    let stuck = q.windows(2).filter(|pair| pair[0] == pair[1]).count();
    assert!(
        stuck > 50,
        "the recording sticks for {stuck} samples only: sticking is not tested"
    );
    let error = largest_error(&plant(1.0));
    println!("largest error: {error:.2e} of the range");
    assert!(error < TOLERANCE, "{error:.3e} of the range");
}

#[test]
fn a_friction_that_is_wrong_by_a_thousandth_would_be_noticed() {
    let error = largest_error(&plant(1.001));
    assert!(
        error > 10.0 * TOLERANCE,
        "{error:.3e} of the range: the comparison is blind"
    );
}
