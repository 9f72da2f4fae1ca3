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
use sinew_ident::error::{Error, Result};
use sinew_ident::recording::Recording;

/// Flags of `sinew new`. Whatever is not given is asked at a terminal, or guessed.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct NewArgs {
    /// The recording (CSV) whose columns the rig is to name.
    pub recording: PathBuf,
    /// File for the rig; by default beside the recording, with its name and `.toml`.
    #[arg(long, value_name = "RIG.toml")]
    pub out: Option<PathBuf>,
    /// The device's name; by default the recording's.
    #[arg(long)]
    pub name: Option<String>,
    /// A column that drives the device; can be given more than once.
    #[arg(long = "input", value_name = "COLUMN")]
    pub inputs: Vec<String>,
    /// A column that a sensor writes; can be given more than once.
    #[arg(long = "output", value_name = "COLUMN")]
    pub outputs: Vec<String>,
    /// Motion along a line or about an axis; by default as the units of the positions say.
    #[arg(long)]
    pub motion: Option<Motion>,
    /// Mass in kg (slide) or moment of inertia in kg m^2 (hinge) of what moves, roughly.
    #[arg(long, value_name = "KG")]
    pub inertia: Option<f64>,
    /// Presence of a spring; by default decided by fits with and without one.
    #[arg(long, value_name = "yes|no")]
    pub spring: Option<YesNo>,
    /// Guess instead of asking.
    #[arg(long)]
    pub yes: bool,
    /// Replace a rig file that is there already.
    #[arg(long)]
    pub force: bool,
    /// Repairs of the recording.
    #[command(flatten)]
    pub repairs: sinew_ident::cli::repair::Repairs,
    /// No progress.
    #[arg(long)]
    pub quiet: bool,
}

/// Motion of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Motion {
    /// Along a line.
    Slide,
    /// About an axis.
    Hinge,
}

/// An answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum YesNo {
    /// Yes.
    Yes,
    /// No.
    No,
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

/// Runs the command: asks on the terminal what the flags leave open, if there is one, and writes
/// the rig.
///
/// # Errors
/// As [`rig_text`]; `Arguments` where the rig file exists and `--force` is not given; `Write`.
pub fn run(args: &NewArgs) -> Result<NewRig> {
    let path = args
        .out
        .clone()
        .unwrap_or_else(|| args.recording.with_extension("toml"));
    if path.exists() && !args.force {
        return Err(
            Error::arguments(format!("{} exists already", path.display()))
                .help("give another name with --out, or --force to replace it"),
        );
    }
    let mut recordings = args.repairs.read(std::slice::from_ref(&args.recording))?;
    let recording = recordings.remove(0);
    let checks = sinew_ident::check::check(std::slice::from_ref(&recording), None);
    args.repairs.judge(&checks, args.quiet)?;
    let asking = !args.yes && std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
    let written = if asking {
        let terminal = Terminal {
            input: &mut std::io::stdin().lock(),
            output: &mut std::io::stderr(),
        };
        rig_text(args, &recording, Some(terminal))?
    } else {
        rig_text(args, &recording, None)?
    };
    sinew_ident::atomic::write(&path, written.text)?;
    Ok(NewRig {
        path,
        unused: written.unused,
        guesses: written.guesses,
    })
}

/// The text of the rig, the columns that it leaves out, and what it guesses. `terminal`: where to
/// read answers and where to put questions.
///
/// # Errors
/// `File` for a column that was asked for and is not there, and for a recording in which no input
/// or no position can be told; `Arguments` for an inertia that is not positive.
pub fn rig_text(
    args: &NewArgs,
    recording: &Recording,
    terminal: Option<Terminal>,
) -> Result<Written> {
    if args
        .inertia
        .is_some_and(|inertia| !(inertia.is_finite() && inertia > 0.0))
    {
        return Err(Error::arguments("the inertia must be a positive number").help("--inertia 1.5"));
    }
    let columns = Columns::of(recording, &args.inputs, &args.outputs)?;
    let answers = Answers::collect(args, recording, &columns, terminal)?;
    let variant = |spring: bool, found: Option<&str>| {
        text::write(recording, &columns, &answers, (spring, found))
    };
    let mut guesses = Vec::new();
    if !answers.inertia_known {
        guesses.push(format!("an inertia of {} (--inertia)", answers.inertia));
    }
    let text = match answers.spring {
        Some(spring) => variant(spring, None),
        None => {
            let [with, without] = [true, false].map(|spring| variant(spring, None));
            let verdict = Verdict::of(recording, &with, &without, args.quiet);
            let found = verdict.sentence();
            let text = variant(verdict.spring, Some(&found));
            guesses.push(format!("{found} (--spring yes|no)"));
            text
        }
    };
    // A name with a quote in it, say: better found here than by the next command.
    crate::rig_file::parse(&text, &display(&args.out, &args.recording))?;
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
