//! `cargo xtask experiments correction`, `mass-on-mujoco` and `tendon-on-mujoco`: does a controller
//! gain from recordings of the real rig, and from `sinew diagnose`? (docs/evaluation/correction.md,
//! docs/evaluation/published.md)
//!
//! Everything goes through the program as a user would call it. The real rig is seen by what writes
//! the recordings and by the plant of the loop, and by the tuning of PID and RISE; fit, diagnosis,
//! training and the tuning of every MPC see recordings and the nominal rig.

use std::path::Path;
use std::process::Command;

use anyhow::Result;
use serde_json::json;

use super::bench::Bench;
use super::problems::{EIGHT, TENDON_CALM};
use crate::figure::{Row, loops};
use crate::foreign::python;
use xtask::process;

/// A rig that its owner knows badly, and the real one.
pub struct Rehearsal {
    /// As on the command line, and the folder of its results.
    pub name: &'static str,
    /// Rig file of the owner.
    nominal: &'static str,
    /// Line at which the nominal rig's file ends, and the text that replaces the rest.
    tail: Option<(&'static str, &'static str)>,
    real: Real,
    /// Noise of the recordings and so of the loops, as a part of what each signal ranges over.
    noise: &'static str,
    /// Length of a recording, and how much of the inputs' range it uses.
    excite: &'static [&'static str],
    /// Reference, and what tuning follows backwards; without, the staircase.
    paths: Option<[fn() -> String; 2]>,
    /// Further arguments of `sinew tune`.
    tune: &'static [&'static str],
    /// Loops, and what they are run under.
    compare: &'static [&'static str],
}

/// Stand-in for the real rig.
enum Real {
    /// A rig file.
    Rig(&'static str),
    /// A module of tests/foreign: a plant for MuJoCo.
    MuJoCo(&'static str),
}

/// A stage whose leaves stiffen and whose guide rubs.
pub const STAGE: Rehearsal = Rehearsal {
    name: "correction",
    nominal: "rigs/experiments/flexure-stage.toml",
    tail: None,
    real: Real::Rig("rigs/experiments/flexure-stage.real.toml"),
    noise: "0.001",
    excite: &["--seconds", "20"],
    paths: None,
    tune: &[],
    compare: &["--loops", "9"],
};

/// The mass on a spring, as MuJoCo has it.
pub const MASS: Rehearsal = Rehearsal {
    name: "mass-on-mujoco",
    nominal: "rigs/mass-spring-damper.toml",
    real: Real::MuJoCo("plants.mass_spring_damper"),
    noise: "0.005",
    excite: &["--seconds", "30", "--amplitude", "0.3"],
    tune: &[
        "--evaluations",
        "120",
        "--disturbance",
        "step",
        "--horizons",
        "12",
        "--control-horizons",
        "4",
    ],
    compare: &[
        "--draws",
        "10",
        "--spread",
        "0.2",
        "--delay",
        "0.004",
        "--disturbance",
        "step",
        "--evaluations",
        "240",
    ],
    ..STAGE
};

/// The tendon platform, as MuJoCo has it: a chain of links, tendons from hole to hole that rub and
/// have slack.
pub const TENDON: Rehearsal = Rehearsal {
    name: "tendon-on-mujoco",
    nominal: "rigs/tendon.toml",
    // It has no fibres.
    tail: Some(("[[waveguide]]", TENDON_CALM)),
    real: Real::MuJoCo("plants.tendon"),
    noise: "0.005",
    excite: &["--seconds", "30", "--amplitude", "1"],
    paths: Some(EIGHT),
    tune: &[
        "--evaluations",
        "120",
        "--horizons",
        "10",
        "--control-horizons",
        "3",
        // The camera is a period late, which its owner knows: weights that were tuned without it
        // let the tip swing.
        "--delay",
        "0.008",
    ],
    compare: &[
        "--draws",
        "10",
        "--spread",
        "0.2",
        "--delay",
        "0.008",
        "--evaluations",
        "240",
    ],
};

/// Answers for a seed; everything lies in target/experiments/NAME.
///
/// # Errors
/// Setup, or the exit status of `sinew`.
pub fn run(rehearsal: &Rehearsal, seed: u64) -> Result<()> {
    let bench = Bench::new(rehearsal.name, seed)?;
    let real = match rehearsal.real {
        Real::Rig(path) => ["--plant".into(), path.into()],
        Real::MuJoCo(module) => [
            "--plant-program".into(),
            python::environment()?.line(module),
        ],
    };
    let run = Run {
        bench,
        rehearsal,
        real,
    };
    run.begin()?;
    for (k, role) in (0..).zip(["fit", "check", "test"]) {
        run.record(role, 3 * seed + k)?;
    }
    run.rigs()?;
    for name in NAMES {
        run.controller(name)?;
    }
    run.compare()?;
    run.summary()
}

/// Models of the controllers: the rig as written, refitted to the recordings, corrected by the
/// diagnosis.
const NAMES: [&str; 3] = ["MPC-nominal", "MPC-refitted", "MPC-corrected"];

struct Run<'a> {
    bench: Bench,
    rehearsal: &'a Rehearsal,
    /// Name of the real rig on a command line.
    real: [String; 2],
}

impl Run<'_> {
    /// The nominal rig and the paths.
    fn begin(&self) -> Result<()> {
        let mut text = self.bench.text(Path::new(self.rehearsal.nominal))?;
        if let Some((end, tail)) = self.rehearsal.tail {
            text.truncate(text.find(end).unwrap_or(text.len()));
            text += tail;
        }
        self.bench.write("MPC-nominal.toml", &text)?;
        if let Some([asked, tuning]) = self.rehearsal.paths {
            self.bench.write("path.csv", &asked())?;
            self.bench.write("tuning-path.csv", &tuning())?;
        }
        Ok(())
    }

