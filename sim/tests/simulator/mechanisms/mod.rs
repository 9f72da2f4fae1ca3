//! Small mechanisms that several tests use, and how to run one.

use sinew_sim::{InputTrajectory, Plant, Rig, Trajectory};

pub const HEADER: &str = "format = \"sinew-rig/1\"\nname = \"test\"\n";

/// The plant of a rig that is known to be sound.
pub fn plant(tables: &str) -> Plant {
    let rig = Rig::parse(&format!("{HEADER}{tables}"), "test.toml");
    let rig = rig.unwrap_or_else(|error| panic!("{error}"));
    Plant::new(&rig).unwrap_or_else(|error| panic!("{error}"))
}

/// A slide of 1 kg that starts at `start` with `velocity`, its position and velocity read, and
/// more.
pub fn slide(start: f64, velocity: f64, more: &str) -> Plant {
    plant(&format!(
        "[[body]]\nname = \"mass\"\nmotion = \"slide\"\ninertia = {{ value = 1.0 }}\n\
         start = {{ value = {start:?} }}\nstart_velocity = {{ value = {velocity:?} }}\n\
         [[sensor]]\nname = \"x\"\nreads = \"mass.position\"\nsignal = \"q_m\"\n\
         [[sensor]]\nname = \"v\"\nreads = \"mass.velocity\"\nsignal = \"qd_m_s\"\n{more}"
    ))
}

pub const SPRING: &str = "[[spring]]\nname = \"coil\"\nfrom = \"ground\"\nto = \"mass\"\n\
                          stiffness = { value = 40.0 }\n";
pub const DAMPER: &str = "[[damper]]\nname = \"dashpot\"\nfrom = \"ground\"\nto = \"mass\"\n\
                          damping = { value = 1.2 }\n";

/// A force on `mass`, held linearly between samples.
pub const RAMP: &str = "[[actuator]]\nname = \"push\"\ndrives = \"mass\"\ninput = \"u_N\"\n\
                        hold = \"linear\"\ngain = { value = 1.0 }\n";

/// An effect at a component, its parameters as `name = value` lines.
pub fn effect(kind: &str, component: &str, parameters: &[(&str, f64)]) -> String {
    let lines = parameters
        .iter()
        .map(|(name, value)| format!("{name} = {{ value = {value:?} }}\n"));
    format!(
        "[[effect]]\nkind = \"{kind}\"\ncomponent = \"{component}\"\n{}",
        lines.collect::<String>()
    )
}

/// Sample times from 0.
pub fn times(count: usize, interval: f64) -> Vec<f64> {
    (0..count).map(|k| k as f64 * interval).collect()
}

/// Simulates from the start that the rig gives.
pub fn run(plant: &Plant, times: &[f64], columns: &[&[f64]]) -> Trajectory<f64> {
    run_with(plant, &plant.values(), times, columns)
}

/// Simulates with other parameter values, from the start that they give.
pub fn run_with(
    plant: &Plant,
    values: &[f64],
    times: &[f64],
    columns: &[&[f64]],
) -> Trajectory<f64> {
    let none = vec![None; plant.sensors().len()];
    let start = plant.initial_state(values, &none).unwrap();
    let drive = InputTrajectory::new(plant, times.len(), columns).unwrap();
    plant.simulate(values, &start, &drive, times).unwrap()
}

/// The largest difference between two columns.
pub fn distance(a: &[f64], b: impl IntoIterator<Item = f64>) -> f64 {
    let mut count = 0;
    let pairs = a.iter().zip(b).inspect(|_| count += 1);
    let distance = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert_eq!(count, a.len(), "columns of different length");
    distance
}
