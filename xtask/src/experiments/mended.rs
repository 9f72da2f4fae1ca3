//! `cargo xtask experiments mended`: does a controller gain from `sinew diagnose`? (docs/mended.md)
//!
//! Everything goes through the program as a user would call it. The real rig is seen by what writes the recordings and by the
//! plant of the loop, and by the tuning of PID and RISE; fit, diagnosis, training and the tuning of every MPC see recordings and the
//! believed rig.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};
use serde_json::json;

use super::bench::Bench;
use crate::process::{self, root};

const BELIEVED: &str = "rigs/experiments/flexure-stage.toml";
const REAL: &str = "rigs/experiments/flexure-stage.real.toml";
/// Noise of the recordings and so of the loops, as a part of what the position ranges over.
const NOISE: &str = "0.001";
const SECONDS: &str = "20";
const LOOPS: &str = "9";

/// Answers for a seed; everything lies in target/experiments/mended.
///
/// # Errors
/// Setup, or the exit status of `sinew`.
pub fn run(seed: u64) -> Result<()> {
    let bench = Mended(Bench::new("mended", seed)?);
    for (k, role) in (0..).zip(["fit", "check", "test"]) {
        bench.record(role, 3 * seed + k)?;
    }
    bench.rigs()?;
    let names = ["MPC-believed", "MPC-refitted", "MPC-mended"];
    for name in names {
        bench.controller(name)?;
    }
    bench.compare(&names)?;
    bench.summary()
}

struct Mended(Bench);

impl Mended {
    /// Inputs that the believed rig's limits allow, and what the real one answers.
    fn record(&self, role: &str, seed: u64) -> Result<()> {
        let (inputs, recording) = (
            self.0.path("inputs.csv"),
            self.0.path(&format!("{role}.csv")),
        );
        let seed = seed.to_string();
        let mut excite = self.0.sinew("excite", Path::new(BELIEVED));
        excite
            .arg("--out")
            .arg(&inputs)
            .args(["--seconds", SECONDS]);
        process::run(excite.args(["--no-table", "--quiet", "--seed", &seed]))?;
        let mut simulate = self.0.sinew("simulate", Path::new(REAL));
        simulate
            .arg("--input")
            .arg(&inputs)
            .arg("--out")
            .arg(recording);
        simulate.args(["--with-inputs", "--noise", NOISE, "--quiet"]);
        process::run(simulate.args(["--seed", &seed]))
    }

    /// The three rigs that the controllers know: as written, refitted to the recordings, mended by the diagnosis.
    fn rigs(&self) -> Result<()> {
        let believed = Path::new(BELIEVED);
        let copy = self.0.path("MPC-believed.toml");
        fs::copy(root().join(believed), root().join(&copy))
            .with_context(|| format!("cannot write {}", copy.display()))?;
        let mut fit = self.0.sinew("fit", believed);
        self.recordings(&mut fit);
        fit.arg("--out").arg(self.0.path("MPC-refitted.toml"));
        process::run(fit.arg("--quiet"))?;
        let mut diagnose = self.0.sinew("diagnose", believed);
        for role in ["fit", "check", "test"] {
            diagnose
                .arg(format!("--{role}"))
                .arg(self.0.path(&format!("{role}.csv")));
        }
        diagnose
            .arg("--rig-out")
            .arg(self.0.path("MPC-mended.toml"));
        diagnose.arg("--json").arg(self.0.path("diagnosis.json"));
        diagnose.arg("--report").arg(self.0.path("diagnosis.html"));
        process::run(&mut diagnose)
    }

    /// What fits and trains: as many recordings as the diagnosis has.
    fn recordings(&self, command: &mut Command) {
        for role in ["fit", "check"] {
            command
                .arg("--fit")
                .arg(self.0.path(&format!("{role}.csv")));
        }
        command.arg("--test").arg(self.0.path("test.csv"));
    }

    /// A network for a rig, and its controller's weights, tuned on that rig and rigs near it.
    fn controller(&self, name: &str) -> Result<()> {
        let rig = self.0.path(&format!("{name}.toml"));
        let (model, seed) = (self.0.path("trained").join(name), self.0.seed.to_string());
        let mut train = self.0.sinew("train", &rig);
        self.recordings(&mut train);
        train.arg("--out").arg(&model);
        process::run(train.args(["--seed", &seed]))?;
        let mut tune = self.0.sinew("tune", &rig);
        tune.arg(&model);
        self.recordings(&mut tune);
        tune.arg("--out")
            .arg(self.0.path(&format!("{name}.tuned.toml")));
        tune.arg("--model-out")
            .arg(self.0.path("models").join(name));
        process::run(tune.args(["--mpc-only", "--seed", &seed]))
    }

    fn compare(&self, names: &[&str]) -> Result<()> {
        let mut compare = self.0.sinew("compare", Path::new(BELIEVED));
        for name in names {
            compare.arg(self.0.path("models").join(name));
        }
        self.recordings(&mut compare);
        compare.arg("--out").arg(self.0.path("firmware"));
        compare.args(["--plant", REAL, "--loops", LOOPS, "--board", "qemu"]);
        for (flag, file) in [
            ("--json", "comparison.json"),
            ("--report", "report.html"),
            ("--plot", "error.svg"),
        ] {
            compare.arg(flag).arg(self.0.path(file));
        }
        process::run(compare.args(["--seed", &self.0.seed.to_string()]))
    }

    /// summary.json: what was found, and the comparison.
    fn summary(&self) -> Result<()> {
        self.0.summary(json!({
            "format": "sinew-experiment-mended/1",
            "diagnosis": self.0.json("diagnosis.json")?,
            "comparison": self.0.json("comparison.json")?,
        }))
    }
}
