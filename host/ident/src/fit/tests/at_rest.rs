//! Recordings that determine no parameter, or not all: what they leave open stays as written.

use super::*;
use crate::report::unexplained;

/// A pendulum under gravity, its damping and gain believed.
const PENDULUM: &str = r#"
[[body]]
name = "arm"
motion = "hinge"
inertia = { value = 0.02 }
[[gravity]]
name = "weight"
body = "arm"
amplitude = { value = 0.5 }
[[damper]]
name = "bearing"
from = "ground"
to = "arm"
damping = { value = 0.01 }
[[actuator]]
name = "motor"
drives = "arm"
input = "u_V"
gain = { value = 0.3 }
[[sensor]]
name = "encoder"
reads = "arm.position"
signal = "q_rad"
"#;

/// A carriage that nothing holds.
const CARRIAGE: &str = r#"
[[body]]
name = "carriage"
motion = "slide"
inertia = { value = 3.0 }
[[damper]]
name = "rail"
from = "ground"
to = "carriage"
damping = { value = 2.0 }
[[actuator]]
name = "motor"
drives = "carriage"
input = "u_N"
gain = 1.0
[[sensor]]
name = "scale"
reads = "carriage.position"
signal = "q_m"
"#;

/// Readings of a device that nothing drives: a place, and noise.
fn resting(rig: &Rig, rows: usize, noise: f64, seed: u64) -> Recording {
    let plant = Plant::new(rig).unwrap();
    let mut random = Noise(seed);
    let t: Vec<f64> = (0..rows).map(|k| k as f64 * 0.01).collect();
    let inputs = plant.inputs().iter().map(|input| Column {
        name: input.column.clone(),
        values: vec![0.0; rows],
    });
    let mut columns: Vec<Column> = inputs.collect();
    for sensor in plant.sensors() {
        let values = (0..rows).map(|_| noise * random.normal());
        let (name, values) = (sensor.column.clone(), values.collect());
        columns.push(Column { name, values });
    }
    Recording::new("resting.csv", t, columns).unwrap()
}

/// Names of the parameters that left what the rig says, or claim to be known.
fn moved(fit: &Fit) -> Vec<String> {
    let moved = fit.parameters.iter();
    let moved = moved.filter(|p| p.value != p.as_written || p.ci95.is_some() || p.at_bound);
    moved.map(|p| format!("{} {}", p.name, p.value)).collect()
}

#[test]
fn noise_alone_moves_no_parameter_and_lacks_nothing() {
    let two_masses = Rig::load(root().join("rigs/two-mass-drive.toml")).unwrap();
    let rigs = [
        parse(&oscillator(1.0, 40.0, 1.0, "")),
        parse(PENDULUM),
        parse(CARRIAGE),
        two_masses,
    ];
    let mut wrong = Vec::new();
    for (rig, draws) in rigs.iter().zip([50, 50, 50, 10]) {
        for seed in 0..draws {
            let recording = resting(rig, 300, 1e-3, 1 + seed);
            let fit = run(rig, &[recording]);
            wrong.extend(moved(&fit).into_iter().map(|it| format!("{seed}: {it}")));
            wrong.extend(fit.sensors.iter().filter_map(unexplained));
        }
    }
    assert!(wrong.is_empty(), "{} wrong: {wrong:#?}", wrong.len());
}

/// A load that no noise of this size shows, beside parameters that the motion does show.
#[test]
fn a_parameter_that_is_lost_in_noise_keeps_its_digits() {
    let text = |load: f64| {
        let effect = "[[effect]]\nkind = \"constant_load\"\ncomponent = \"mass\"\n";
        let level = format!("{effect}level = {{ value = {load:?} }}\n");
        oscillator(1.0, 40.0, 1.0, &level)
    };
    let (truth, believed) = (parse(&text(1e-4)), parse(&text(2e-4)));
    let mut wrong = Vec::new();
    for seed in 0..50 {
        let recording = recorded(&truth, 400, 0.02, 10.0, 0.05, 11 + seed);
        let fit = run(&believed, &[recording]);
        let load = parameter(&fit, "mass.constant_load.level");
        if load.value != 2e-4 || load.ci95.is_some() {
            wrong.push(format!("{seed}: {load:?}"));
        }
        assert!(parameter(&fit, "coil.stiffness").ci95.is_some());
    }
    assert!(wrong.is_empty(), "{} wrong: {wrong:#?}", wrong.len());
}
