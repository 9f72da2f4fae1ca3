//! `cargo xtask experiments imitate`: a policy of one demonstration beside the controller that
//! demonstrated (docs/evaluation/imitation.md).
//!
//! The expert is the predictive controller of the published mass, trained and tuned as there. Its
//! loop on the rig as written is the demonstration, positions alone. Ten other plants judge.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::Value;
use sinew_nn::footprint::probe;
use sinew_nn::store;

use super::problems::MASS;
use super::published::Run;
use crate::figure::{Row, middle, millimetres};
use xtask::process::{self, root};

/// Its name on the command line.
pub const NAME: &str = "imitate";

const EXPERT: &str = "horizon-12";
/// Policies, each with a seed of its own.
const SEEDS: u64 = 3;
/// Errors beside the expert's that are aimed at: median, worst plant.
const AIMED: (f64, f64) = (1.08, 1.15);
/// Instructions of a step that are aimed at.
const INSTRUCTIONS: u64 = 2500;
/// Largest errors of tanh with which a policy is printed.
const TOLERANCES: [&str; 2] = ["2e-6", "1e-4"];
/// Loads that the policies learn with: none, and that of the published loops.
const LOADS: [&str; 2] = ["0", "0.2"];

/// Answers for a seed; everything lies in target/experiments/mass-spring-damper.
///
/// # Errors
/// Setup, or the exit status of `sinew`.
pub fn run(seed: u64) -> Result<()> {
    let run = Run::prepared(&MASS, seed, &[EXPERT.into()])?;
    let variant = run.variants.first().context("no controller")?;
    run.controller(variant)?;
    let study = Study {
        rig: run.bench.path(&format!("{EXPERT}.toml")),
        model: run.model(variant),
        run,
        seed,
    };
    study.demonstrate()?;
    let [calm, pushed] = [study.teach(LOADS[0])?, study.teach(LOADS[1])?];
    let nominal = study.run.bench.path("nominal.toml");
    let loops = [("--delay", "0"), ("--disturbance", "none")];
    study.beside(
        "ten plants as the rig says, no load",
        &nominal,
        &calm,
        loops,
    )?;
    let real = study.run.bench.path("real.toml");
    let loops = [("--delay", MASS.delay), ("--disturbance", MASS.disturbance)];
    let name = "ten plants that rub, a load and a delay, which nobody knows";
    study.beside(name, &real, &pushed, loops)?;
    TOLERANCES
        .iter()
        .try_for_each(|tolerance| study.count(&calm[0], tolerance))
}

struct Study<'a> {
    run: Run<'a>,
    rig: PathBuf,
    model: PathBuf,
    seed: u64,
}

