//! The published problems, run again (docs/evaluation/published.md): from the nominal rig to
//! firmware in QEMU, on plants that the controller has not seen.
//!
//! Training and tuning see the nominal rig and recordings simulated with it, nothing else. The
//! plants are the nominal rig with what [`Problem::left_out`] adds, every free parameter drawn
//! within 20 %, one a loop, with noise and a delay.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};

use super::bench::Bench;
use super::problem::{Knowledge, Problem, Variant};
use super::problems::without_preview;
use super::targets::{Target, estimate, for_size, said};
use crate::figure::{Row, loops};
use xtask::process;

/// Noise of every sensor, as a part of what its signal ranges over.
pub const NOISE: &str = "0.005";
const SECONDS: &str = "30";
const DRAWS: &str = "10";
const SPREAD: &str = "0.2";

/// Answers for a seed; everything lies in target/experiments/NAME. With names in `only`, those
/// controllers alone, on the same plants, without PID, RISE and targets.
///
/// # Errors
/// A controller that there is not, setup, or the exit status of `sinew`.
pub fn run(problem: &Problem, seed: u64, only: &[String]) -> Result<()> {
    let run = Run::prepared(problem, seed, only)?;
    if run.variants.iter().any(|v| v.knows == Knowledge::Corrected) {
        run.correct()?;
    }
    for variant in run.variants.iter().filter(|v| v.small.is_none()) {
        run.controller(variant)?;
    }
    run.compare()?;
    run.conclude()
}

/// Every channel of the soft sensor of the controller `name` broken in every way, one after
/// another, on the ten plants of the problem (`sinew faults`).
///
/// # Errors
/// As [`run`].
pub fn faults(problem: &Problem, seed: u64, name: &str) -> Result<()> {
    let run = Run::prepared(problem, seed, &[name.into()])?;
    let variant = run.variants.first().context("no controller")?;
    run.controller(variant)?;
    run.faults(variant)
}

/// A rig without its tables `[control]` and `[network]`; effects that a diagnosis has put behind
/// them stay.
fn without_controller(rig: &str) -> String {
    let mut drops = false;
    let keeps = |line: &&str| {
        if line.starts_with('[') {
            drops = ["[control", "[network"]
                .iter()
                .any(|table| line.starts_with(table));
        }
        !drops
    };
    let lines: Vec<&str> = rig.lines().filter(keeps).collect();
    lines.join("\n") + "\n"
}

/// Arguments of `sinew excite`.
pub fn excited(problem: &Problem) -> [&'static str; 6] {
    [
        "--seconds",
        SECONDS,
        "--amplitude",
        problem.amplitude,
        "--kind",
        problem.kind,
    ]
}

/// The controllers that are asked for, all without a name, in the order of the problem.
fn chosen<'a>(problem: &'a Problem, only: &[String]) -> Result<Vec<&'a Variant>> {
    let all = problem.variants.iter();
    if let Some(name) = only
        .iter()
        .find(|name| all.clone().all(|v| v.name != **name))
    {
        let known: Vec<&str> = all.map(|v| v.name).collect();
        bail!(
            "{} has no controller '{name}'; there are {}",
            problem.name,
            known.join(", ")
        );
    }
    let asked = |name: &str| only.is_empty() || only.iter().any(|other| other == name);
    let chosen: Vec<&Variant> = all.filter(|v| asked(v.name)).collect();
    for variant in &chosen {
        // What an earlier run has left may be of another seed.
        if let Some(of) = variant.network_of.or(variant.small)
            && !asked(of)
        {
            bail!(
                "'{}' has the network of '{of}': --controllers {of},{}",
                variant.name,
                only.join(",")
            );
        }
    }
    Ok(chosen)
}

/// One problem under way.
pub(super) struct Run<'a> {
    pub(super) bench: Bench,
    pub(super) problem: &'a Problem,
    /// The controllers of this run.
    pub(super) variants: Vec<&'a Variant>,
    /// Start of its files' names where it has not all of them.
    pub(super) part: &'static str,
}

impl<'p> Run<'p> {
    /// The chosen controllers, with rigs, paths and recordings.
    pub(super) fn prepared(problem: &'p Problem, seed: u64, only: &[String]) -> Result<Self> {
        let variants = chosen(problem, only)?;
        let run = Run {
            bench: Bench::new(problem.name, seed)?,
            problem,
            variants,
            part: match only {
                [] => "",
                _ => "chosen-",
            },
        };
        run.prepare()?;
        Ok(run)
    }

