//! `sinew new`: a first rig file from a recording's columns and a few answers.
//!
//! The units at the end of the columns' names tell most of it: a position is a sensor, a force or a
//! voltage an input. What they cannot tell (line or axis, how heavy, is there a spring) comes from
//! flags, from questions where a person sits at the terminal, or from a guess that the file says is
//! one; whether there is a spring, the recording says, which is fitted with and without. The file
//! that is written is read back before anyone sees it, and its comments explain what to change.

mod answers;
mod columns;
mod spring;
mod text;

use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

use self::answers::Answers;
use self::columns::Columns;
use self::spring::Verdict;
use sinew_ident::check::Check;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::repair::Repairs;
use sinew_ident::error::{Error, Result};
use sinew_ident::recording::Recording;

/// Facts about the device and the rig file. Open ones are asked at a terminal, or guessed.
#[derive(Debug, Clone, Default)]
pub struct NewRigOptions {
    /// Recording (CSV) whose columns the rig names.
    pub recording: PathBuf,
    /// File for the rig; by default beside the recording, with its name and `.toml`.
    pub out: Option<PathBuf>,
    /// Name of the device; by default the recording's.
    pub name: Option<String>,
    /// Columns that drive the device; empty: all that can.
    pub inputs: Vec<String>,
    /// Columns that sensors write; empty: all that can.
    pub outputs: Vec<String>,
    /// Motion of the body; by default as the units of the positions say.
    pub motion: Option<Motion>,
    /// Mass in kg (slide) or moment of inertia in kg m² (hinge) of the body.
    pub inertia: Option<f64>,
    /// Presence of a spring; by default decided by fits with and without one.
    pub spring: Option<bool>,
    /// Guess instead of asking.
    pub guess: bool,
    /// Replace a rig file that exists.
    pub replace: bool,
    /// Repairs of the recording.
    pub repairs: Repairs,
    /// No progress.
    pub quiet: bool,
}

/// Motion of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Along a line.
    Slide,
    /// About an axis.
    Hinge,
}

/// Source of answers and sink of questions.
pub struct Terminal<'a> {
    /// A line an answer.
    pub input: &'a mut dyn BufRead,
    /// Questions, without line ends.
    pub output: &'a mut dyn Write,
}

/// Result of `sinew new`.
#[derive(Debug, Clone)]
pub struct NewRig {
    /// The file that was written.
    pub path: PathBuf,
    /// Columns that neither drive nor show anything in it.
    pub unused: Vec<String>,
    /// Guesses, a sentence each.
    pub guesses: Vec<String>,
}

/// The text of a rig.
#[derive(Debug, Clone)]
pub struct Written {
    /// It has been read back.
    pub text: String,
    /// As in [`NewRig`].
    pub unused: Vec<String>,
    /// As in [`NewRig`].
    pub guesses: Vec<String>,
}

/// Writes the rig; asks on the terminal, if there is one, for what the options leave open.
///
/// # Errors
/// As [`rig_text`]; `Arguments` where the rig file exists and may not be replaced; `Write`.
pub fn run(options: &NewRigOptions) -> Result<NewRig> {
    let path = options
        .out
        .clone()
        .unwrap_or_else(|| options.recording.with_extension("toml"));
    overwrite::refuse(
        [("the recording", options.recording.as_path())],
        [("--out", Some(path.as_path()))],
    )?;
    refuse_existing(&path, options.replace)?;
    let mut recordings = options
        .repairs
        .read(std::slice::from_ref(&options.recording), options.quiet)?;
    let recording = recordings.remove(0);
    let checks = sinew_ident::check::check(std::slice::from_ref(&recording), None);
    options.repairs.judge(&checks)?;
    refuse_open_unit(&options.repairs, &checks)?;
    let asking =
        !options.guess && std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
    let written = if asking {
        let terminal = Terminal {
            input: &mut std::io::stdin().lock(),
            output: &mut std::io::stderr(),
        };
        rig_text(options, &recording, Some(terminal))?
    } else {
        rig_text(options, &recording, None)?
    };
    sinew_files::write(&path, written.text)?;
    Ok(NewRig {
        path,
        unused: written.unused,
        guesses: written.guesses,
    })
}

/// Refuses to write over a rig file, unless that was asked for.
///
/// # Errors
/// `Arguments` where there is one.
pub fn refuse_existing(path: &Path, replace: bool) -> Result<()> {
    if path.exists() && !replace && !sinew_files::is_stream(path) {
        return Err(
            Error::arguments(format!("{} exists already", path.display()))
                .help("give another name with --out, or --force to replace it"),
        );
    }
    Ok(())
}

/// Refuses times that look like no seconds, unless a flag says their unit. Every guess of the rig
/// would be wrong.
fn refuse_open_unit(repairs: &Repairs, checks: &[Check]) -> Result<()> {
    let open = |check: &&Check| check.kind.starts_with("time_in") && !repairs.accepts(check.kind);
    match checks.iter().find(open) {
        Some(check) if !repairs.time_unit_is_given() => {
            let remedy = check.remedy.trim_end_matches(" if they are");
            let message = format!("the unit of `t` is open: {}", check.sentence);
            Err(Error::file(&check.file, message)
                .help(format!("{remedy}, or --time-unit s if they are seconds")))
        }
        _ => Ok(()),
    }
}

/// The text of the rig, the columns that it leaves out, and what it guesses. `terminal`: where to
/// read answers and where to put questions.
///
/// # Errors
/// `File` for a column that was asked for and is not there, and for a recording in which no input
/// or no position can be told; `Arguments` for an inertia that is not positive.
pub fn rig_text(
    options: &NewRigOptions,
    recording: &Recording,
    terminal: Option<Terminal>,
) -> Result<Written> {
    let bad = |inertia: &f64| !(inertia.is_finite() && *inertia > 0.0);
    if let Some(inertia) = options.inertia.filter(bad) {
        return Err(
            Error::must_be("--inertia", "more than 0", inertia).help("for example --inertia 1.5")
        );
    }
    let columns = Columns::of(recording, &options.inputs, &options.outputs)?;
    let answers = Answers::collect(options, recording, &columns, terminal)?;
    let variant = |spring: bool, found: Option<&str>| {
        text::write(recording, &columns, &answers, (spring, found))
    };
    let mut guesses = Vec::new();
    if !answers.inertia_known {
        guesses.push(format!("an inertia of {} (--inertia)", answers.inertia));
    }
    guesses.extend(columns.chain_sentence());
    guesses.extend(columns.counts_sentence());
    let text = match answers.spring {
        Some(spring) => variant(spring, None),
        None => {
            let [with, without] = [true, false].map(|spring| variant(spring, None));
            let verdict = Verdict::of(recording, &with, &without, options.quiet);
            let found = verdict.sentence();
            let text = variant(verdict.spring, Some(&found));
            guesses.push(format!("{found} (--spring yes|no)"));
            text
        }
    };
    // A name with a quote in it, say: better found here than by the next command.
    crate::rig_file::parse(&text, &display(&options.out, &options.recording))?;
    Ok(Written {
        text,
        unused: columns.unused(recording),
        guesses,
    })
}

fn display(out: &Option<PathBuf>, recording: &Path) -> String {
    out.clone()
        .unwrap_or_else(|| recording.with_extension("toml"))
        .display()
        .to_string()
}

#[cfg(test)]
mod tests;
