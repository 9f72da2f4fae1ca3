//! A wiring file for the project of a model: pins and scales of its board.

use std::path::Path;

use sinew_model::spec::{ModelSpec, Signal as ModelSignal};
use sinew_sim::rig::Reads;
use sinew_sim::{Plant, Rig};
use sinew_wiring::{Board, Checked, Fault, Signal, Signals, SourceFile, Wiring};

use sinew_ident::error::{Error, Result};

use crate::rig_file::{self, ControlTable};

/// Control rate where the rig names none, in hertz.
const RATE_HZ: f64 = 120.0;
/// Largest wiring that is read, bytes.
const LARGEST: u64 = 1 << 20;

/// Pins and scales of a controller's board from a wiring; none without one.
///
/// Remarks of its check go to standard error unless `quiet`.
///
/// # Errors
/// A bad wiring, one for another board than `named`, or one that does not fit the model.
pub fn wired(
    file: Option<&Path>,
    spec: &ModelSpec,
    named: Option<&str>,
    quiet: bool,
) -> Result<Vec<SourceFile>> {
    let Some(file) = file else {
        return Ok(Vec::new());
    };
    let (wiring, board) = read(file)?;
    if let Some(named) = named.filter(|named| *named != board.name) {
        return Err(
            Error::file(file, format!("it is for {}, not for {named}", board.name))
                .at(wiring.board_line, 1)
                .help(format!("--board {}", board.name)),
        );
    }
    let signals = of_model(spec);
    let Checked { faults, remarks } = sinew_wiring::check(&wiring, &signals, board);
    if !faults.is_empty() {
        return Err(refused(Some(file), &faults));
    }
    if !quiet {
        remarks.iter().for_each(|remark| eprintln!("{remark}"));
    }
    Ok(sinew_wiring::sources(&wiring, &signals, board).into())
}

/// A wiring and its board.
///
/// # Errors
/// A file that does not read, or a board that cannot be wired.
pub fn read(file: &Path) -> Result<(Wiring, &'static Board)> {
    let bytes = sinew_files::read(file, LARGEST)?;
    let text = String::from_utf8(bytes).map_err(|error| {
        Error::file(file, "it is not text").help(format!("UTF-8 is expected: {error}"))
    })?;
    let wiring = Wiring::parse(&text).map_err(|fault| refused(Some(file), &[fault]))?;
    let board = sinew_wiring::board(&wiring.board)
        .map_err(|message| Error::file(file, message).at(wiring.board_line, 1))?;
    Ok((wiring, board))
}

/// Faults as one error, a line each.
pub fn refused(file: Option<&Path>, faults: &[Fault]) -> Error {
    let one = |fault: &Fault| match (file, fault.line) {
        (Some(file), Some(line)) => format!(
            "{}:{line}: {}\n  expected: {}",
            file.display(),
            fault.message,
            fault.expected
        ),
        _ => format!("{}\n  expected: {}", fault.message, fault.expected),
    };
    Error::arguments(faults.iter().map(one).collect::<Vec<_>>().join("\n"))
}

/// Signals of the controller that a rig asks for: no outputs where `sensed_by` names the sensors
/// that say them.
///
/// # Errors
/// A rig that cannot be simulated, or whose control tables do not read.
pub fn of_rig(rig: &Rig) -> Result<Signals> {
    let plant = Plant::new(rig)?;
    let control = ControlTable::read(rig)?;
    let positions = || {
        let sensors = 0..rig.sensors.len();
        sensors
            .filter(|k| matches!(rig.sensors[*k].reads, Reads::Position(_)))
            .collect()
    };
    let channels = rig_file::network_table(rig)?.map(|network| network.channels);
    let channels = channels.unwrap_or_default();
    let sensors = match &control {
        Some(control) if !control.sensed_by.is_empty() => control.sensed_by.clone(),
        Some(control) => [&control.outputs[..], &channels].concat(),
        None => [positions(), channels].concat(),
    };
    Ok(Signals {
        sensors: sensors
            .into_iter()
            .map(|k| {
                let sensor = &plant.sensors()[k];
                Signal {
                    name: sensor.column.clone(),
                    unit: sensor.unit.clone(),
                    range: None,
                }
            })
            .collect(),
        actuators: plant
            .inputs()
            .iter()
            .map(|input| Signal {
                name: input.column.clone(),
                unit: input.unit().into(),
                range: input.limit.map(|(low, high)| [low, high]),
            })
            .collect(),
        rate_hz: control.and_then(|c| c.rate_hz).unwrap_or(RATE_HZ),
    })
}

/// Signals of a model's controller.
fn of_model(spec: &ModelSpec) -> Signals {
    let signal = |signal: &ModelSignal| Signal {
        name: signal.name.clone(),
        unit: signal.unit.clone(),
        range: None,
    };
    let outputs = match spec.soft_sensor {
        None => &spec.outputs[..],
        Some(_) => &[],
    };
    let sensors = outputs.iter().chain(&spec.channels);
    let limits = spec.control.lower.iter().zip(&spec.control.upper);
    Signals {
        sensors: sensors.map(signal).collect(),
        actuators: spec
            .inputs
            .iter()
            .zip(limits)
            .map(|(input, (low, high))| Signal {
                range: Some([*low, *high]).filter(|ends| ends.iter().all(|end| end.is_finite())),
                ..signal(input)
            })
            .collect(),
        rate_hz: 1.0 / spec.period_s,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_model::spec::SoftSensorSpec;

    fn names(signals: &Signals) -> Vec<&str> {
        let each = signals.sensors.iter();
        each.map(|signal| signal.name.as_str()).collect()
    }

    #[test]
    fn outputs_that_channels_say_need_no_wire() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let text = std::fs::read_to_string(root.join("rigs/tendon.toml")).expect("the rig ships");
        let read = |text: &str| of_rig(&Rig::parse(text, "tendon.toml").expect("the rig is sound"));
        let seen = read(&text).expect("the rig has signals");
        assert_eq!(names(&seen), ["x_m", "y_m", "z_m"]);
        let blind = "[control]\nsensed_by = [\"light_2\", \"light_5\", \"light_8\"]";
        let blind = read(&text.replace("[control]", blind)).expect("the rig has signals");
        assert_eq!(names(&blind), ["light2_1", "light5_1", "light8_1"]);

        let folder = root.join("models/reference-s");
        let mut spec = sinew_model::store::load(&folder).expect("the model is committed");
        assert_eq!(names(&of_model(&spec)), ["y1", "y2", "y3"]);
        spec.channels = spec.inputs.clone();
        spec.soft_sensor = Some(SoftSensorSpec {
            error: vec![1e-3; 3],
            bias: vec![0.0; 3],
            linear: vec![0.1; 6],
            quadratic: vec![0.1; 9],
            watch: None,
        });
        assert_eq!(names(&of_model(&spec)), ["u1", "u2"]);
    }
}
