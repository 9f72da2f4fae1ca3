//! `sinew mjcf`: a rig for MuJoCo.

use std::path::{Path, PathBuf};

use clap::Args;
use sinew_sim::Rig;

use super::overwrite;
use super::said::Said;
use crate::error::Result;
use crate::mechanism::changes;
use crate::mjcf::mjcf;

/// Arguments of `sinew mjcf`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML).
    pub rig: PathBuf,
    /// File for MuJoCo.
    #[arg(long, value_name = "XML")]
    out: PathBuf,
    /// MJCF of your own that the rig came from: what to change in it is listed beside --out.
    #[arg(long, value_name = "XML")]
    changes: Option<PathBuf>,
    /// Say nothing of what MuJoCo cannot carry; the file says it.
    #[arg(long)]
    quiet: bool,
}

/// # Errors
/// A bad rig, or a file that cannot be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    overwrite::refuse(
        [
            ("the rig", arguments.rig.as_path()),
            (
                "--changes",
                arguments.changes.as_deref().unwrap_or(&arguments.rig),
            ),
        ],
        [("--out", Some(arguments.out.as_path()))],
    )?;
    let rig = Rig::load(&arguments.rig)?;
    write(&rig, &arguments.out, arguments.quiet)?;
    match &arguments.changes {
        Some(original) => write_changes(&rig, original, &arguments.out),
        None => Ok(()),
    }
}

/// Writes what to change in a user's own MJCF as `NAME.changes.csv` beside `NAME.xml`, and prints
/// it.
///
/// # Errors
/// As [`changes`]; `Write`.
pub fn write_changes(rig: &Rig, original: &Path, out: &Path) -> Result<()> {
    let changes = changes(rig, original)?;
    let said = Said::beside([Some(out)]);
    let lines = changes.lines();
    if lines.is_empty() {
        said.line(format!("nothing to change in {}", original.display()));
    }
    for line in lines {
        said.line(line);
    }
    // A stream has no place beside it.
    if !sinew_files::is_stream(out) {
        let list = out.with_extension("changes.csv");
        sinew_files::write(&list, changes.to_csv())?;
        said.wrote(&list);
    }
    Ok(())
}

/// Writes a rig for MuJoCo and says what it lost.
///
/// # Errors
/// `Write`.
pub fn write(rig: &Rig, path: &Path, quiet: bool) -> Result<()> {
    let written = mjcf(rig);
    sinew_files::write(path, &written.text)?;
    if !quiet {
        for what in &written.left_out {
            eprintln!("left out of {}: {what}", path.display());
        }
    }
    Ok(())
}
