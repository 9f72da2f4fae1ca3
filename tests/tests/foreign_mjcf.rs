//! Output of `sinew mjcf` means the same to MuJoCo: `tests/foreign/mjcf.py` let MuJoCo run the
//! file, and our simulator runs the rig that the file was written from.

use std::path::PathBuf;

use sinew_ident::recording::Recording;
use sinew_sim::{Plant, Rig};

/// Error that is allowed, as a part of a signal's range. MuJoCo's dry friction and stops are a
/// little soft.
const TOLERANCE: f64 = 2e-3;

fn foreign(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("foreign/mjcf")
        .join(name)
}

/// Largest differences between MuJoCo and a rig, as parts of the signals' ranges; infinite for a
/// rig that flies away.
fn differences(rig: &Rig) -> Vec<(String, f64)> {
    let theirs = Recording::read(foreign("all.csv")).expect("the recording is committed");
    let plant = Plant::new(rig).expect("the rig compiles");
    let column = |name: &str| theirs.column(name).expect("MuJoCo recorded it");
    let inputs: Vec<&[f64]> = plant.inputs().iter().map(|i| column(&i.column)).collect();
    let signals: Vec<&[f64]> = plant.sensors().iter().map(|s| column(&s.column)).collect();
    let Ok(ours) = plant.simulate_recording(theirs.t(), &inputs, &signals) else {
        return vec![(String::new(), f64::INFINITY)];
    };
    let compare = |(index, theirs): (usize, &&[f64])| {
        let high = theirs.iter().copied().fold(f64::MIN, f64::max);
        let low = theirs.iter().copied().fold(f64::MAX, f64::min);
        let name = plant.sensors()[index].column.clone();
        assert!(high - low > 0.1, "{name} hardly moves: this tests nothing");
        let errors = theirs.iter().zip(ours.trajectory.column(index));
        let largest = errors.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        (name, largest / (high - low))
    };
    signals.iter().enumerate().map(compare).collect()
}

#[test]
fn mujoco_runs_a_written_rig_as_our_simulator_does() {
    let rig = Rig::load(foreign("all.toml")).expect("the rig is committed");
    for (signal, error) in differences(&rig) {
        println!("{signal}: {error:.1e} of the range");
        assert!(error < TOLERANCE, "{signal}: {error:.2e} of the range");
    }
}

#[test]
fn an_effect_that_was_lost_on_the_way_would_be_noticed() {
    let text = std::fs::read_to_string(foreign("all.toml")).expect("the file is committed");
    let effects = text.matches("[[effect]]").count();
    for lost in 1..=effects {
        let mut parts = text.split("[[effect]]").enumerate();
        let mut rest = parts
            .next()
            .map(|(_, head)| head.to_owned())
            .unwrap_or_default();
        let mut name = String::new();
        for (index, part) in parts {
            if index == lost {
                name = part.lines().take(3).collect::<Vec<_>>().join(" ");
            } else {
                rest += &format!("[[effect]]{part}");
            }
        }
        let rig = Rig::parse(&rest, "less.toml").expect("the rig is sound");
        let largest = differences(&rig)
            .into_iter()
            .map(|(_, e)| e)
            .fold(0.0, f64::max);
        assert!(
            largest > 2.0 * TOLERANCE,
            "without{name}: only {largest:.1e} of the range"
        );
    }
}
