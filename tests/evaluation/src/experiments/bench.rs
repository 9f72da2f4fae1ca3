//! Common parts of experiments: a folder of their own, the program, and what it leaves.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result};
use serde_json::Value;

use crate::bench::image::{self, Around, Content};
use xtask::process::{self, root, target_folder};
use xtask::setup::{self, Extent, Toolchain};

/// One experiment under way.
pub struct Bench {
    toolchain: Toolchain,
    out: PathBuf,
    /// Seed of everything that is drawn.
    pub seed: u64,
    begun: Instant,
}

impl Bench {
    /// Builds the program and makes target/experiments/NAME.
    ///
    /// # Errors
    /// Setup, or a folder that cannot be made.
    pub fn new(name: &str, seed: u64) -> Result<Self> {
        let begun = Instant::now();
        let toolchain = setup::run(Extent::Build)?;
        process::program("sinew")?;
        // Paths are relative to the checkout: what is printed can be typed again.
        let out = Path::new("target/experiments").join(name);
        fs::create_dir_all(root().join(&out))
            .with_context(|| format!("cannot make {}", out.display()))?;
        Ok(Self {
            toolchain,
            out,
            seed,
            begun,
        })
    }

    /// A file of the experiment, relative to the checkout.
    pub fn path(&self, name: &str) -> PathBuf {
        self.out.join(name)
    }

    /// A verb of `sinew`; `rig` is what it is about.
    pub fn sinew(&self, verb: &str, rig: &Path) -> Command {
        let mut command = Command::new(target_folder().join("debug/sinew"));
        command.arg(verb).arg(rig).current_dir(root());
        // Shared with the demo's and the tests' boards: embassy is compiled once.
        if std::env::var_os("SINEW_BUILD_DIR").is_none() {
            command.env("SINEW_BUILD_DIR", root().join("target/boards"));
        }
        self.toolchain.equip(&mut command);
        command
    }

    /// Flash of the smallest image that controls with a model, made for size, and of the same image
    /// without the control step: start-up code and the counting program of `boards/step`. In bytes.
    ///
    /// # Errors
    /// It does not build.
    pub fn control_image(&self, model: &Path) -> Result<[u64; 2]> {
        let project = self.path("control-image");
        let mut emit = self.sinew("emit", model);
        process::run(emit.args(["--optimise", "size", "--out"]).arg(&project))?;
        let around = Around::project(&root().join(&project), "control-image")?;
        let flash = |content| -> Result<u64> {
            let elf = image::build_around(&self.toolchain, &around, "count", content)?;
            Ok(image::sizes(&elf)?.0)
        };
        Ok([flash(Content::Ours)?, flash(Content::Empty)?])
    }

    /// Inputs that a rig's limits allow, designed by `sinew excite`: inputs.csv.
    ///
    /// # Errors
    /// The exit status of `sinew`.
    pub fn inputs(&self, rig: &Path, wanted: &[&str], seed: &str) -> Result<PathBuf> {
        let inputs = self.path("inputs.csv");
        let mut excite = self.sinew("excite", rig);
        excite.arg("--out").arg(&inputs).args(wanted);
        process::run(excite.args(["--no-table", "--quiet", "--seed", seed]))?;
        Ok(inputs)
    }

    /// Writes a file of the experiment.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&self, name: &str, text: &str) -> Result<PathBuf> {
        let path = self.path(name);
        fs::write(root().join(&path), text)
            .with_context(|| format!("cannot write {}", path.display()))?;
        Ok(path)
    }

    /// A file of the checkout.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn text(&self, path: &Path) -> Result<String> {
        fs::read_to_string(root().join(path))
            .with_context(|| format!("cannot read {}", path.display()))
    }

    /// A file of the experiment that the program left for programs.
    ///
    /// # Errors
    /// It cannot be read or is no JSON.
    pub fn json(&self, name: &str) -> Result<Value> {
        let path = self.path(name);
        serde_json::from_str(&self.text(&path)?)
            .with_context(|| format!("{} is no JSON", path.display()))
    }

    /// summary.json, with the seconds that it took.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn summary(&self, mut summary: Value) -> Result<()> {
        let seconds = self.begun.elapsed().as_secs_f64();
        summary["seconds"] = seconds.into();
        let text = serde_json::to_string_pretty(&summary)? + "\n";
        let path = self.write("summary.json", &text)?;
        println!("{}: {seconds:.0} s", path.display());
        Ok(())
    }
}