impl Study<'_> {
    /// The expert's loop on the rig as written: with its commands, and positions alone.
    fn demonstrate(&self) -> Result<()> {
        let bench = &self.run.bench;
        let mut compare = bench.sinew("compare", &self.rig);
        compare.arg(&self.model);
        self.run.recordings(&mut compare);
        compare.arg("--plant").arg(bench.path("nominal.toml"));
        compare.args(["--evaluations", "20", "--quiet", "--seed"]);
        compare.arg(self.seed.to_string()).arg("--recording");
        compare.arg(bench.path("demonstration.csv")).arg("--out");
        process::run(compare.arg(bench.path("firmware")))?;
        let text = bench.text(&bench.path("demonstration.csv"))?;
        let header: Vec<&str> = text
            .lines()
            .next()
            .context("no header")?
            .split(',')
            .collect();
        let kept = |line: &str| {
            let cells = line.split(',').zip(&header);
            let cells: Vec<&str> = cells
                .filter(|(_, n)| **n != "u_N")
                .map(|(c, _)| c)
                .collect();
            cells.join(",") + "\n"
        };
        let positions: String = text.lines().map(kept).collect();
        bench.write("positions.csv", &positions).map(drop)
    }

    /// Policies of positions alone, and what cloning reaches with the commands.
    fn teach(&self, load: &str) -> Result<Vec<PathBuf>> {
        let bench = &self.run.bench;
        let mut policies = Vec::new();
        for k in 0..SEEDS {
            let seed = (self.seed + k).to_string();
            let name = format!("policy-{load}-{seed}");
            let teach = |demonstration: &str, out: &Path| {
                let mut imitate = bench.sinew("imitate", &self.rig);
                imitate.arg("--demo").arg(bench.path(demonstration));
                imitate.args(["--load", load, "--seed", &seed]);
                imitate.arg("--out").arg(out).arg("--json");
                imitate.arg(bench.path(&format!("{name}.json")));
                process::run(&mut imitate)
            };
            let folder = bench.path(&name);
            if k == 0 {
                // Its table has a row of cloning, on the same plants.
                teach("demonstration.csv", &bench.path("with-commands"))?;
            }
            teach("positions.csv", &folder)?;
            policies.push(folder);
        }
        Ok(policies)
    }

    /// Expert and policies in the same loops.
    fn beside(
        &self,
        name: &str,
        plant: &Path,
        policies: &[PathBuf],
        conditions: [(&str, &str); 2],
    ) -> Result<()> {
        let bench = &self.run.bench;
        let mut compare = bench.sinew("compare", &self.rig);
        compare.arg(&self.model);
        for policy in policies {
            compare.arg("--policy").arg(policy);
        }
        self.run.recordings(&mut compare);
        compare
            .arg("--plant")
            .arg(plant)
            .args(["--draws", "10", "--spread", "0.2"]);
        for (flag, value) in conditions {
            compare.args([flag, value]);
        }
        compare.args(["--evaluations", "20", "--quiet", "--seed"]);
        compare
            .arg(self.seed.to_string())
            .arg("--out")
            .arg(bench.path("firmware"));
        process::run(compare.arg("--json").arg(bench.path("imitation.json")))?;
        let found = bench.json("imitation.json")?;
        let controllers = found["controllers"].as_array().context("no controllers")?;
        println!(
            "\n{name}\n| controller | RMS error, worst plant | beside the expert |\n|---|--:|--:|"
        );
        let expert = Row::of(controllers.first().context("no expert")?)?;
        let (median, worst) = middle(&expert.rms);
        for controller in controllers {
            let row = Row::of(controller)?;
            let own = middle(&row.rms);
            let outside = outside_limits(controller);
            let reached = own.0 <= AIMED.0 * median && own.1 <= AIMED.1 * worst;
            let verdict = if reached && outside == 0 {
                ""
            } else {
                ", MISSED"
            };
            println!(
                "| {} | {}, {} | {:.2}, {:.2}{verdict} |",
                row.name,
                millimetres(own.0),
                millimetres(own.1),
                own.0 / median,
                own.1 / worst,
            );
        }
        Ok(())
    }

    /// Instructions of a step with its limits, counted in QEMU over a hundred steps.
    fn count(&self, policy: &Path, tolerance: &str) -> Result<()> {
        let bench = &self.run.bench;
        let sources = bench.path("policy-sources");
        let mut emit = bench.sinew("emit", policy);
        emit.args(["--tanh-tolerance", tolerance]);
        process::run(emit.arg("--out").arg(&sources))?;
        let network = store::load(&root().join(policy))?;
        let workspace = root().join(bench.path("counted"));
        probe::write(&workspace)?;
        let write = |path: &str, text: &str| -> Result<()> {
            let path = workspace.join(path);
            if let Some(folder) = path.parent() {
                fs::create_dir_all(folder)?;
            }
            fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
        };
        let package = root().join(&sources).join("policy");
        let manifest = fs::read_to_string(package.join("Cargo.toml"))?;
        let named = manifest
            .lines()
            .find_map(|line| line.strip_prefix("name = "));
        let name = named.context("the policy's crate has no name")?;
        write(
            "Cargo.toml",
            "[workspace]\nresolver = \"3\"\nmembers = [\"cases\", \"image\"]\n\n\
             [profile.release]\nlto = \"fat\"\ncodegen-units = 1\npanic = \"abort\"\n",
        )?;
        write(
            "cases/Cargo.toml",
            &format!(
                "[package]\nname = \"cases\"\nedition = \"2024\"\nversion = \"0.0.0\"\n\n\
                 [dependencies]\npolicy = {{ package = {name}, path = {package:?} }}\n"
            ),
        )?;
        write("cases/src/bench.rs", probe::BENCH)?;
        write("cases/src/lib.rs", CASES)?;
        let said = probe::run(&probe::build(&workspace)?)?;
        let costs = said.lines().filter_map(|line| {
            let mut words = line.strip_prefix("cost step ")?.split(' ');
            Some((words.next()?.parse().ok()?, words.next()?.parse().ok()?))
        });
        let costs: Vec<(u64, u64)> = costs.collect();
        let most = costs
            .iter()
            .map(|cost| cost.0)
            .max()
            .context("no step was counted")?;
        let stack = costs.iter().map(|cost| cost.1).max().unwrap_or(0);
        let mean = costs.iter().map(|cost| cost.0).sum::<u64>() / costs.len() as u64;
        let verdict = if most <= INSTRUCTIONS {
            "reached"
        } else {
            "MISSED"
        };
        println!(
            "\n{verdict}: tanh within {tolerance}, {} weights: {mean} instructions a step, {most} at most of {} steps \
             ({INSTRUCTIONS} aimed at), {stack} B of stack, limits included",
            network.parameters(),
            costs.len()
        );
        Ok(())
    }
}

/// Commands outside limits over all loops of a controller.
fn outside_limits(controller: &Value) -> u64 {
    let loops = controller["loops"].as_array();
    let each = loops.into_iter().flatten();
    each.filter_map(|one| one["outside_limits"].as_u64()).sum()
}

/// The crate that is counted: a reference that swings, and a reading of it.
const CASES: &str = "//! A policy, measured step by step.
#![no_std]

use core::hint::black_box;

use policy::{AHEAD, OUTPUTS, Policy};

mod bench;
pub use bench::Bench;

/// Measures a hundred steps.
pub fn run(bench: &mut dyn Bench) {
    let mut policy = Policy::new();
    for k in 0..100 {
        let y = [0.002 * (k % 37) as f32; OUTPUTS];
        let reference = [[0.002 * (k % 41) as f32; OUTPUTS]; AHEAD];
        bench.measure(\"step\", &mut || {
            let _ = black_box(policy.step(black_box(&y), black_box(&reference)));
        });
    }
}
";
