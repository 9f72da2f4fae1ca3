//! Recordings by other people's physics, in `tests/foreign/`.

use std::path::PathBuf;

use sinew_sim::{InputTrajectory, Plant, Rig};

/// Path of a file or folder of `tests/foreign`.
pub fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../tests/foreign")
        .join(name)
}

/// Text of a file of `tests/foreign`.
///
/// # Panics
/// It cannot be read.
pub fn text(name: &str) -> String {
    let path = path(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A recording without gaps: its columns by name, in their order.
pub struct Columns {
    names: Vec<String>,
    values: Vec<Vec<f64>>,
}

impl Columns {
    /// Reads one.
    ///
    /// # Panics
    /// It is not there, or is not a table of numbers.
    pub fn read(name: &str) -> Self {
        let text = text(name);
        let mut lines = text.lines().skip_while(|line| line.starts_with('#'));
        let header = lines.next().expect("a line of names");
        let names: Vec<String> = header.split(',').map(str::to_string).collect();
        let mut values = vec![Vec::new(); names.len()];
        for line in lines {
            for (column, field) in values.iter_mut().zip(line.split(',')) {
                column.push(field.parse().expect("the recording holds numbers"));
            }
        }
        Self { names, values }
    }

    /// One column.
    ///
    /// # Panics
    /// There is none of this name.
    pub fn get(&self, name: &str) -> &[f64] {
        let at = self.names.iter().position(|n| n == name);
        &self.values[at.unwrap_or_else(|| panic!("there is no column {name}"))]
    }
}

/// Highest less lowest.
pub fn range(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::MIN, f64::max)
        - values.iter().copied().fold(f64::MAX, f64::min)
}

/// A rig of `tests/foreign`.
///
/// # Panics
/// It is not sound.
pub fn rig(name: &str) -> Rig {
    Rig::parse(&text(name), name).unwrap_or_else(|error| panic!("{error}"))
}

/// Largest difference of a simulation from a recording, over the range of the motion, of all
/// signals; the rig starts at rest at 0. One parameter may be scaled.
///
/// # Panics
/// The rig cannot be simulated, or a signal hardly moves.
pub fn error(folder: &str, device: &str, scaled: Option<(&str, f64)>) -> f64 {
    let plant = Plant::new(&rig(&format!("{folder}/{device}.toml")))
        .unwrap_or_else(|error| panic!("{device}: {error}"));
    let recording = Columns::read(&format!("{folder}/{device}.csv"));
    let t = recording.get("t");
    let inputs: Vec<&[f64]> = (plant.inputs().iter())
        .map(|input| recording.get(&input.column))
        .collect();
    let drive = InputTrajectory::new(&plant, t.len(), &inputs).expect("every input is there");
    let mut values = plant.values();
    if let Some((name, factor)) = scaled {
        let slot = plant.slot(name);
        values[slot.unwrap_or_else(|| panic!("{device} has no parameter {name}"))] *= factor;
    }
    let start = plant
        .initial_state(&values, &vec![Some(0.0); plant.sensors().len()])
        .expect("the plant starts at rest");
    let run = plant
        .simulate(&values, &start, &drive, t)
        .unwrap_or_else(|error| panic!("{device}: {error}"));
    let mut worst: f64 = 0.0;
    for (sensor, channel) in plant.sensors().iter().enumerate() {
        let theirs = recording.get(&channel.column);
        let range = range(theirs);
        assert!(range > 0.0, "{device}: {} does not move", channel.column);
        for (ours, theirs) in run.column(sensor).iter().zip(theirs) {
            worst = worst.max((ours - theirs).abs() / range);
        }
    }
    worst
}