    /// Rigs, paths, and recordings of the nominal rig.
    pub(super) fn prepare(&self) -> Result<()> {
        let (bench, problem) = (&self.bench, self.problem);
        let tail = bench.text(Path::new(problem.left_out))?;
        let mut nominal = bench.text(Path::new(problem.nominal))?;
        let end = nominal.find("[control]").unwrap_or(nominal.len());
        nominal.insert_str(end, problem.known);
        bench.write("nominal.toml", &nominal)?;
        bench.write("real.toml", &format!("{nominal}\n{tail}"))?;
        if let Some([asked, tuning]) = problem.paths {
            bench.write("path.csv", &asked())?;
            bench.write("tuning-path.csv", &tuning())?;
        }
        let seeds = (0..).map(|k| 10 * bench.seed + k);
        for (name, seed) in ["fit", "test"].iter().zip(seeds) {
            self.record(&bench.path("nominal.toml"), name, seed)?;
        }
        Ok(())
    }

    /// Each channel broken, in the loops of the problem.
    fn faults(&self, variant: &Variant) -> Result<()> {
        let rig = self.bench.path(&format!("{}.toml", variant.name));
        let watched = self.bench.path("watched");
        let mut calibrate = self.bench.sinew("calibrate", &rig);
        calibrate.arg(self.model(variant)).arg("--watch");
        for recording in ["fit.csv", "test.csv"] {
            calibrate.arg("--fit").arg(self.bench.path(recording));
        }
        process::run(calibrate.arg("--out").arg(&watched))?;
        let mut faults = self.bench.sinew("faults", &rig);
        faults.arg(&watched);
        self.recordings(&mut faults);
        if self.problem.paths.is_some() {
            faults.arg("--reference").arg(self.bench.path("path.csv"));
        }
        faults.arg("--plant").arg(self.bench.path("real.toml"));
        faults.args(["--draws", DRAWS, "--spread", SPREAD]);
        faults.args(["--delay", self.problem.delay]);
        if let Some((_, until)) = self.problem.judged.and_then(|j| j.split_once(',')) {
            faults.args(["--until", until]);
        }
        faults.args(["--seed", &self.bench.seed.to_string()]);
        faults.args(["--board", "qemu", "--out"]);
        faults.arg(self.bench.path("firmware-faults"));
        faults.arg("--json").arg(self.bench.path("faults.json"));
        process::run(&mut faults)
    }

    /// Inputs that the nominal rig's limits allow, and what `rig` answers.
    fn record(&self, rig: &Path, name: &str, seed: u64) -> Result<()> {
        let seed = seed.to_string();
        let nominal = self.bench.path("nominal.toml");
        let wanted = excited(self.problem);
        let inputs = self.bench.inputs(&nominal, &wanted, &seed)?;
        let mut simulate = self.bench.sinew("simulate", rig);
        simulate.arg("--input").arg(&inputs).arg("--out");
        simulate.arg(self.bench.path(&format!("{name}.csv")));
        simulate.args(["--with-inputs", "--noise", NOISE, "--quiet"]);
        process::run(simulate.args(["--seed", &seed]))
    }

    /// The nominal rig, corrected by recordings of the plant in the middle.
    fn correct(&self) -> Result<()> {
        let real = self.bench.path("real.toml");
        for (k, name) in (5..).zip(["real-fit", "real-check", "real-test"]) {
            self.record(&real, name, 10 * self.bench.seed + k)?;
        }
        let mut diagnose = self
            .bench
            .sinew("diagnose", &self.bench.path("nominal.toml"));
        for role in ["fit", "check", "test"] {
            let recording = self.bench.path(&format!("real-{role}.csv"));
            diagnose.arg(format!("--{role}")).arg(recording);
        }
        diagnose
            .arg("--rig-out")
            .arg(self.bench.path("corrected.toml"));
        process::run(
            diagnose
                .arg("--json")
                .arg(self.bench.path("diagnosis.json")),
        )
    }

