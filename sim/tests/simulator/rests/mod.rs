//! Static equilibrium: closed forms, its derivatives, the same rest as a long simulation.

mod closed_forms;
mod derivatives;
mod intervals;
mod refusals;
mod simulated;

use sinew_sim::{Plant, Rest, Rig};

/// Rest from the origin with the rig's own values.
fn rest(plant: &Plant, inputs: &[f64]) -> Rest<f64> {
    let start = vec![0.0; plant.state_len()];
    plant
        .rest(&plant.values(), inputs, &start)
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Rigs of the repository that commands can drive, by name.
fn shipped() -> Vec<(String, Plant)> {
    let root = std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../rigs");
    let mut rigs = Vec::new();
    for folder in ["", "recorded", "experiments"] {
        for entry in std::fs::read_dir(root.join(folder)).expect("a folder of rigs") {
            let path = entry.expect("an entry of the folder").path();
            if path.extension().is_none_or(|extension| extension != "toml") {
                continue;
            }
            let text = std::fs::read_to_string(&path).expect("a rig file");
            let name = path.strip_prefix(&root).expect("below the folder of rigs");
            let name = name.display().to_string();
            if let Ok(rig) = Rig::parse(&text, &name) {
                let plant = Plant::new(&rig).expect("a sound rig");
                if plant.only_recordings().is_none() {
                    rigs.push((name, plant));
                }
            }
        }
    }
    rigs.sort_by(|a, b| a.0.cmp(&b.0));
    assert!(rigs.len() >= 10, "{} rigs", rigs.len());
    rigs
}

/// Inputs within the limits, or within 1 of zero where there are none, from a fixed sequence.
fn drawn(plant: &Plant, seed: &mut u64) -> Vec<f64> {
    let inputs = plant.inputs().iter();
    inputs
        .map(|input| {
            *seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            let share = (*seed >> 11) as f64 / (1u64 << 53) as f64;
            let (low, high) = input.limit.unwrap_or((-1.0, 1.0));
            low + share * (high - low)
        })
        .collect()
}
