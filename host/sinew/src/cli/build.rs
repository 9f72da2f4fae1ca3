//! `sinew build`.

use std::path::PathBuf;

use clap::Args;

use super::{Common, Recordings, result};
use crate::pipeline::build::{Request, build};
use crate::project::{Board, Optimise};
use crate::report;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::repair::Repairs;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::report::Provenance;

/// Arguments of `sinew build`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML).
    rig: PathBuf,
    #[command(flatten)]
    recordings: Recordings,
    /// The fleet that the device is of (sinew-fleet/1): its prior, and the source of all plants.
    ///
    /// The plants that train and tune the controller, and the one of the loop, are drawn from it.
    #[arg(long, value_name = "TOML", conflicts_with = "diagnose")]
    fleet: Option<PathBuf>,
    /// Board of the controller.
    #[arg(long, value_enum, default_value = "qemu")]
    board: Board,
    /// Optimisation goal of its image.
    #[arg(long, value_enum, default_value = "speed")]
    optimise: Optimise,
    /// Folder of everything that is written.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Folder of cargo's build outputs, if they are to be shared; otherwise DIR/target.
    #[arg(long, value_name = "DIR", env = "SINEW_BUILD_DIR")]
    build_dir: Option<PathBuf>,
    /// Diagnose the rig too (as `sinew diagnose`), and make the controller for the corrected rig.
    #[arg(long)]
    diagnose: bool,
    /// The kind of effect that was concealed in the recordings, to stand beside what was found.
    #[arg(long, value_name = "KIND", requires = "diagnose")]
    hidden: Option<String>,
    /// File for the summary as JSON (sinew-demo/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    repairs: Repairs,
}

/// # Errors
/// Any link of the chain.
pub fn run(arguments: &Arguments) -> Result<()> {
    if arguments.board.chip().is_some() {
        return Err(Error::arguments(format!(
            "a {} does not run here: its loop cannot be closed by this command",
            arguments.board.name()
        ))
        .help("build for qemu, the same controller to the bit; then sinew flash"));
    }
    let Recordings { fit, test } = &arguments.recordings;
    let recordings = fit.iter().chain(test);
    // Files of the folder that a rig or a recording may be called like.
    let written = ["rig.toml", "mended.toml", "loop.csv"].map(|name| arguments.out.join(name));
    overwrite::refuse(
        std::iter::once(("RIG", arguments.rig.as_path()))
            .chain(
                arguments
                    .fleet
                    .iter()
                    .map(|path| ("--fleet", path.as_path())),
            )
            .chain(recordings.map(|path| ("a recording", path.as_path()))),
        written
            .iter()
            .map(|path| ("--out", Some(path.as_path())))
            .chain([("--json", arguments.json.as_deref())]),
    )?;
    let request = Request {
        rig: arguments.rig.clone(),
        fit: arguments.recordings.fit.clone(),
        test: arguments.recordings.test.clone(),
        fleet: arguments.fleet.clone(),
        repairs: arguments.repairs.clone(),
        board: arguments.board,
        optimise: arguments.optimise,
        out: arguments.out.clone(),
        seed: arguments.common.seed,
        cache: arguments.build_dir.clone(),
        diagnose: arguments.diagnose,
        hidden: arguments.hidden.clone(),
        quiet: arguments.common.quiet,
    };
    let outcome = build(&request)?;
    let summary = report::summary(&outcome);
    let made = Provenance::typed().seed(arguments.common.seed);
    report::write(&outcome, &summary, &arguments.out, &made)?;
    let json = arguments.json.as_deref();
    let said = Said::beside([json], arguments.common.quiet);
    said.line("");
    for line in report::closing_lines(&outcome, &summary, &arguments.out) {
        said.line(line);
    }
    said.next(format!(
        "sinew flash --board stm32f446 --model {}",
        arguments.out.join("model").display()
    ));
    let document = serde_json::to_value(&summary)
        .map_err(|error| Error::failed(format!("the summary: {error}")))?;
    result::write(json, || document)
}
