//! Command line of identification: the verbs that the programs `sinew` and `sinew-ident` share.

pub mod check;
pub mod colour;
pub mod convert;
pub mod diagnose;
pub mod excite;
pub mod exit_code;
pub mod failing;
mod fault_text;
pub mod fit;
pub mod fleet;
pub mod interrupt;
pub mod learn;
pub mod mjcf;
pub mod overwrite;
pub mod progress;
pub mod repair;
mod roles;
pub mod said;

pub use fault_text::wrapped;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};

use crate::error::Result;

/// Identification of a mechanical plant: fit, diagnosis, experiments.
#[derive(Parser)]
#[command(name = "sinew-ident", version, about, arg_required_else_help = true)]
struct Program {
    #[command(flatten)]
    colour: colour::Colour,
    #[command(subcommand)]
    verb: Verb,
}

/// The verbs of identification.
#[derive(Subcommand)]
enum Verb {
    /// Fit the parameters of a rig to recordings.
    Fit(fit::Arguments),
    /// Learn the law of a spring or a damper for this rig and others.
    Learn(learn::Arguments),
    /// Estimate the distribution of a fleet from recordings of its devices.
    Fleet(fleet::Arguments),
    /// Find faults of recordings before any fit.
    Check(check::Arguments),
    /// Find the physics that a rig lacks.
    Diagnose(diagnose::Arguments),
    /// Design an experiment within the limits of a rig.
    Excite(excite::Arguments),
    /// Write a rig for MuJoCo.
    Mjcf(mjcf::Arguments),
    /// Make a recording of a log in MATLAB, HDF5, MCAP or JSON.
    Convert(convert::Arguments),
}

/// Recordings, for verbs that fit or learn.
#[derive(Args, Clone, Debug)]
pub struct Recordings {
    /// A recording (CSV) to learn from; may be repeated.
    #[arg(long, value_name = "CSV", required = true)]
    pub fit: Vec<PathBuf>,
    /// A recording that is only scored; may be repeated.
    #[arg(long, value_name = "CSV")]
    pub test: Vec<PathBuf>,
}

/// Arguments of most verbs.
#[derive(Args, Clone, Debug)]
pub struct Common {
    /// Seed of everything that is drawn.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Print warnings and errors alone.
    #[arg(long)]
    pub quiet: bool,
}

/// Runs the program `sinew-ident`: 0 on success, 2 for bad arguments or bad files, 130 after
/// Ctrl-C, 141 where nobody reads on, 1 for anything else; with `--exit-code` 3 or 4 by the result
/// ([`exit_code`]).
pub fn main() -> ExitCode {
    // Without a handler the system ends the process, as it does any other.
    let _ = ctrlc::set_handler(|| {
        if !interrupt::is_taken() {
            let _files = sinew_files::remove_unfinished();
            std::process::exit(interrupt::STATUS.into());
        }
    });
    failing::end_with_standard_output(sinew_files::remove_unfinished);
    let choice = colour::asked(std::env::args_os());
    colour::choose(choice);
    let parsed = Program::command().color(choice).try_get_matches();
    let program = match parsed.and_then(|matches| Program::from_arg_matches(&matches)) {
        Ok(program) => program,
        Err(error) => {
            // clap's own words, on the stream that fits: help is no error.
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    match run(program.verb) {
        Ok(code) => interrupt::status(code),
        Err(error) => failing::status(&error),
    }
}

fn run(verb: Verb) -> Result<u8> {
    match verb {
        Verb::Fit(arguments) => fit::run(&arguments),
        Verb::Learn(arguments) => learn::run(&arguments).map(|()| 0),
        Verb::Fleet(arguments) => fleet::run(&arguments).map(|()| 0),
        Verb::Diagnose(arguments) => diagnose::run(&arguments),
        Verb::Check(arguments) => check::run(&arguments),
        Verb::Excite(arguments) => excite::run(&arguments, None).map(|()| 0),
        Verb::Mjcf(arguments) => mjcf::run(&arguments).map(|()| 0),
        Verb::Convert(arguments) => convert::run(&arguments).map(|()| 0),
    }
}
