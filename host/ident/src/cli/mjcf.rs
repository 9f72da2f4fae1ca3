//! `sinew mjcf`: a rig for MuJoCo.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::{Value, json};
use sinew_sim::Rig;

use super::overwrite;
use super::said::Said;
use crate::error::Result;
use crate::mechanism::{Changes, changes};
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
    /// File for omissions and changes as JSON (sinew-mjcf/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    ///
    /// What MuJoCo cannot carry is in the file all the same.
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
        [
            ("--out", Some(arguments.out.as_path())),
            ("--json", arguments.json.as_deref()),
        ],
    )?;
    let rig = Rig::load(&arguments.rig)?;
    let left_out = write(&rig, &arguments.out, arguments.quiet)?;
    let json = arguments.json.as_deref();
    let said = Said::beside([Some(arguments.out.as_path()), json], arguments.quiet);
    let changes = match &arguments.changes {
        Some(original) => {
            let (changes, list) = write_changes(&rig, original, &arguments.out, said)?;
            json!({
                "original": original.display().to_string(),
                "list": list.map(|path| path.display().to_string()),
                "attributes": (changes.attributes.iter())
                    .map(|it| json!({
                        "place": it.place,
                        "element": it.element,
                        "attribute": it.attribute,
                        "old": it.old,
                        "new": it.new,
                    }))
                    .collect::<Vec<Value>>(),
                "by_hand": changes.by_hand,
            })
        }
        None => Value::Null,
    };
    if let Some(path) = json {
        let document = json!({
            "format": "sinew-mjcf/1",
            "mjcf": arguments.out.display().to_string(),
            "left_out": left_out,
            "changes": changes,
        });
        sinew_files::write(path, format!("{document:#}\n"))?;
    }
    if !sinew_files::is_output(&arguments.out) {
        said.next(format!(
            "python -m mujoco.viewer --mjcf={}",
            arguments.out.display()
        ));
    }
    Ok(())
}

/// Writes what to change in a user's own MJCF as `NAME.changes.csv` beside `NAME.xml`, and prints
/// it. The changes, and the file of the list.
///
/// # Errors
/// As [`changes`]; `Write`.
pub fn write_changes(
    rig: &Rig,
    original: &Path,
    out: &Path,
    said: Said,
) -> Result<(Changes, Option<PathBuf>)> {
    let changes = changes(rig, original)?;
    let lines = changes.lines();
    if lines.is_empty() {
        said.line(format!("nothing to change in {}", original.display()));
    }
    for line in lines {
        said.line(line);
    }
    // A stream has no place beside it.
    if sinew_files::is_stream(out) {
        return Ok((changes, None));
    }
    let list = out.with_extension("changes.csv");
    sinew_files::write(&list, changes.to_csv())?;
    said.wrote(&list);
    Ok((changes, Some(list)))
}

/// Writes a rig for MuJoCo, says what it lost, and returns that.
///
/// # Errors
/// `Write`.
pub fn write(rig: &Rig, path: &Path, quiet: bool) -> Result<Vec<String>> {
    let written = mjcf(rig);
    sinew_files::write(path, &written.text)?;
    if !quiet {
        for what in &written.left_out {
            eprintln!("left out of {}: {what}", path.display());
        }
    }
    Ok(written.left_out)
}
