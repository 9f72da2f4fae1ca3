//! A rig file as the program reads it: the plant, and the controller and network that it asks for.

mod control_table;
#[cfg(test)]
mod tests;

use std::path::Path;

pub use control_table::{ControlTable, TerminalTable};
use sinew_sim::{Error, Rig};
use sinew_train::NetworkTable;

/// Reads a rig file, its `[control]` and `[network]` tables included.
///
/// # Errors
/// The file cannot be read, or the first thing in it that is wrong, with its line and column.
pub fn load(path: impl AsRef<Path>) -> Result<Rig, Error> {
    let path = path.as_ref();
    checked(Rig::load(path).map_err(|error| recording_for_rig(path, error))?)
}

/// The error of a recording that stands where a rig was expected, with a hint.
fn recording_for_rig(path: &Path, error: Error) -> Error {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    match lines.next() {
        Some(header) if header.starts_with("t,") => Error {
            help: Some(
                "this looks like a recording (CSV); the rig file comes first, recordings follow \
                 a flag such as --fit"
                    .into(),
            ),
            ..error
        },
        _ => error,
    }
}

/// Understands the text of a rig file, its `[control]` and `[network]` tables included.
///
/// # Errors
/// The first thing that is wrong, with its line and column.
pub fn parse(text: &str, file: &str) -> Result<Rig, Error> {
    checked(Rig::parse(text, file)?)
}

/// Checks `[control]` and `[network]` of a rig file for a verb that does not read them. A file that
/// is no rig passes: the verb says so itself.
///
/// # Errors
/// The first thing in the two tables that is wrong, with its line and column.
pub fn check(path: impl AsRef<Path>) -> Result<(), Error> {
    let path = path.as_ref();
    match Rig::load(path) {
        Ok(rig) => checked(rig).map(|_| ()),
        Err(error) => {
            let hinted = recording_for_rig(path, error.clone());
            if hinted == error { Ok(()) } else { Err(hinted) }
        }
    }
}

fn checked(rig: Rig) -> Result<Rig, Error> {
    network_table(&rig)?;
    Ok(rig)
}

/// The `[network]` table of a rig, if there is one.
///
/// # Errors
/// The first thing in it or in `[control]` that is wrong, with its line and column.
pub fn network_table(rig: &Rig) -> Result<Option<NetworkTable>, Error> {
    let outputs = ControlTable::read(rig)?.map_or_else(Vec::new, |control| control.outputs);
    NetworkTable::read(rig, &outputs)
}
