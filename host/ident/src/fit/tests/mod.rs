//! Parameters that a fit must find, and claims that it must not make. The recordings of the mass on
//! a spring are foreign (`tests/foreign/mass_spring_damper.py`); the others are simulated, with
//! noise.

use std::path::PathBuf;

use sinew_sim::InputTrajectory;

use super::segment::{Problem, Segment};
use super::*;
use crate::recording::Column;

mod at_rest;
mod bounds;
mod claims;
mod imposed;
mod local;
mod recovered;
mod search;
mod second_start;
mod starts;
mod statics;
mod unread;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn parse(text: &str) -> Rig {
    Rig::parse(
        &format!("format = \"sinew-rig/1\"\nname = \"test\"\n{text}"),
        "test.toml",
    )
    .unwrap()
}

fn run(rig: &Rig, recordings: &[Recording]) -> Fit {
    fit(rig, recordings, &FitOptions::default(), &mut |_| {}).unwrap()
}

fn parameter<'a>(fit: &'a Fit, name: &str) -> &'a FittedParameter {
    fit.parameters
        .iter()
        .find(|parameter| parameter.name == name)
        .unwrap()
}

/// Standard normal numbers: Box and Muller on a multiplicative congruence.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// A recording of a rig driven by random steps, with noise of this part of each signal's spread.
fn recorded(rig: &Rig, rows: usize, interval: f64, push: f64, noise: f64, seed: u64) -> Recording {
    let plant = Plant::new(rig).unwrap();
    let mut random = Noise(seed);
    let t: Vec<f64> = (0..rows).map(|k| k as f64 * interval).collect();
    let mut level = 0.0;
    let u: Vec<f64> = (0..rows)
        .map(|k| {
            if k % 37 == 0 {
                level = push * (2.0 * random.uniform() - 1.0);
            }
            level
        })
        .collect();
    let inputs: Vec<&[f64]> = plant.inputs().iter().map(|_| u.as_slice()).collect();
    let drive = InputTrajectory::new(&plant, rows, &inputs).unwrap();
    let start = vec![0.0; plant.state_len()];
    let run = plant.simulate(&plant.values(), &start, &drive, &t).unwrap();
    let mut columns: Vec<Column> = plant
        .inputs()
        .iter()
        .map(|input| Column {
            name: input.column.clone(),
            values: u.clone(),
        })
        .collect();
    for (index, sensor) in plant.sensors().iter().enumerate() {
        let clean = run.column(index);
        let mean = clean.iter().sum::<f64>() / rows as f64;
        let spread = (clean.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / rows as f64).sqrt();
        let values = clean
            .iter()
            .map(|y| y + noise * spread * random.normal())
            .collect();
        columns.push(Column {
            name: sensor.column.clone(),
            values,
        });
    }
    Recording::new("simulated.csv", t, columns).unwrap()
}

/// A mass on a spring and a damper; `free` marks which parameters are believed rather than known.
fn oscillator(inertia: f64, stiffness: f64, damping: f64, extra: &str) -> String {
    format!(
        r#"
[[body]]
name = "mass"
motion = "slide"
inertia = {{ value = {inertia:?} }}
[[spring]]
name = "coil"
from = "ground"
to = "mass"
stiffness = {{ value = {stiffness:?} }}
[[damper]]
name = "dashpot"
from = "ground"
to = "mass"
damping = {{ value = {damping:?} }}
[[actuator]]
name = "push"
drives = "mass"
input = "u_N"
gain = 1.0
[[sensor]]
name = "encoder"
reads = "mass.position"
signal = "q_m"
{extra}"#
    )
}

const FRICTION: &str =
    "[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"mass\"\nlevel = { value = 0.0 }\n";

fn foreign() -> (Recording, Recording) {
    let read = |name| Recording::read(root().join("rigs").join(name)).unwrap();
    (
        read("mass-spring-damper.fit.csv"),
        read("mass-spring-damper.test.csv"),
    )
}
