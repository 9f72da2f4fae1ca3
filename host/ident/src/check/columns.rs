//! Columns of a recording by their part: inputs and sensors.

use sinew_sim::Rig;

use crate::recording::Recording;

/// Names of the columns that drive the device and of those that show it.
pub(super) struct Columns {
    /// Columns of actuators.
    pub inputs: Vec<String>,
    /// Columns of sensors.
    pub sensors: Vec<String>,
}

impl Columns {
    /// The columns that a rig names; without a rig all of them, the inputs told by their names.
    pub(super) fn of(recording: &Recording, rig: Option<&Rig>) -> Self {
        let present = |name: &String| recording.column(name).is_some();
        match rig {
            Some(rig) => {
                let mut inputs: Vec<String> =
                    rig.actuators.iter().map(|a| a.input.clone()).collect();
                inputs.sort();
                inputs.dedup();
                inputs.retain(present);
                let sensors = rig.sensors.iter().map(|sensor| sensor.signal.clone());
                let sensors = sensors.filter(present).collect();
                Self { inputs, sensors }
            }
            None => {
                let names = recording.columns().iter().map(|column| column.name.clone());
                let (inputs, sensors) = names.partition(|name| is_commanded(name));
                Self { inputs, sensors }
            }
        }
    }
}

/// A command or a reference by its name: `u_V`, `cmd_A`, `qref_m`.
fn is_commanded(column: &str) -> bool {
    let name = column.to_lowercase();
    let after_u = name.strip_prefix('u');
    let after_u = after_u.map(|rest| rest.trim_start_matches(|c: char| c.is_ascii_digit()));
    after_u.is_some_and(|rest| rest.starts_with('_'))
        || ["cmd", "command", "input", "control"]
            .iter()
            .any(|word| name.starts_with(word))
        || [
            "ref", "target", "setpoint", "desired", "goal", "tau", "pwm", "_on", "pulse",
        ]
        .iter()
        .any(|word| name.contains(word))
}
