//! `cargo xtask experiments`: questions whose answer is measured; each is one file.

mod ablations;
mod alike;
mod bench;
mod bound;
mod fleet;
mod imitate;
mod prefer;
mod problem;
mod problems;
mod published;
mod rehearsal;
mod share;
mod targets;
mod tuning;

use anyhow::{Result, bail};

/// One experiment: its name, its question, and the answering with a seed.
struct Experiment {
    name: &'static str,
    question: &'static str,
    run: fn(u64, &[String]) -> Result<()>,
}

const EXPERIMENTS: &[Experiment] = &[
    Experiment {
        name: rehearsal::STAGE.name,
        question: "what a controller gains once `sinew diagnose` has corrected its model",
        run: |seed, only| rehearsal::run(&rehearsal::STAGE, whole(seed, only)?),
    },
    Experiment {
        name: rehearsal::MASS.name,
        question: "the same for the published mass, on plants that MuJoCo runs",
        run: |seed, only| rehearsal::run(&rehearsal::MASS, whole(seed, only)?),
    },
    Experiment {
        name: rehearsal::TENDON.name,
        question: "the same for the published tendon platform, on plants that MuJoCo runs",
        run: |seed, only| rehearsal::run(&rehearsal::TENDON, whole(seed, only)?),
    },
    Experiment {
        name: problems::MASS.name,
        question: "smooth moves to the levels of the published staircase beside a PID, on plants that rub",
        run: |seed, only| published::run(&problems::MASS, seed, only),
    },
    Experiment {
        name: problems::STEPS.name,
        question: "the published staircase beside a PID, on the same plants",
        run: |seed, only| published::run(&problems::STEPS, seed, only),
    },
    Experiment {
        name: bound::NAME,
        question: "how small the error of those moves can be with that noise and that load, for any linear controller",
        run: |seed, only| bound::run(whole(seed, only)?),
    },
    Experiment {
        name: problems::TENDON.name,
        question: "the published tendon platform along a path, on plants that rub and have slack",
        run: |seed, only| published::run(&problems::TENDON, seed, only),
    },
    Experiment {
        name: problems::HASEL.name,
        question: "the published HASEL platform along the swirl, on plants that creep",
        run: |seed, only| published::run(&problems::HASEL, seed, only),
    },
    Experiment {
        name: "channel-faults",
        question: "whether a fibre or a field that dies, freezes, drifts, weakens or grows noisy is found, and what the loop loses",
        run: |seed, only| {
            let seed = whole(seed, only)?;
            published::faults(&problems::TENDON, seed, "fibres-alone")?;
            published::faults(&problems::HASEL, seed, "magnets-alone")
        },
    },
    Experiment {
        name: ablations::NAME,
        question: "what a horizon and the estimate of the disturbance are worth on the mass, the tendon and HASEL platforms",
        run: |seed, only| ablations::run(whole(seed, only)?),
    },
    Experiment {
        name: prefer::NAME,
        question: "how near ten questions come to the loop that a person likes best, and whether two people are told apart",
        run: |seed, only| prefer::run(whole(seed, only)?),
    },
    Experiment {
        name: tuning::NAME,
        question: "what derivatives of the closed loop are worth to `sinew tune`, beside a simplex",
        run: tuning::run,
    },
    Experiment {
        name: fleet::NAME,
        question: "what the distribution of a dozen devices says of the next ones, and what it is worth to a fit and to a controller",
        run: fleet::run,
    },
    Experiment {
        name: share::NAME,
        question: "what a private release of a fleet is worth over budgets and sizes, and what an attacker learns from it",
        run: |seed, only| share::run(whole(seed, only)?),
    },
    Experiment {
        name: imitate::NAME,
        question: "how near a policy of 533 weights comes to the controller that demonstrated one motion, positions alone",
        run: |seed, only| imitate::run(whole(seed, only)?),
    },
    Experiment {
        name: alike::NAME,
        question: "what `sinew diagnose` says where several tendons, winches or joints have the same effect",
        run: alike::run,
    },
];

/// The seed of an experiment that has no controllers to choose from.
fn whole(seed: u64, only: &[String]) -> Result<u64> {
    match only {
        [] => Ok(seed),
        _ => bail!(
            "--controllers is for {}, {}, {} and {}, --cases for {}, {} and {}: this experiment runs all of its stages",
            problems::MASS.name,
            problems::STEPS.name,
            problems::TENDON.name,
            problems::HASEL.name,
            alike::NAME,
            tuning::NAME,
            fleet::NAME
        ),
    }
}

/// Runs the named experiments, or all.
///
/// # Errors
/// A name or a seed that there is not, or an experiment that fails.
pub fn run(arguments: &[String]) -> Result<()> {
    let mut seed = 1;
    let mut only: Vec<String> = Vec::new();
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
        if argument == "--controllers" || argument == "--cases" {
            match rest.next() {
                Some(names) => only.extend(names.split(',').map(String::from)),
                None => bail!("{argument} needs names, with commas between"),
            }
            continue;
        }
        // The name that this experiment had before.
        let wanted = match &argument[..] {
            "mended" => rehearsal::STAGE.name,
            name => name,
        };
        match EXPERIMENTS.iter().find(|e| e.name == wanted) {
            Some(experiment) => asked.push(experiment),
            None => {
                let known: Vec<String> = EXPERIMENTS
                    .iter()
                    .map(|e| format!("{} ({})", e.name, e.question))
                    .collect();
                bail!(
                    "there is no experiment '{argument}'; there are --seed S, --controllers A,B, --cases A,B and {}",
                    known.join(", ")
                );
            }
        }
    }
    if asked.is_empty() {
        asked.extend(EXPERIMENTS);
    }
    asked.iter().try_for_each(|e| (e.run)(seed, &only))
}