    pub(super) fn recordings(&self, command: &mut Command) {
        for role in ["fit", "test"] {
            command
                .arg(format!("--{role}"))
                .arg(self.bench.path(&format!("{role}.csv")));
        }
    }

    /// A network, and the weights of its controller.
    pub(super) fn controller(&self, variant: &Variant) -> Result<()> {
        let (rig, model) = self.trained(variant)?;
        let mut tune = self.tuning(&rig, &model);
        tune.args(["--disturbance", self.problem.disturbance]);
        tune.args(["--evaluations", self.problem.evaluations.0]);
        tune.args(variant.tune);
        tune.arg("--out")
            .arg(self.bench.path(&format!("{}.tuned.toml", variant.name)));
        tune.arg("--model-out").arg(self.model(variant));
        process::run(&mut tune)
    }

    /// A rig with the tables of a controller, and its network.
    pub(super) fn trained(&self, variant: &Variant) -> Result<(PathBuf, PathBuf)> {
        println!("{}: {}", self.problem.name, variant.name);
        let known = match variant.knows {
            Knowledge::Nominal => self.bench.path("nominal.toml"),
            Knowledge::Corrected => self.bench.path("corrected.toml"),
        };
        let mut text = self.bench.text(&known)?;
        if let Some(tables) = variant.tables {
            text = without_controller(&text) + tables;
        }
        let rig = self.bench.write(&format!("{}.toml", variant.name), &text)?;
        let trained = self.bench.path("trained");
        let model = trained.join(variant.network_of.unwrap_or(variant.name));
        if let Some(file) = variant.imported {
            let mut import = self.bench.sinew("import", Path::new(file));
            import.arg("--rig").arg(&rig);
            self.recordings(&mut import);
            process::run(import.arg("--out").arg(&model))?;
        } else if variant.network_of.is_none() {
            let mut train = self.bench.sinew("train", &rig);
            self.recordings(&mut train);
            train.arg("--out").arg(&model);
            let record = self.bench.path(&format!("{}.training.json", variant.name));
            train.arg("--json").arg(record);
            process::run(train.args(["--seed", &self.bench.seed.to_string()]))?;
        }
        Ok((rig, model))
    }

    /// `sinew tune` of the MPC alone, on the path for tuning.
    pub(super) fn tuning(&self, rig: &Path, model: &Path) -> Command {
        let mut tune = self.bench.sinew("tune", rig);
        tune.arg(model);
        self.recordings(&mut tune);
        if self.problem.paths.is_some() {
            let path = self.bench.path("tuning-path.csv");
            tune.arg("--reference").arg(path);
        }
        tune.args(["--mpc-only", "--seed", &self.bench.seed.to_string()]);
        tune
    }

    pub(super) fn model(&self, variant: &Variant) -> PathBuf {
        self.bench.path("models").join(variant.model())
    }

    /// All of them on the same plants: what a channel is, the rig says, so those with channels have
    /// a call of their own, and so have images made for size.
    fn compare(&self) -> Result<()> {
        let mut groups: Vec<(String, Vec<&Variant>)> = Vec::new();
        for variant in &self.variants {
            let channels = variant.tables.and_then(|tables| {
                let asks = |line: &&str| {
                    ["channels", "sensed_by"]
                        .iter()
                        .any(|key| line.starts_with(key))
                };
                let line = tables.lines().find(asks);
                line.map(String::from)
            });
            let key = match variant.small {
                Some(_) => variant.name.into(),
                None => channels.unwrap_or_default(),
            };
            match groups.iter_mut().find(|(of, _)| *of == key) {
                Some((_, group)) => group.push(variant),
                None => groups.push((key, vec![variant])),
            }
        }
        for (k, (_, group)) in groups.iter().enumerate() {
            self.compare_group(k, group)?;
        }
        let textbook = match &groups[..] {
            [(_, group), ..] if self.problem.textbook && self.part.is_empty() => {
                self.without_preview(group)?
            }
            _ => Vec::new(),
        };
        let part = self.part;
        let mut whole = self.bench.json(&format!("{part}comparison.json"))?;
        if !part.is_empty()
            && let Some(all) = whole["controllers"].as_array_mut()
        {
            all.retain(|c| !is_baseline(c));
        }
        if let Some([(_, group), ..]) = groups.get(..1)
            && let [variant] = group[..]
            && let Some(first) = whole.pointer_mut("/controllers/0")
        {
            // One model alone is called MPC.
            first["name"] = variant.name.into();
        }
        for (k, (_, group)) in groups.iter().enumerate().skip(1) {
            let mut more = self.bench.json(&format!("{part}comparison-{k}.json"))?;
            let more = more["controllers"].as_array_mut().map(std::mem::take);
            if let (Some(all), Some(more)) = (whole["controllers"].as_array_mut(), more) {
                let names = group.iter().map(|variant| variant.name);
                let models = more.into_iter().filter(|c| !is_baseline(c));
                all.extend(models.zip(names).map(|(mut controller, name)| {
                    // One model alone is called MPC.
                    controller["name"] = name.into();
                    controller
                }));
            }
        }
        if let Some(all) = whole["controllers"].as_array_mut() {
            all.extend(textbook);
        }
        let text = serde_json::to_string_pretty(&whole)? + "\n";
        self.bench
            .write(&format!("{part}comparison.json"), &text)
            .map(drop)
    }

