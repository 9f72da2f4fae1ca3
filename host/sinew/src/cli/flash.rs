//! `sinew flash`: build the firmware for a board, write it into its flash, show its log.

use std::path::{Path, PathBuf};

use clap::Args;
use sinew_model::store;

use super::result;
use crate::flash::{Options, chip, document, flash, list, listed, ready};
use crate::project::{self, Board, Optimise, image};
use sinew_ident::cli::overwrite;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};

/// Arguments of `sinew flash`.
#[derive(Args)]
pub struct Arguments {
    /// The board.
    #[arg(long, value_enum, required_unless_present = "list")]
    board: Option<Board>,
    /// Folder of the model: model.toml and weights.safetensors.
    #[arg(long, value_name = "DIR", required_unless_present = "list")]
    model: Option<PathBuf>,
    /// Folder of the firmware's sources and images; otherwise target/flash.
    #[arg(long, value_name = "DIR", default_value = "target/flash")]
    out: PathBuf,
    /// Folder of cargo's build outputs, if they are to be shared; otherwise OUT/target.
    #[arg(long, value_name = "DIR", env = "SINEW_BUILD_DIR")]
    build_dir: Option<PathBuf>,
    /// Optimisation goal of the image.
    #[arg(long, value_enum, default_value = "speed")]
    optimise: Optimise,
    /// Wiring of the board, as `sinew wire` writes it.
    #[arg(long, value_name = "TOML")]
    wiring: Option<PathBuf>,
    /// Only list the debug probes that are connected.
    #[arg(long)]
    list: bool,
    /// The probe with this serial number.
    #[arg(long, value_name = "SERIAL")]
    select: Option<String>,
    /// Erase a locked chip, all of it, and unlock it.
    #[arg(long)]
    unlock: bool,
    /// Do not stay to show the board's log.
    #[arg(long)]
    no_log: bool,
    /// File for the image or the probes as JSON (sinew-flash/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// # Errors
/// A bad model, firmware that does not build, and whatever stands between it and the board.
pub fn run(arguments: &Arguments) -> Result<()> {
    let json = arguments.json.as_deref();
    let none: [(&str, &Path); 0] = [];
    overwrite::refuse(none, [("--json", json)])?;
    let (Some(board), Some(model)) = (arguments.board, &arguments.model) else {
        let probes = list()?;
        if json.is_some_and(sinew_files::is_output) {
            return result::write(json, || listed(&probes));
        }
        let said = Said::beside([], arguments.quiet);
        if probes.is_empty() {
            said.line("no debug probe is connected");
        }
        probes.iter().for_each(|probe| said.line(probe));
        said.next("sinew flash --board BOARD --model DIR");
        return result::write(json, || listed(&probes));
    };
    let chip = chip(board)?;
    ready()?;
    let spec = store::load(model).map_err(Error::refused)?;
    let (wiring, folder) = (arguments.wiring.as_deref(), Some(board.folder()));
    let wired = project::wired::wired(wiring, &spec, folder, arguments.quiet)?;
    let kept = project::write_wired(&arguments.out, &spec, arguments.optimise, &wired)?;
    eprint!("{}", project::kept(&kept));
    let cache = arguments.build_dir.as_deref();
    let built = project::build_shown(&arguments.out, board, cache, arguments.quiet)?;
    let options = Options {
        select: arguments.select.clone(),
        unlock: arguments.unlock,
        no_log: arguments.no_log,
        quiet: arguments.quiet,
        aside: json.is_some_and(sinew_files::is_output),
    };
    let sizes = image::sizes(&built.lockstep)?;
    let mut written = Ok(());
    // Before the log, which goes on until Ctrl-C.
    let mut then = || {
        written = result::write(json, || document(board, chip, &built.lockstep, sizes));
        Said::beside([json], arguments.quiet).next(format!(
            "sinew monitor --port PORT --model {}",
            model.display()
        ));
    };
    flash(chip, &built.lockstep, &options, &mut then)?;
    written
}
