//! `sinew imitate`: a small policy of one demonstrated motion, and the commands of that motion.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::RangedU64ValueParser;
use serde_json::{Value, json};
use sinew_ident::cli::overwrite;
use sinew_ident::cli::progress::Stage;
use sinew_ident::cli::repair::read_recording;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::fleet::parameters;
use sinew_ident::population::Fleet;
use sinew_ident::report::{Table, count, quantity};
use sinew_imitate::Options;
use sinew_model::policy::{POLICY_FILE, save};
use sinew_nn::store::{NETWORK_FILE, WEIGHTS_FILE};
use sinew_sim::Plant;

use crate::closed_loop::control_problem::ControlProblem;
use crate::pipeline::imitation::{self, Draws, Imitation, recording, refuse};
use crate::rig_file;

/// File of the commands in the folder.
const COMMANDS: &str = "commands.csv";

/// Arguments of `sinew imitate`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML), fitted.
    rig: PathBuf,
    /// The demonstration: a recording (CSV) of one motion. Commands are not needed.
    ///
    /// The motion begins at rest, and is what the policy is taught. Where commands are recorded
    /// too, cloning them is measured beside it.
    #[arg(long, value_name = "CSV")]
    demo: PathBuf,
    /// Folder for the policy and its network, and for commands.csv.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Largest relative deviation of a parameter of the plants that teach.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.2)]
    spread: f64,
    /// The fleet that plants are drawn from (sinew-fleet/1), in place of --spread.
    #[arg(long, value_name = "TOML", conflicts_with = "spread")]
    fleet: Option<PathBuf>,
    /// Largest load on a command while it learns, as a part of half the command's range.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0)]
    load: f64,
    /// Steps of the optimiser at most.
    #[arg(long, value_name = "N", default_value_t = Options::default().steps, value_parser = RangedU64ValueParser::<usize>::new().range(20..=100_000))]
    steps: usize,
    /// Seed of everything that is drawn.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// File for the errors as JSON (sinew-imitation/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// # Errors
/// A bad file or argument, a rig that cannot be taught, a plant that diverges.
pub fn run(arguments: &Arguments) -> Result<()> {
    refuse_arguments(arguments)?;
    let rig = rig_file::load(&arguments.rig)?;
    let plant = Plant::new(&rig)?;
    let demonstration = read_recording(&arguments.demo, arguments.quiet)?;
    let own = std::slice::from_ref(&demonstration);
    let mut task = ControlProblem::new(&rig, &plant, own, &demonstration)?;
    task.follow(&demonstration, &plant)?;
    refuse(&plant, &task)?;
    let fleet = match &arguments.fleet {
        None => None,
        Some(path) => {
            let fleet = Fleet::load(path)?;
            fleet.is_of(&rig.file, &parameters(&plant))?;
            Some(fleet)
        }
    };
    let draws = Draws {
        spread: arguments.spread,
        fleet: fleet.as_ref(),
        seed: arguments.seed,
        load: arguments.load,
    };
    let options = Options {
        steps: arguments.steps,
        seed: arguments.seed,
        ..Options::default()
    };
    let stage = Stage::begin("teach a policy through the plant", arguments.quiet);
    let mut last = 0;
    let mut progress = |look: &sinew_imitate::Progress| {
        last = look.step;
        stage.share(look.step, options.steps, "steps");
        true
    };
    let name = name(&rig.name);
    let loops = (&plant, &task);
    let found = imitation::imitate(&name, loops, &demonstration, draws, &options, &mut progress)?;
    stage.end(count(last, "step"));
    save(&arguments.out, &found.spec).map_err(Error::refused)?;
    let commands = arguments.out.join(COMMANDS);
    recording(&found.motion, &plant, &task, &commands)?.write(&commands)?;
    said(arguments, &task, &plant, &found);
    super::result::write(arguments.json.as_deref(), || {
        document(arguments, &task, &found)
    })
}

