//! `cargo xtask experiments mended`: does a controller gain from `sinew diagnose`? (docs/mended.md)
//!
//! Everything goes through the program as a user would call it. The real rig is seen by what writes the recordings and by the
//! plant of the loop, and by the tuning of PID and RISE; fit, diagnosis, training and the tuning of every MPC see recordings and the
//! believed rig.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result};
use serde_json::{Value, json};

use crate::process::{self, cargo, root, target_folder};
use crate::setup::{self, Extent, Toolchain};

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
    let begun = Instant::now();
    let bench = Bench {
        toolchain: setup::run(Extent::Build)?,
        out: "target/experiments/mended".into(),
        seed,
    };
    process::run(&mut cargo(&["build", "--package", "sinew"]))?;
    // Paths are relative to the checkout: what is printed can be typed again.
    fs::create_dir_all(root().join(&bench.out))
        .with_context(|| format!("cannot make {}", bench.out.display()))?;
    for (k, role) in (0..).zip(["fit", "check", "test"]) {
        bench.record(role, 3 * seed + k)?;
    }
    bench.rigs()?;
    let names = ["MPC-believed", "MPC-refitted", "MPC-mended"];
    for name in names {
        bench.controller(name)?;
    }
    bench.compare(&names)?;
    bench.summary(begun)
}

struct Bench {
    toolchain: Toolchain,
    out: PathBuf,
    seed: u64,
}

impl Bench {
    fn path(&self, name: &str) -> PathBuf {
        self.out.join(name)
    }

    /// A verb of `sinew`; `rig` is what it is about.
    fn sinew(&self, verb: &str, rig: &Path) -> Command {
        let mut command = Command::new(target_folder().join("debug/sinew"));
        command.arg(verb).arg(rig).current_dir(root());
        // Shared with the demo's and the tests' boards: embassy is compiled once.
        if std::env::var_os("SINEW_BUILD_DIR").is_none() {
            command.env("SINEW_BUILD_DIR", root().join("target/boards"));
        }
        self.toolchain.equip(&mut command);
        command
    }

    /// Inputs that the believed rig's limits allow, and what the real one answers.
    fn record(&self, role: &str, seed: u64) -> Result<()> {
        let (inputs, recording) = (self.path("inputs.csv"), self.path(&format!("{role}.csv")));
        let seed = seed.to_string();
        let mut excite = self.sinew("excite", Path::new(BELIEVED));
        excite
            .arg("--out")
            .arg(&inputs)
            .args(["--seconds", SECONDS]);
        process::run(excite.args(["--no-table", "--quiet", "--seed", &seed]))?;
        let mut simulate = self.sinew("simulate", Path::new(REAL));
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
        let copy = self.path("MPC-believed.toml");
        fs::copy(root().join(believed), root().join(&copy))
            .with_context(|| format!("cannot write {}", copy.display()))?;
        let mut fit = self.sinew("fit", believed);
        self.recordings(&mut fit);
        fit.arg("--out").arg(self.path("MPC-refitted.toml"));
        process::run(fit.arg("--quiet"))?;
        let mut diagnose = self.sinew("diagnose", believed);
        for role in ["fit", "check", "test"] {
            diagnose
                .arg(format!("--{role}"))
                .arg(self.path(&format!("{role}.csv")));
        }
        diagnose.arg("--rig-out").arg(self.path("MPC-mended.toml"));
        diagnose.arg("--json").arg(self.path("diagnosis.json"));
        diagnose.arg("--report").arg(self.path("diagnosis.html"));
        process::run(&mut diagnose)
    }

    /// What fits and trains: as many recordings as the diagnosis has.
    fn recordings(&self, command: &mut Command) {
        for role in ["fit", "check"] {
            command.arg("--fit").arg(self.path(&format!("{role}.csv")));
        }
        command.arg("--test").arg(self.path("test.csv"));
    }

    /// A network for a rig, and its controller's weights, tuned on that rig and rigs near it.
    fn controller(&self, name: &str) -> Result<()> {
        let rig = self.path(&format!("{name}.toml"));
        let (model, seed) = (self.path("trained").join(name), self.seed.to_string());
        let mut train = self.sinew("train", &rig);
        self.recordings(&mut train);
        train.arg("--out").arg(&model);
        process::run(train.args(["--seed", &seed]))?;
        let mut tune = self.sinew("tune", &rig);
        tune.arg(&model);
        self.recordings(&mut tune);
        tune.arg("--out")
            .arg(self.path(&format!("{name}.tuned.toml")));
        tune.arg("--model-out").arg(self.path("models").join(name));
        process::run(tune.args(["--mpc-only", "--seed", &seed]))
    }

    fn compare(&self, names: &[&str]) -> Result<()> {
        let mut compare = self.sinew("compare", Path::new(BELIEVED));
        for name in names {
            compare.arg(self.path("models").join(name));
        }
        self.recordings(&mut compare);
        compare.arg("--out").arg(self.path("firmware"));
        compare.args(["--plant", REAL, "--loops", LOOPS, "--board", "qemu"]);
        for (flag, file) in [
            ("--json", "comparison.json"),
            ("--report", "report.html"),
            ("--plot", "error.svg"),
        ] {
            compare.arg(flag).arg(self.path(file));
        }
        process::run(compare.args(["--seed", &self.seed.to_string()]))
    }

    /// summary.json: what was found, and the comparison.
    fn summary(&self, begun: Instant) -> Result<()> {
        let read = |name: &str| -> Result<Value> {
            let path = root().join(self.path(name));
            let text = fs::read_to_string(&path);
            let text = text.with_context(|| format!("cannot read {}", path.display()))?;
            serde_json::from_str(&text).with_context(|| format!("{} is no JSON", path.display()))
        };
        let summary = json!({
            "format": "sinew-experiment-mended/1",
            "diagnosis": read("diagnosis.json")?,
            "comparison": read("comparison.json")?,
            "seconds": begun.elapsed().as_secs_f64(),
        });
        let path = self.path("summary.json");
        let text = serde_json::to_string_pretty(&summary)? + "\n";
        fs::write(root().join(&path), text)
            .with_context(|| format!("cannot write {}", path.display()))?;
        println!("{}: {:.0} s", path.display(), begun.elapsed().as_secs_f64());
        Ok(())
    }
}