    fn nominal(&self) -> std::path::PathBuf {
        self.bench.path("MPC-nominal.toml")
    }

    /// Inputs that the nominal rig's limits allow, and what the real one answers.
    fn record(&self, role: &str, seed: u64) -> Result<()> {
        let recording = self.bench.path(&format!("{role}.csv"));
        let seed = seed.to_string();
        let nominal = self.nominal();
        let inputs = self.bench.inputs(&nominal, self.rehearsal.excite, &seed)?;
        let mut simulate = match self.rehearsal.real {
            Real::Rig(rig) => self.bench.sinew("simulate", Path::new(rig)),
            Real::MuJoCo(_) => {
                let mut simulate = self.bench.sinew("simulate", &self.nominal());
                simulate.args(&self.real);
                simulate
            }
        };
        simulate
            .arg("--input")
            .arg(&inputs)
            .arg("--out")
            .arg(recording);
        simulate.args(["--with-inputs", "--noise", self.rehearsal.noise, "--quiet"]);
        process::run(simulate.args(["--seed", &seed]))
    }

    /// The rigs that the other two controllers know.
    fn rigs(&self) -> Result<()> {
        let mut fit = self.bench.sinew("fit", &self.nominal());
        self.recordings(&mut fit);
        fit.arg("--out").arg(self.bench.path("MPC-refitted.toml"));
        process::run(fit.arg("--quiet"))?;
        let mut diagnose = self.bench.sinew("diagnose", &self.nominal());
        for role in ["fit", "check", "test"] {
            diagnose
                .arg(format!("--{role}"))
                .arg(self.bench.path(&format!("{role}.csv")));
        }
        diagnose
            .arg("--rig-out")
            .arg(self.bench.path("MPC-corrected.toml"));
        diagnose
            .arg("--json")
            .arg(self.bench.path("diagnosis.json"));
        diagnose
            .arg("--report")
            .arg(self.bench.path("diagnosis.html"));
        process::run(&mut diagnose)
    }

    /// Recordings for fit and training: as many as the diagnosis has.
    fn recordings(&self, command: &mut Command) {
        for role in ["fit", "check"] {
            command
                .arg("--fit")
                .arg(self.bench.path(&format!("{role}.csv")));
        }
        command.arg("--test").arg(self.bench.path("test.csv"));
    }

    /// A network for a rig, and its controller's weights, tuned on that rig and rigs near it.
    fn controller(&self, name: &str) -> Result<()> {
        println!("{}: {name}", self.rehearsal.name);
        let rig = self.bench.path(&format!("{name}.toml"));
        let model = self.bench.path("trained").join(name);
        let seed = self.bench.seed.to_string();
        let mut train = self.bench.sinew("train", &rig);
        self.recordings(&mut train);
        train.arg("--out").arg(&model);
        train
            .arg("--json")
            .arg(self.bench.path(&format!("{name}.training.json")));
        process::run(train.args(["--seed", &seed]))?;
        let mut tune = self.bench.sinew("tune", &rig);
        tune.arg(&model);
        self.recordings(&mut tune);
        if self.rehearsal.paths.is_some() {
            tune.arg("--reference")
                .arg(self.bench.path("tuning-path.csv"));
        }
        tune.args(self.rehearsal.tune);
        tune.arg("--out")
            .arg(self.bench.path(&format!("{name}.tuned.toml")));
        tune.arg("--model-out")
            .arg(self.bench.path("models").join(name));
        process::run(tune.args(["--mpc-only", "--seed", &seed]))
    }

    fn compare(&self) -> Result<()> {
        let mut compare = self.bench.sinew("compare", &self.nominal());
        for name in NAMES {
            compare.arg(self.bench.path("models").join(name));
        }
        self.recordings(&mut compare);
        compare.arg("--out").arg(self.bench.path("firmware"));
        if self.rehearsal.paths.is_some() {
            compare.arg("--reference").arg(self.bench.path("path.csv"));
        }
        compare.args(&self.real).args(self.rehearsal.compare);
        compare.args(["--board", "qemu"]);
        for (flag, file) in [
            ("--json", "comparison.json"),
            ("--report", "report.html"),
            ("--plot", "error.svg"),
        ] {
            compare.arg(flag).arg(self.bench.path(file));
        }
        process::run(compare.args(["--seed", &self.bench.seed.to_string()]))
    }

    /// summary.json: what was found, and the comparison; a figure of its loops.
    fn summary(&self) -> Result<()> {
        let comparison = self.bench.json("comparison.json")?;
        let controllers = comparison["controllers"].as_array().into_iter().flatten();
        let rows = controllers.map(Row::of).collect::<Result<Vec<_>>>()?;
        let title = format!("{}: RMS error of each loop", self.rehearsal.name);
        self.bench.write("loops.svg", &loops(&title, &rows))?;
        self.bench.summary(json!({
            "format": "sinew-experiment-mended/1",
            "diagnosis": self.bench.json("diagnosis.json")?,
            "comparison": comparison,
        }))
    }
}