/// Refuses files that would be replaced, and numbers that make no sense.
fn refuse_arguments(arguments: &Arguments) -> Result<()> {
    let read = [("the rig", &arguments.rig), ("--demo", &arguments.demo)];
    let fleet = arguments.fleet.iter().map(|path| ("--fleet", path));
    let read = read.into_iter().chain(fleet);
    let written = [POLICY_FILE, NETWORK_FILE, WEIGHTS_FILE, COMMANDS];
    let written = written.map(|file| arguments.out.join(file));
    let written = written.iter().map(|path| ("--out", Some(path.as_path())));
    overwrite::refuse(
        read.map(|(name, path)| (name, path.as_path())),
        written.chain([("--json", arguments.json.as_deref())]),
    )?;
    if arguments.out.is_file() {
        let out = arguments.out.display();
        return Err(Error::must_be(
            "--out",
            "a folder",
            format!("the file {out}"),
        ));
    }
    if !(0.0..1.0).contains(&arguments.spread) {
        let expectation = "a fraction of a parameter in [0, 1)";
        return Err(Error::must_be("--spread", expectation, arguments.spread)
            .help("for example --spread 0.2: from 20 % below to 20 % above"));
    }
    if !(0.0..=1.0).contains(&arguments.load) {
        let expectation = "a fraction of half a command's range in [0, 1]";
        return Err(Error::must_be("--load", expectation, arguments.load)
            .help("for example --load 0.2: a fifth of it at most"));
    }
    Ok(())
}

/// Name of the crate: that of the rig as far as a package may have it.
fn name(rig: &str) -> String {
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() {
            c.to_ascii_lowercase()
        } else {
            '-'
        }
    };
    let name: String = rig.chars().map(plain).collect();
    let name = name
        .trim_matches(|c: char| !c.is_ascii_alphabetic())
        .to_owned();
    if name.is_empty() {
        "policy".into()
    } else {
        name
    }
}

/// Median, the lower one of two, and largest.
fn middle(errors: &[f64]) -> (f64, f64) {
    let mut sorted = errors.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1);
    (sorted[last / 2], sorted[last])
}

fn said(arguments: &Arguments, task: &ControlProblem, plant: &Plant, found: &Imitation) {
    let said = Said::beside([arguments.json.as_deref()], arguments.quiet);
    let units: Vec<&str> = task.units(plant).collect();
    let one = units.iter().all(|unit| *unit == units[0]);
    let length = |value: f64| quantity(value, if one { units[0] } else { "" });
    let judged = count(found.policy.len(), "plant");
    let weights = found.spec.network.parameters().to_string();
    let row = |name: &str, errors: &[f64]| {
        let (median, worst) = middle(errors);
        let length = |value: f64| {
            if value.is_finite() {
                length(value)
            } else {
                "diverges".into()
            }
        };
        [name.into(), length(median), length(worst), weights.clone()]
    };
    let mut table = Table::new("", ["controller", "RMS error", "worst plant", "weights"]);
    table = table.row(row("policy", &found.policy));
    if let Some(errors) = &found.cloning {
        table = table.row(row("cloning", errors));
    }
    said.line(format!(
        "the motion on {judged} that taught nothing, with noise:"
    ));
    said.line(table.text().trim_end());
    let commands = arguments.out.join(COMMANDS);
    said.line(format!(
        "commands of the rig as written in {}: {} from the demonstration (RMS)",
        commands.display(),
        length(found.miss)
    ));
    said.next(format!("sinew emit {} --out DIR", arguments.out.display()));
}

/// `sinew-imitation/1`.
fn document(arguments: &Arguments, task: &ControlProblem, found: &Imitation) -> Value {
    let errors = |errors: &[f64]| {
        let finite = errors
            .iter()
            .map(|error| error.is_finite().then_some(*error));
        json!({ "rms": finite.collect::<Vec<_>>() })
    };
    json!({
        "format": "sinew-imitation/1",
        "rig": arguments.rig,
        "demonstration": arguments.demo,
        "folder": arguments.out,
        "rows": task.reference.rows.len(),
        "period_s": task.period_s,
        "weights": found.spec.network.parameters(),
        "seed": arguments.seed,
        "spread": arguments.fleet.is_none().then_some(arguments.spread),
        "fleet": arguments.fleet,
        "load": arguments.load,
        "commands_rms": found.miss,
        "policy": errors(&found.policy),
        "cloning": found.cloning.as_deref().map(errors),
    })
}

/// Folder of a policy.
pub(super) fn is_policy(folder: &Path) -> bool {
    folder.join(POLICY_FILE).is_file()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_a_rig_becomes_one_of_a_package() {
        let names = ["Mass on a spring", "2-mass drive", "42", "hasel"].map(name);
        assert_eq!(names, ["mass-on-a-spring", "mass-drive", "policy", "hasel"]);
    }
}