    /// `sinew compare` of some controllers in the loops of the problem.
    fn loops(&self, group: &[&Variant]) -> Option<Command> {
        let first = group.first()?;
        let rig = self.bench.path(&format!("{}.toml", first.model()));
        let models: Vec<PathBuf> = group.iter().map(|variant| self.model(variant)).collect();
        Some(self.loops_of(&rig, &models))
    }

    /// `sinew compare` of some models in the loops of the problem.
    pub(super) fn loops_of(&self, rig: &Path, models: &[PathBuf]) -> Command {
        let mut compare = self.bench.sinew("compare", rig);
        compare.args(models);
        self.recordings(&mut compare);
        if self.problem.paths.is_some() {
            compare.arg("--reference").arg(self.bench.path("path.csv"));
        }
        let real = self.bench.path("real.toml");
        compare.arg("--plant").arg(real);
        compare.args(["--draws", DRAWS, "--spread", SPREAD]);
        compare.args(["--delay", self.problem.delay]);
        if let Some(judged) = self.problem.judged {
            compare.args(["--judged", judged]);
        }
        compare.args(["--disturbance", self.problem.disturbance]);
        compare.args(["--seed", &self.bench.seed.to_string()]);
        compare
    }

    /// PID and RISE, tuned and run in the same loops, that see where the output should be now and
    /// no further.
    fn without_preview(&self, group: &[&Variant]) -> Result<Vec<Value>> {
        let first = group.get(..1).context("no controller")?;
        let mut compare = self.loops(first).context("no controller")?;
        compare.args(["--longest-lead", "0", "--board", "host", "--out"]);
        compare.arg(self.bench.path("firmware-without-preview"));
        let scores = "without-preview.json";
        process::run(compare.arg("--json").arg(self.bench.path(scores)))?;
        let mut all = self.bench.json(scores)?;
        let all = all["controllers"].as_array_mut().map(std::mem::take);
        let baselines = all.into_iter().flatten().filter(is_baseline);
        let named = baselines.map(|mut controller| {
            let name = controller["name"].as_str().unwrap_or_default();
            controller["name"] = without_preview(name).into();
            controller
        });
        Ok(named.collect())
    }

    fn compare_group(&self, k: usize, group: &[&Variant]) -> Result<()> {
        let (Some(mut compare), Some(first)) = (self.loops(group), group.first()) else {
            return Ok(());
        };
        let baselines = match k {
            0 if self.part.is_empty() => self.problem.evaluations.1,
            // PID and RISE are there already.
            _ => Some("20"),
        };
        if let Some(count) = baselines {
            compare.args(["--evaluations", count]);
        }
        if first.small.is_some() {
            compare.args(["--optimise", "size"]);
        }
        compare.args(["--board", "qemu", "--out"]);
        compare.arg(self.bench.path("firmware"));
        let nth = match k {
            0 => String::new(),
            k => format!("-{k}"),
        };
        for (flag, name, ending) in [
            ("--json", "comparison", "json"),
            ("--report", "report", "html"),
            ("--plot", "error", "svg"),
        ] {
            compare.arg(flag).arg(
                self.bench
                    .path(&format!("{}{name}{nth}.{ending}", self.part)),
            );
        }
        process::run(&mut compare)
    }

