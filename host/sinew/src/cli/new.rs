//! `sinew new`.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use super::result;
use crate::new_rig::{self, Motion, NewRig, NewRigOptions};
use sinew_ident::cli::overwrite;
use sinew_ident::cli::repair::Repairs;
use sinew_ident::cli::said::Said;
use sinew_ident::error::Result;
use sinew_ident::mechanism::{Format, import};

/// Flags about the columns of a recording, which a mechanism does not have.
const OF_RECORDINGS: [&str; 7] = [
    "recording",
    "name",
    "inputs",
    "outputs",
    "motion",
    "inertia",
    "spring",
];

/// Arguments of `sinew new`; an answer that is not given is asked at a terminal, or guessed.
#[derive(Args)]
pub struct Arguments {
    /// The recording (CSV, or a log that `sinew convert` reads) whose columns the rig is to name.
    #[arg(required_unless_present_any = ["mjcf", "urdf"])]
    recording: Option<PathBuf>,
    /// A mechanism for MuJoCo whose hinges and slides become the rig, instead of a recording.
    #[arg(long, value_name = "XML", conflicts_with_all = OF_RECORDINGS)]
    mjcf: Option<PathBuf>,
    /// A mechanism in URDF, likewise.
    #[arg(long, value_name = "URDF", conflicts_with_all = OF_RECORDINGS, conflicts_with = "mjcf")]
    urdf: Option<PathBuf>,
    /// A joint that moves, where not all do; the others are held still; may be repeated.
    #[arg(long = "joint", value_name = "NAME", conflicts_with = "recording")]
    joints: Vec<String>,
    /// File for the rig; by default beside the recording, with its name and `.toml`.
    #[arg(long, value_name = "RIG.toml")]
    out: Option<PathBuf>,
    /// The device's name; by default the recording's.
    #[arg(long)]
    name: Option<String>,
    /// A column that drives the device; can be given more than once.
    #[arg(long = "input", value_name = "COLUMN")]
    inputs: Vec<String>,
    /// A column that a sensor writes; can be given more than once.
    #[arg(long = "output", value_name = "COLUMN")]
    outputs: Vec<String>,
    /// Motion along a line or about an axis; by default as the units of the positions say.
    #[arg(long)]
    motion: Option<Motion>,
    /// Mass in kg (slide) or moment of inertia in kg m^2 (hinge) of what moves, roughly.
    #[arg(long, value_name = "KG")]
    inertia: Option<f64>,
    /// Presence of a spring; by default decided by fits with and without one.
    #[arg(long, value_name = "yes|no")]
    spring: Option<YesNo>,
    /// Guess instead of asking.
    #[arg(long)]
    yes: bool,
    /// Replace a rig file that is there already.
    #[arg(long)]
    force: bool,
    /// File for what was guessed and left out as JSON (sinew-new/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
    /// Repairs of the recording.
    #[command(flatten)]
    repairs: Repairs,
}

/// An answer.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum YesNo {
    /// Yes.
    Yes,
    /// No.
    No,
}

/// # Errors
/// As [`new_rig::run`].
pub fn run(arguments: Arguments) -> Result<()> {
    let mechanism = match (&arguments.mjcf, &arguments.urdf) {
        (Some(file), _) => Some((file, Format::Mjcf)),
        (None, Some(file)) => Some((file, Format::Urdf)),
        (None, None) => None,
    };
    if let Some((file, format)) = mechanism {
        return from_mechanism(file, format, &arguments);
    }
    let json = arguments.json;
    let recording = arguments.recording.clone().unwrap_or_default();
    let beside = arguments.out.clone();
    let beside = beside.unwrap_or_else(|| recording.with_extension("toml"));
    overwrite::refuse(
        arguments
            .recording
            .iter()
            .map(|path| ("the recording", path.as_path())),
        [
            ("--out", Some(beside.as_path())),
            ("--json", json.as_deref()),
        ],
    )?;
    let options = NewRigOptions {
        recording: arguments.recording.unwrap_or_default(),
        out: arguments.out,
        name: arguments.name,
        inputs: arguments.inputs,
        outputs: arguments.outputs,
        motion: arguments.motion,
        inertia: arguments.inertia,
        spring: arguments.spring.map(|answer| answer == YesNo::Yes),
        guess: arguments.yes,
        replace: arguments.force,
        repairs: arguments.repairs,
        quiet: arguments.quiet,
    };
    let new = new_rig::run(&options)?;
    let said = Said::beside([Some(new.path.as_path()), json.as_deref()], options.quiet);
    said.wrote(&new.path);
    if !new.unused.is_empty() {
        said.line(format!(
            "columns that the rig does not use: {}",
            new.unused.join(", ")
        ));
    }
    for guess in &new.guesses {
        said.line(format!("guessed: {guess}"));
    }
    let rig = if sinew_files::is_output(&new.path) {
        "RIG.toml".into()
    } else {
        new.path.display().to_string()
    };
    said.next(format!(
        "sinew fit {rig} --fit {}{}",
        options.recording.display(),
        options.repairs.flags()
    ));
    let NewRig {
        path,
        unused,
        guesses,
    } = new;
    result::write(json.as_deref(), || {
        document(&path, [&unused, &guesses, &[], &[]])
    })
}

/// `sinew-new/1`: the file, columns that nothing uses, guesses, what a mechanism has that the rig
/// has not, and what was added.
fn document(rig: &Path, [unused, guesses, left_out, added]: [&[String]; 4]) -> Value {
    json!({
        "format": "sinew-new/1",
        "rig": rig,
        "unused": unused,
        "guesses": guesses,
        "left_out": left_out,
        "added": added,
    })
}

/// A rig from a mechanism of another program.
fn from_mechanism(file: &Path, format: Format, arguments: &Arguments) -> Result<()> {
    let out = arguments.out.clone();
    let out = out.unwrap_or_else(|| file.with_extension("toml"));
    let json = arguments.json.as_deref();
    overwrite::refuse(
        [("the mechanism", file)],
        [("--out", Some(out.as_path())), ("--json", json)],
    )?;
    new_rig::refuse_existing(&out, arguments.force)?;
    let made = import(file, format, &arguments.joints)?;
    crate::rig_file::parse(&made.text, &out.display().to_string())?;
    sinew_files::write(&out, &made.text)?;
    let said = Said::beside([Some(out.as_path()), json], arguments.quiet);
    said.wrote(&out);
    for line in &made.left_out {
        said.line(format!("left out: {line}"));
    }
    for added in &made.added {
        said.line(format!("added: {added}"));
    }
    said.next(format!(
        "name the columns of a recording in {}, then sinew fit",
        out.display()
    ));
    result::write(json, || {
        document(&out, [&[], &[], &made.left_out, &made.added])
    })
}
