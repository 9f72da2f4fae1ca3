//! One door: every task of this repository is `cargo xtask VERB`, and continuous integration calls
//! the same verbs as a person does.

mod arguments;
mod ci;
mod demo;
mod deny;
mod dist;
mod evaluation;
mod foreign;
mod functions;
mod generate;
mod help;
mod modules;
mod oldest;
mod package;
mod prose;
mod python;
mod references;
mod snapshots;
mod survive;
mod tally;
mod test;
mod tutorials;

use std::process::ExitCode;

use anyhow::{Result, bail};
use arguments::none;
use help::Verb;
use xtask::{process, setup};

/// In the order a newcomer meets them; `help` prints this table.
const VERBS: &[Verb] = &[
    Verb {
        name: "setup",
        arguments: "",
        line: "Install what is missing: the target thumbv7em-none-eabihf, rustfmt, clippy, QEMU",
        run: |arguments| {
            none(arguments)?;
            setup::run_with(setup::Extent::Everything, setup::Consent::Given).map(|_| ())
        },
    },
    Verb {
        name: "demo",
        arguments: "[--yes] [FLAGS]",
        line: "From a shipped recording to a controlled Cortex-M4F; the report lies in target/demo",
        run: demo::demo,
    },
    Verb {
        name: "emps",
        arguments: "[--yes] [FLAGS]",
        line: "The same on a real positioning axis (the EMPS recordings, $SINEW_DATA/emps)",
        run: demo::emps,
    },
    Verb {
        name: "recorded",
        arguments: "[NAMES] [--publish]",
        line: "Real devices ($SINEW_DATA) put to sinew diagnose, beside what the literature knows of them",
        run: |arguments| evaluation::run("recorded", arguments),
    },
    Verb {
        name: "test",
        arguments: "",
        line: "Every test, on the host and in QEMU, with one closing line that counts",
        run: |arguments| {
            none(arguments)?;
            test::run(&setup::run(setup::Extent::Build)?)
        },
    },
    Verb {
        name: "generate",
        arguments: "[--check]",
        line: "Print the crates of models/ again; with --check only say which are out of date",
        run: generate::run,
    },
    Verb {
        name: "measure",
        arguments: "",
        line: "Instructions, flash, RAM and stack of two controllers in QEMU, as tables",
        run: snapshots::measure,
    },
    Verb {
        name: "bless",
        arguments: "",
        line: "Accept what was measured: rewrite the snapshots in tests/expected that differ",
        run: snapshots::bless,
    },
    Verb {
        name: "budget",
        arguments: "",
        line: "Hold what is measured against tests/budgets.toml, which only a person writes",
        run: snapshots::budget,
    },
    Verb {
        name: "oldest",
        arguments: "",
        line: "Compile the no_std crates and printed networks with the rust-version that each declares",
        run: |arguments| {
            none(arguments)?;
            oldest::check()
        },
    },
    Verb {
        name: "bench",
        arguments: "[SECTION...] [--publish]",
        line: "Speeds and costs, as tables and in target/bench/summary.json",
        run: |arguments| evaluation::run("bench", arguments),
    },
    Verb {
        name: "foreign",
        arguments: "",
        line: "Write again what other people's physics wrote (Python with MuJoCo; not needed by tests)",
        run: |arguments| evaluation::run("foreign", arguments),
    },
    Verb {
        name: "proof",
        arguments: "[--seed S] [--cases N] [--fresh] [--score] [--publish] | --committed | --brief | --bouc-wen | [--seed S] --compare N",
        line: "Recordings with concealed physics put to `sinew diagnose`, and the table of what it found",
        run: |arguments| evaluation::run("proof", arguments),
    },
    Verb {
        name: "experiments",
        arguments: "[NAMES] [--seed S] [--controllers A,B] [--cases A,B]",
        line: "Questions whose answer is measured: what a controller gains from a corrected model (correction)",
        run: |arguments| evaluation::run("experiments", arguments),
    },
    Verb {
        name: "tutorials",
        arguments: "[--program PATH]",
        line: "The tutorials of docs/tutorials, executed line by line",
        run: |arguments| tutorials::run(&setup::run(setup::Extent::Build)?, arguments),
    },
    Verb {
        name: "python",
        arguments: "",
        line: "The Python package: lints, build and tests, where Python and pip are there",
        run: python::run,
    },
    Verb {
        name: "cross",
        arguments: "",
        line: "Checks the program for the targets of releases, debug probes included",
        run: dist::cross,
    },
    Verb {
        name: "dist",
        arguments: "[--profile NAME] [--target TRIPLE]",
        line: "The release archive of this system, tried in an empty root; in target/dist",
        run: dist::run,
    },
    Verb {
        name: "survive",
        arguments: "[networks [COUNT [SEED]]]",
        line: "Long versions of what ci runs short: frames, states, control, networks, faults, cases",
        run: survive::run,
    },
    Verb {
        name: "references",
        arguments: "[--list]",
        line: "Links and cited equations lead somewhere; sentences, openings and lines keep their budget",
        run: references::check,
    },
    Verb {
        name: "cycles",
        arguments: "",
        line: "No file depends on itself through others, no crate on what it must not know",
        run: |arguments| {
            none(arguments)?;
            modules::check()
        },
    },
    Verb {
        name: "deny",
        arguments: "",
        line: "Licences, sources and versions of dependencies (deny.toml)",
        run: |arguments| {
            none(arguments)?;
            deny::check()
        },
    },
    Verb {
        name: "package",
        arguments: "",
        line: "Every crate that can be published packages, and its package compiles",
        run: |arguments| {
            none(arguments)?;
            package::check()
        },
    },
    Verb {
        name: "boards",
        arguments: "",
        line: "Lint boards and models, and link the images that no test builds",
        run: ci::boards,
    },
    Verb {
        name: "ci",
        arguments: "[STAGES]",
        line: "All that guards the main branch, stage by stage with its time; .ci/run calls this",
        run: ci::run,
    },
    Verb {
        name: "help",
        arguments: "",
        line: "This list",
        run: |_| {
            help::print(VERBS);
            Ok(())
        },
    },
];

fn dispatch(arguments: &[String]) -> Result<()> {
    let Some((name, rest)) = arguments.split_first() else {
        help::print(VERBS);
        return Ok(());
    };
    let name = match name.as_str() {
        "-h" | "--help" => "help",
        other => other,
    };
    match VERBS.iter().find(|verb| verb.name == name) {
        Some(verb) => (verb.run)(rest),
        None => {
            help::print(VERBS);
            bail!("there is no verb '{name}'")
        }
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    process::end("xtask", dispatch(&arguments))
}
