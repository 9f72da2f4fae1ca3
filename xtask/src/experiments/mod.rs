//! `cargo xtask experiments`: questions whose answer is measured; each is one file.

mod bench;

mod problems;
mod published;
mod rehearsal;
mod targets;

use anyhow::{Result, bail};

/// One experiment: its name, its question, and the answering with a seed.
struct Experiment {
    name: &'static str,
    question: &'static str,
    run: fn(u64) -> Result<()>,
}

const EXPERIMENTS: &[Experiment] = &[
    Experiment {
        name: rehearsal::STAGE.name,
        question: "what a controller gains once `sinew diagnose` has mended its model",
        run: |seed| rehearsal::run(&rehearsal::STAGE, seed),
    },
    Experiment {
        name: rehearsal::MASS.name,
        question: "the same for the published mass, on plants that MuJoCo runs",
        run: |seed| rehearsal::run(&rehearsal::MASS, seed),
    },
    Experiment {
        name: rehearsal::TENDON.name,
        question: "the same for the published tendon platform, on plants that MuJoCo runs",
        run: |seed| rehearsal::run(&rehearsal::TENDON, seed),
    },
    Experiment {
        name: problems::MASS.name,
        question: "the published staircase beside a PID, on plants that rub",
        run: |seed| published::run(&problems::MASS, seed),
    },
    Experiment {
        name: problems::TENDON.name,
        question: "the published tendon platform along a path, on plants that rub and have slack",
        run: |seed| published::run(&problems::TENDON, seed),
    },
    Experiment {
        name: problems::HASEL.name,
        question: "the published HASEL platform along the swirl, on plants that creep",
        run: |seed| published::run(&problems::HASEL, seed),
    },
];

/// Runs the named experiments, or all.
///
/// # Errors
/// A name or a seed that there is not, or an experiment that fails.
pub fn run(arguments: &[String]) -> Result<()> {
    let mut seed = 1;
    let mut asked: Vec<&Experiment> = Vec::new();
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        if argument == "--seed" {
            seed = match rest.next().map(|text| text.parse()) {
                Some(Ok(seed)) => seed,
                _ => bail!("--seed needs a whole number"),
            };
            continue;
        }
        match EXPERIMENTS.iter().find(|e| e.name == argument) {
            Some(experiment) => asked.push(experiment),
            None => {
                let known: Vec<String> = EXPERIMENTS
                    .iter()
                    .map(|e| format!("{} ({})", e.name, e.question))
                    .collect();
                bail!(
                    "there is no experiment '{argument}'; there are --seed S and {}",
                    known.join(", ")
                );
            }
        }
    }
    if asked.is_empty() {
        asked.extend(EXPERIMENTS);
    }
    asked.iter().try_for_each(|e| (e.run)(seed))
}
