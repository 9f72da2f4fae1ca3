//! `sinew wire`: a rig's sensors and actuators to the pins of a board.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::{Value, json};
use sinew_wiring::{Board, Checked, Signals, Wiring};

use super::result;
use crate::project::wired::{of_rig, read, refused};
use crate::rig_file;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};

/// Arguments of `sinew wire`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML).
    rig: PathBuf,
    /// Board of a first wiring: stm32f446 or nrf52840.
    #[arg(long, required_unless_present = "check", conflicts_with = "check")]
    board: Option<String>,
    /// A wiring to check and to show, in the place of a first one.
    #[arg(long, value_name = "TOML")]
    check: Option<PathBuf>,
    /// File of the first wiring; by default beside the rig, as NAME.wiring.toml.
    #[arg(long, value_name = "TOML", conflicts_with = "check")]
    out: Option<PathBuf>,
    /// Replace a wiring that is there already.
    #[arg(long, conflicts_with = "check")]
    force: bool,
    /// Draw the wiring.
    #[arg(long, value_name = "SVG")]
    picture: Option<PathBuf>,
    /// File for pins and remarks as JSON (sinew-wire/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// # Errors
/// A bad rig, a board that cannot be wired, a wiring with faults: all of them at once.
pub fn run(arguments: &Arguments) -> Result<()> {
    let rig = rig_file::load(&arguments.rig)?;
    let signals = of_rig(&rig)?;
    match &arguments.check {
        Some(file) => checked(arguments, file, &signals),
        None => first(arguments, &signals),
    }
}

/// Writes a first wiring.
fn first(arguments: &Arguments, signals: &Signals) -> Result<()> {
    let name = arguments.board.as_deref().unwrap_or_default();
    let board = sinew_wiring::board(name).map_err(Error::arguments)?;
    let beside = || arguments.rig.with_extension("wiring.toml");
    let out = arguments.out.clone().unwrap_or_else(beside);
    overwrite::refuse(
        [("RIG", arguments.rig.as_path())],
        [
            ("--out", Some(out.as_path())),
            ("--picture", arguments.picture.as_deref()),
            ("--json", arguments.json.as_deref()),
        ],
    )?;
    if !arguments.force && out.is_file() {
        return Err(
            Error::arguments(format!("{} is there already", out.display()))
                .help("--force replaces it; --check looks at it"),
        );
    }
    let text = sinew_wiring::propose(signals, board).map_err(|fault| refused(None, &[fault]))?;
    let wiring = Wiring::parse(&text).map_err(|fault| refused(None, &[fault]))?;
    if let Some(path) = &arguments.picture {
        sinew_files::write(path, sinew_wiring::picture(&wiring, board))?;
    }
    sinew_files::write(&out, &text)?;
    let json = arguments.json.as_deref();
    let said = Said::beside(
        [Some(out.as_path()), arguments.picture.as_deref(), json],
        arguments.quiet,
    );
    said.wrote(&out);
    arguments.picture.iter().for_each(|path| said.wrote(path));
    let file = if sinew_files::is_output(&out) {
        "FILE".into()
    } else {
        out.display().to_string()
    };
    said.next(format!(
        "fill in what is nan, then sinew wire {} --check {file}",
        arguments.rig.display()
    ));
    result::write(json, || document(&wiring, board, &[]))
}

/// Checks a wiring; shows its table.
fn checked(arguments: &Arguments, file: &Path, signals: &Signals) -> Result<()> {
    overwrite::refuse(
        [("RIG", arguments.rig.as_path()), ("--check", file)],
        [
            ("--picture", arguments.picture.as_deref()),
            ("--json", arguments.json.as_deref()),
        ],
    )?;
    let (wiring, board) = read(file)?;
    let Checked { faults, remarks } = sinew_wiring::check(&wiring, signals, board);
    if !faults.is_empty() {
        return Err(refused(Some(file), &faults));
    }
    let json = arguments.json.as_deref();
    let said = Said::beside([arguments.picture.as_deref(), json], arguments.quiet);
    said.line(sinew_wiring::table(&wiring, board).trim_end());
    remarks.iter().for_each(|remark| said.line(remark));
    if let Some(path) = &arguments.picture {
        sinew_files::write(path, sinew_wiring::picture(&wiring, board))?;
        said.wrote(path);
    }
    said.next(format!(
        "sinew flash --board {} --model DIR --wiring {}",
        board.name,
        file.display()
    ));
    result::write(json, || document(&wiring, board, &remarks))
}

/// `sinew-wire/1`: every signal with its pins, and where they are on the board.
fn document(wiring: &Wiring, board: &Board, remarks: &[String]) -> Value {
    let sensors = wiring.sensors.iter().map(|w| (w.column.as_str(), w.pins()));
    let actuators = wiring
        .actuators
        .iter()
        .map(|w| (w.input.as_str(), w.pins()));
    let pins = sensors.chain(actuators).flat_map(|(signal, pins)| {
        pins.into_iter().map(move |pin| {
            let place = board.pin(pin).map_or("", |pin| pin.place);
            json!({ "signal": signal, "pin": pin, "place": place })
        })
    });
    json!({
        "format": "sinew-wire/1",
        "board": board.name,
        "pins": pins.collect::<Vec<_>>(),
        "remarks": remarks,
    })
}
