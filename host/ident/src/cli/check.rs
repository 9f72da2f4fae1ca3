//! `sinew check`: faults of recordings, before any fit.

use std::path::PathBuf;

use clap::Args;
use sinew_sim::Rig;

use super::exit_code;
use super::fault_text::{text, wrapped};
use super::overwrite;
use super::progress::Stage;
use super::repair::Repairs;
use super::said::Said;
use crate::check::{Check, Determined, check, determine};
use crate::error::{Error, Result};
use crate::excite::reveal::Visibility;
use crate::recording::Recording;

/// Arguments of `sinew check`.
#[derive(Args)]
pub struct Arguments {
    /// Recordings (CSV).
    #[arg(required = true, value_name = "CSV")]
    files: Vec<PathBuf>,
    /// The rig file (TOML) whose inputs and sensors are checked; without it all columns are.
    #[arg(long, value_name = "TOML")]
    rig: Option<PathBuf>,
    /// File for the faults as JSON; `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// End with status 3 for faults that are likely and not certain.
    #[arg(long)]
    exit_code: bool,
    #[command(flatten)]
    repairs: Repairs,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// Result as JSON.
#[derive(serde::Serialize)]
struct Document<'a> {
    format: &'static str,
    checks: &'a [Check],
    /// Null without a rig, for a large one, and where something is certainly wrong.
    determined: Option<&'a Determined>,
}

/// Returns the exit status.
///
/// # Errors
/// A bad file; `Failed` where something is certainly wrong.
pub fn run(arguments: &Arguments) -> Result<u8> {
    let read = arguments
        .files
        .iter()
        .map(|path| ("a recording", path.as_path()));
    let rig = arguments.rig.iter().map(|path| ("--rig", path.as_path()));
    overwrite::refuse(read.chain(rig), [("--json", arguments.json.as_deref())])?;
    let rig = arguments.rig.as_ref().map(Rig::load).transpose()?;
    let recordings = arguments.repairs.read(&arguments.files, arguments.quiet)?;
    for recording in &recordings {
        require_columns(recording, rig.as_ref())?;
    }
    // With a rig it takes seconds; it leaves no line of its own.
    let stage = Stage::begin("check", arguments.quiet);
    stage.say("faults");
    let found = check(&recordings, rig.as_ref());
    stage.say("parameters and effects that these recordings determine");
    // Numbers of recordings that are certainly wrong would mislead.
    let sound = is_sound(&found);
    let determined = rig.as_ref().filter(|_| sound);
    let determined = determined.and_then(|rig| determine(rig, &recordings));
    drop(stage);
    let on_output = arguments
        .json
        .as_deref()
        .is_some_and(sinew_files::is_output);
    if arguments.quiet && !on_output {
        super::fault_text::print(&found);
    } else if !on_output {
        let mut lines = text(&found);
        if found.is_empty() {
            lines += &format!("no fault found in {}\n", names(&recordings));
        }
        if let Some(determined) = &determined {
            lines += &determinations(determined);
        }
        let said = Said::beside([], arguments.quiet);
        said.line(lines.trim_end());
        if sound {
            said.next(next(&found, arguments));
        }
    }
    if let Some(path) = &arguments.json {
        let document = Document {
            format: "sinew-check/1",
            checks: &found,
            determined: determined.as_ref(),
        };
        let text = serde_json::to_string_pretty(&document)
            .map_err(|error| Error::failed(format!("the faults are no JSON: {error}")))?;
        sinew_files::write(path, text + "\n")?;
    }
    arguments.repairs.refuse(&found)?;
    Ok(if arguments.exit_code {
        exit_code::of_checks(&found)
    } else {
        0
    })
}

/// The command that comes next: what a fault means, or the verb that takes sound recordings.
fn next(found: &[Check], arguments: &Arguments) -> String {
    let first = arguments.files.first();
    let recording = first.map(|path| path.display().to_string());
    let recording = recording.unwrap_or_default();
    match (found.first(), &arguments.rig) {
        (Some(check), _) => format!("sinew explain {}", check.kind),
        (None, Some(rig)) => format!("sinew fit {} --fit {recording}", rig.display()),
        (None, None) => format!("sinew new {recording}"),
    }
}

/// No check is certain.
fn is_sound(checks: &[Check]) -> bool {
    !checks.iter().any(|check| check.certain)
}

/// Determined parameters and effects for a person, in lines of 80 columns.
fn determinations(found: &Determined) -> String {
    let mut text = String::from("determined by these recordings:\n");
    for p in &found.parameters {
        let value = |value: f64| crate::report::quantity(value, &p.unit);
        let words = match p.ci95 {
            Some([low, high]) => {
                format!(
                    "{} {} ({} to {})",
                    p.name,
                    value(p.value),
                    value(low),
                    value(high)
                )
            }
            None => format!("{} not determined", p.name),
        };
        text += &wrapped(&words, "  ", "    ");
    }
    let places = |verdict: Visibility| {
        let effects = found.effects.iter().filter(|e| e.verdict == verdict);
        let names: Vec<String> = effects
            .map(|effect| format!("{} at {}", effect.kind, effect.component))
            .collect();
        names.join(", ")
    };
    for (words, verdict) in [
        ("would be named if missing: ", Visibility::Determined),
        ("would be guessed at: ", Visibility::Weakly),
        ("would not be seen: ", Visibility::NotDetermined),
    ] {
        let names = places(verdict);
        if !names.is_empty() {
            text += &wrapped(&format!("{words}{names}"), "", "  ");
        }
    }
    let unseen = found
        .effects
        .iter()
        .filter(|e| e.verdict != Visibility::Determined);
    let mut wanted: Vec<&str> = unseen.map(|effect| effect.excited_by).collect();
    wanted.sort_unstable();
    wanted.dedup();
    wanted.retain(|motion| !motion.is_empty());
    if !wanted.is_empty() {
        let words = format!("missing recordings: {}", wanted.join("; "));
        text += &wrapped(&words, "", "  ");
    }
    text
}

/// Every column that the rig names is there.
fn require_columns(recording: &Recording, rig: Option<&Rig>) -> Result<()> {
    let Some(rig) = rig else { return Ok(()) };
    for actuator in &rig.actuators {
        recording.require(&actuator.input, &format!("actuator `{}`", actuator.name))?;
    }
    for sensor in &rig.sensors {
        recording.require(&sensor.signal, &format!("sensor `{}`", sensor.name))?;
    }
    Ok(())
}

fn names(recordings: &[Recording]) -> String {
    let names: Vec<String> = recordings.iter().map(Recording::name).collect();
    names.join(", ")
}
