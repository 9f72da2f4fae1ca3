//! `sinew record`: play an excitation on a board and write what its sensors said.

use std::path::PathBuf;

use clap::Args;

use super::{LiveArguments, result};
use crate::live::record::{excitation, record};
use sinew_ident::cli::overwrite;
use sinew_ident::cli::repair::read_recording;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};

/// Arguments of `sinew record`.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    live: LiveArguments,
    /// The excitation: a CSV with a column for each of the model's inputs.
    #[arg(long, value_name = "CSV")]
    input: PathBuf,
    /// File for the recording (CSV); `-` is standard output.
    #[arg(long, value_name = "CSV")]
    out: PathBuf,
    /// File for the figures as JSON (sinew-record/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// # Errors
/// A bad file, a board that cannot be reached or is the wrong one, one that stopped by itself.
pub fn run(arguments: &Arguments) -> Result<()> {
    overwrite::refuse(
        [("--input", arguments.input.as_path())],
        [
            ("--out", Some(arguments.out.as_path())),
            ("--json", arguments.json.as_deref()),
        ],
    )?;
    let json = arguments.json.as_deref();
    let input = read_recording(&arguments.input, arguments.quiet)?;
    let names = arguments.live.names(true)?;
    let (mut device, identity) = arguments.live.connect(&names)?;
    let rows = excitation(&input, &names, identity.rate_mhz)?;
    let recorded = record(&mut device, &names, &rows, &arguments.out, arguments.quiet)?;
    let model = names.learned.model_line();
    let text = format!("{model}\n{}", recorded.recording.to_csv());
    sinew_files::write(&arguments.out, text)?;
    result::write(json, || recorded.document(&arguments.out, rows.len()))?;
    let said = Said::beside([Some(arguments.out.as_path()), json], arguments.quiet);
    said.line(format!(
        "{} rows; {} ticks lost on the way, {} samples missing, {} commands held for want of a \
         row, {} changed by the limits",
        recorded.recording.len(),
        recorded.lost_ticks,
        recorded.missing_samples,
        recorded.held_ticks,
        recorded.limited_rows
    ));
    said.wrote(&arguments.out);
    if recorded.ended.is_none() {
        said.next(format!("sinew check {}", arguments.out.display()));
    }
    match recorded.ended {
        None => Ok(()),
        Some(state) => Err(Error::failed(format!(
            "the board stopped by itself ({:?}) after {} of {} rows; what came before is in the file",
            state.cause,
            recorded.recording.len(),
            rows.len()
        ))
        .help("docs/reference/faults.md says what this means")),
    }
}
