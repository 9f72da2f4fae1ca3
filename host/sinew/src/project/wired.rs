//! A wiring file for the project of a model: pins and scales of its board.

use std::path::Path;

use sinew_model::spec::{ModelSpec, Signal as ModelSignal};
use sinew_wiring::{Board, Checked, Fault, Signal, Signals, SourceFile, Wiring};

use sinew_ident::error::{Error, Result};

/// Largest wiring that is read, bytes.
const LARGEST: u64 = 1 << 20;

/// Pins and scales of a controller's board from a wiring; none without one.
///
/// # Errors
/// A bad wiring, one for another board than `named`, or one that does not fit the model.
pub fn wired(
    file: Option<&Path>,
    spec: &ModelSpec,
    named: Option<&str>,
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
    remarks.iter().for_each(|remark| eprintln!("{remark}"));
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

/// Signals of a model's controller.
fn of_model(spec: &ModelSpec) -> Signals {
    let signal = |signal: &ModelSignal| Signal {
        name: signal.name.clone(),
        unit: signal.unit.clone(),
        range: None,
    };
    let sensors = spec.outputs.iter().chain(&spec.channels);
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
