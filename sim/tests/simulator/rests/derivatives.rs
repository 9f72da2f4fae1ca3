use super::{drawn, shipped};
use crate::foreign::recording;
use sinew_sim::{Dual, Plant, Rig, Scalar};

/// Largest error of a derivative beside the largest of its sensor, against central differences.
fn worst(plant: &Plant, inputs: &[f64]) -> Option<f64> {
    let values = plant.values();
    let zero = vec![0.0; plant.state_len()];
    let start = plant.rest(&values, inputs, &zero).ok()?.state;
    let unknowns = [values.as_slice(), inputs].concat();
    let at = |index: usize, step: f64| {
        let mut moved = unknowns.clone();
        moved[index] += step;
        let (values, inputs) = moved.split_at(values.len());
        plant.rest(values, inputs, &start).map(|rest| rest.signals)
    };
    let mut worst = 0.0f64;
    for index in 0..unknowns.len() {
        let seeded: Vec<Dual<4>> = (unknowns.iter().enumerate())
            .map(|(k, &x)| {
                if k == index {
                    Dual::variable(x, 0)
                } else {
                    Dual::constant(x)
                }
            })
            .collect();
        let (seeded_values, seeded_inputs) = seeded.split_at(values.len());
        let rest = plant.rest(seeded_values, seeded_inputs, &start).unwrap();
        let size = match unknowns[index] {
            0.0 => 1.0,
            value => value.abs(),
        };
        let step = size * if unknowns[index] == 0.0 { 1e-5 } else { 1e-3 };
        // Richardson's extrapolation of two central differences.
        let slopes = |step: f64| -> Option<Vec<f64>> {
            let (above, below) = (at(index, step).ok()?, at(index, -step).ok()?);
            Some(
                above
                    .iter()
                    .zip(below)
                    .map(|(a, b)| (a - b) / (2.0 * step))
                    .collect(),
            )
        };
        let (Some(wide), Some(narrow)) = (slopes(step), slopes(0.5 * step)) else {
            continue;
        };
        for (sensor, signal) in rest.signals.iter().enumerate() {
            let exact = (4.0 * narrow[sensor] - wide[sensor]) / 3.0;
            // Changes of a signal that are rounding beside the signal itself do not count.
            let least = 1e-4 * signal.value.abs() + 1e-9;
            let error = (signal.derivative[0] - exact).abs() * size;
            worst = worst.max(error / (exact.abs() * size).max(least));
        }
    }
    Some(worst)
}

#[test]
fn derivatives_of_rests_are_those_of_differences() {
    let (mut seed, mut checked) = (7, 0);
    for (name, plant) in shipped() {
        let inputs = drawn(&plant, &mut seed);
        if let Some(worst) = worst(&plant, &inputs) {
            println!("{name}: {worst:.1e}");
            // A pouch's own derivatives are those of its curve within 1e-6 of its angle
            // (geometry/zip.rs), which the small readings of far magnets enlarge.
            let tolerance = if name == "hasel.toml" { 1e-5 } else { 1e-6 };
            assert!(worst < tolerance, "{name}: {worst:e}");
            checked += 1;
        }
    }
    assert!(checked >= 6, "{checked} rigs");
}

#[test]
fn derivatives_hold_for_every_law_that_has_a_rest() {
    let mut checked = 0;
    let (mut seed, folder) = (11, recording::path("laws"));
    for entry in std::fs::read_dir(folder).expect("the folder of laws") {
        let path = entry.expect("an entry of the folder").path();
        if path
            .extension()
            .is_some_and(|extension| extension == "toml")
        {
            let text = std::fs::read_to_string(&path).expect("a rig file");
            let rig = Rig::parse(&text, "law.toml").unwrap_or_else(|error| panic!("{error}"));
            let plant = Plant::new(&rig).expect("a sound rig");
            let inputs = drawn(&plant, &mut seed);
            if plant.only_recordings().is_none()
                && let Some(worst) = worst(&plant, &inputs)
            {
                println!("{}: {worst:.1e}", path.display());
                assert!(worst < 1e-6, "{}: {worst:e}", path.display());
                checked += 1;
            }
        }
    }
    assert!(checked >= 10, "{checked} laws");
}
