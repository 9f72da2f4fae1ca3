//! `sinew mjcf`: a rig for MuJoCo.

use std::path::{Path, PathBuf};

use clap::Args;
use sinew_sim::Rig;

use super::overwrite;
use crate::error::Result;
use crate::mjcf::mjcf;

/// Arguments of `sinew mjcf`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML).
    pub rig: PathBuf,
    /// File for MuJoCo.
    #[arg(long, value_name = "XML")]
    out: PathBuf,
    /// Say nothing of what MuJoCo cannot carry; the file says it.
    #[arg(long)]
    quiet: bool,
}

/// # Errors
/// A bad rig, or a file that cannot be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    overwrite::refuse(
        [("the rig", arguments.rig.as_path())],
        [("--out", Some(arguments.out.as_path()))],
    )?;
    write(&Rig::load(&arguments.rig)?, &arguments.out, arguments.quiet)
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
