//! Measurements of the program, as verbs: `cargo run -p sinew-evaluation -- VERB`, or
//! `cargo xtask VERB`.

mod bench;
mod experiments;
mod figure;
mod foreign;
mod page;
mod proof;
mod recorded;

use std::process::ExitCode;

use anyhow::{Result, bail};

/// The name of a verb and the function that runs it.
type Verb = (&'static str, fn(&[String]) -> Result<()>);

const VERBS: &[Verb] = &[
    ("bench", bench::run),
    ("experiments", experiments::run),
    ("foreign", foreign::run),
    ("proof", proof::run),
    ("recorded", recorded::run),
];

fn dispatch(arguments: &[String]) -> Result<()> {
    let names: Vec<&str> = VERBS.iter().map(|(name, _)| *name).collect();
    let Some((name, rest)) = arguments.split_first() else {
        bail!("a verb is missing; there are {}", names.join(", "));
    };
    match VERBS.iter().find(|(known, _)| known == name) {
        Some((_, run)) => run(rest),
        None => bail!("there is no verb '{name}'; there are {}", names.join(", ")),
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    xtask::process::end("sinew-evaluation", dispatch(&arguments))
}