    /// summary.json, the figure, and the table of the page.
    fn conclude(&self) -> Result<()> {
        let part = self.part;
        let comparison = self.bench.json(&format!("{part}comparison.json"))?;
        let controllers = comparison["controllers"]
            .as_array()
            .context("a comparison without controllers")?;
        let mut rows = Vec::new();
        println!(
            "| | RMS error: median, worst | largest error: median, worst | free run | parameters | flash | instructions: mean, largest |"
        );
        println!("|---|---|---|---|---|---|---|");
        for controller in controllers {
            let row = Row::of(controller)?;
            let name = &row.name;
            let training = format!("{}.training.json", self.network_of(name));
            let free_run = match self.bench.json(&training) {
                Ok(record) => length(&record["horizon_rms"]),
                Err(_) => None,
            };
            println!("{}", row.line(controller, free_run));
            rows.push(row);
        }
        self.bench.write(
            &format!("{part}loops.svg"),
            &loops("RMS error of each of the ten loops", &rows),
        )?;
        // Of chosen controllers there is the image alone to be held against something.
        let mut targets = Vec::new();
        if part.is_empty() {
            targets.extend((self.problem.targets)(&comparison));
            targets.extend(estimate(&comparison, self.problem.rate_hz));
        }
        if let Some(small) = self.variants.iter().find(|v| v.small.is_some()) {
            let image = self.bench.control_image(&self.model(small))?;
            targets.extend(for_size(
                &comparison,
                small.name,
                image,
                self.problem.rate_hz,
            ));
        }
        targets
            .iter()
            .for_each(|target| println!("{}", said(target)));
        if !part.is_empty() {
            return Ok(());
        }
        self.bench.summary(json!({
            "format": "sinew-experiment-published/1",
            "seed": self.bench.seed,
            "comparison": comparison,
            "targets": targets.iter().map(Target::value).collect::<Vec<_>>(),
        }))
    }

    /// Whose network a controller has.
    fn network_of<'a>(&'a self, name: &'a str) -> &'a str {
        let of = |name: &str| self.problem.variants.iter().find(|v| v.name == name);
        let name = of(name).map_or(name, |variant| variant.model());
        of(name).and_then(|v| v.network_of).unwrap_or(name)
    }
}

/// True if it is PID or RISE, which every comparison has.
fn is_baseline(controller: &Value) -> bool {
    ["PID", "RISE"]
        .iter()
        .any(|name| controller["name"] == *name)
}

/// Of a list of errors, as one length.
fn length(values: &Value) -> Option<f64> {
    let values = values.as_array()?.iter().filter_map(Value::as_f64);
    Some(values.map(|v| v * v).sum::<f64>().sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_controller_with_anothers_network_is_not_run_without_it() {
        let names = |only: &[&str]| -> Result<Vec<&str>> {
            let only: Vec<String> = only.iter().map(ToString::to_string).collect();
            let chosen = chosen(&super::super::problems::TENDON, &only)?;
            Ok(chosen.iter().map(|v| v.name).collect())
        };
        for alone in ["horizon-1", "small"] {
            let error =
                names(&[alone]).expect_err("whose network it has, a run before may have left");
            assert!(
                error
                    .to_string()
                    .contains(&format!("--controllers 15-8-3,{alone}"))
            );
            assert_eq!(names(&[alone, "15-8-3"]).expect("both").len(), 2);
        }
        assert_eq!(
            names(&["corrected"]).expect("the corrected rig trains a network of its own"),
            ["corrected"]
        );
        assert!(names(&[]).expect("all").contains(&"horizon-1"));
    }

    #[test]
    fn a_variants_tables_replace_the_rigs_and_what_a_diagnosis_added_behind_them_stays() {
        let rig = "name = \"r\"\n\n[[body]]\nname = \"b\"\n\n[control]\nrate_hz = 120.0\n\n\
                   [control.weights]\nmoves = [1.0]\n[network]\nhidden = [8]\n\n\
                   [[effect]]\nkind = \"coulomb_friction\"\n";
        let kept =
            "name = \"r\"\n\n[[body]]\nname = \"b\"\n\n[[effect]]\nkind = \"coulomb_friction\"\n";
        assert_eq!(without_controller(rig), kept);
    }
}
