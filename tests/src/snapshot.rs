//! Measurements of an image, as they are kept in `tests/expected/` and held against
//! `tests/budgets.toml`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use sinew::device::Device;
use sinew::project::{Board, Sizes, image::sizes};
use sinew_device::protocol::Summary;
use sinew_ident::error::{Error, Result};

use crate::{closed_loop, image};

/// One tick of the board's counter is 40 ns, one instruction 32 ns (boards/qemu/run.sh, `shift=5`):
/// counts are right to about an instruction, and the same in every run.
const INSTRUCTIONS_PER_TICK: f64 = 40.0 / 32.0;

/// A closed loop in QEMU, in numbers. Contents of a file in `tests/expected/`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// `rustc --version` of the compiler that built the image.
    pub compiler: String,
    /// Control steps of the run.
    pub steps: u64,
    /// Of the step, transport aside.
    pub instructions_mean: u64,
    /// Of the longest step.
    pub instructions_max: u64,
    /// Steps that ended after their period at 31 million instructions a second.
    pub deadline_misses: u64,
    /// Linked image.
    pub flash_bytes: u64,
    /// Statics.
    pub ram_bytes: u64,
    /// High-water mark.
    pub stack_bytes: u64,
    /// FNV-1a of the bits of every command.
    pub commands: String,
}

/// Most that a figure may be. A table of `tests/budgets.toml`.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    /// See [`Measured`].
    pub instructions_mean: u64,
    /// See [`Measured`].
    pub instructions_max: u64,
    /// See [`Measured`].
    pub deadline_misses: u64,
    /// See [`Measured`].
    pub flash_bytes: u64,
    /// See [`Measured`].
    pub ram_bytes: u64,
    /// See [`Measured`].
    pub stack_bytes: u64,
}

/// Builds the lockstep image and runs the reference closed loop in QEMU.
///
/// # Errors
/// The image does not build or the run breaks off.
pub fn measure() -> Result<Measured> {
    let path = image::build(Board::Qemu)?.lockstep;
    let mut device = Device::qemu(&image::runner(), &path)?;
    let run = closed_loop::run(&mut device)?;
    let ticks: Vec<u32> = run.steps.iter().map(|step| step.ticks).collect();
    Measured::new(&ticks, run.command_hash(), &run.summary, &sizes(&path)?)
}

impl Measured {
    /// Figures of a run: ticks of every step, hash of its commands, counts of the device, sizes of
    /// its image.
    ///
    /// # Errors
    /// The compiler does not say its version.
    pub fn new(ticks: &[u32], commands: u64, summary: &Summary, sizes: &Sizes) -> Result<Self> {
        let instructions = |ticks: f64| (ticks * INSTRUCTIONS_PER_TICK).round() as u64;
        let total: u64 = ticks.iter().map(|ticks| u64::from(*ticks)).sum();
        let most = ticks.iter().copied().max().unwrap_or(0);
        Ok(Self {
            compiler: image::compiler()
                .ok_or_else(|| Error::failed("rustc does not say its version"))?,
            steps: ticks.len() as u64,
            instructions_mean: instructions(total as f64 / ticks.len().max(1) as f64),
            instructions_max: instructions(f64::from(most)),
            deadline_misses: summary.deadline_misses.into(),
            flash_bytes: sizes.flash_bytes,
            ram_bytes: sizes.ram_bytes,
            stack_bytes: summary.stack_high_water_bytes.into(),
            commands: format!("{commands:016x}"),
        })
    }

    /// As the file holds it.
    ///
    /// # Errors
    /// Never for values that [`measure`] gives.
    pub fn to_text(&self) -> Result<String> {
        toml::to_string(self).map_err(|error| Error::failed(error.to_string()))
    }

    /// Reads a snapshot; `None` if there is no such file yet.
    ///
    /// # Errors
    /// The file cannot be read or holds something else.
    pub fn load(path: &Path) -> Result<Option<Self>> {
        if !path.exists() {
            return Ok(None);
        }
        read(path).map(Some)
    }

    /// The figures that are over budget, one line each; empty if none is.
    pub fn over(&self, budget: &Budget) -> String {
        let mut lines = String::new();
        for (name, measured, most) in self.beside(budget) {
            if measured > most {
                // Writing to a String never fails.
                let _ = writeln!(lines, "{name}: {measured}, budget {most}");
            }
        }
        lines
    }

    /// Every budgeted figure: name, measured, budget.
    pub fn beside(&self, budget: &Budget) -> [(&'static str, u64, u64); 6] {
        [
            (
                "instructions_mean",
                self.instructions_mean,
                budget.instructions_mean,
            ),
            (
                "instructions_max",
                self.instructions_max,
                budget.instructions_max,
            ),
            (
                "deadline_misses",
                self.deadline_misses,
                budget.deadline_misses,
            ),
            ("flash_bytes", self.flash_bytes, budget.flash_bytes),
            ("ram_bytes", self.ram_bytes, budget.ram_bytes),
            ("stack_bytes", self.stack_bytes, budget.stack_bytes),
        ]
    }
}

/// The file of a snapshot.
pub fn expected(name: &str) -> PathBuf {
    image::root()
        .join("tests/expected")
        .join(format!("{name}.txt"))
}

/// The budget of that name.
///
/// # Errors
/// `tests/budgets.toml` cannot be read, holds something else, or has no such table.
pub fn budget(name: &str) -> Result<Budget> {
    let path = image::root().join("tests/budgets.toml");
    // Other tables are budgets of other things.
    let mut tables: toml::Table = read(&path)?;
    let table =
        (tables.remove(name)).ok_or_else(|| Error::file(&path, format!("no table [{name}]")))?;
    Budget::deserialize(table).map_err(|error| Error::file(&path, error.to_string()))
}

fn read<T: for<'de> Deserialize<'de>>(path: &Path) -> Result<T> {
    let text = std::fs::read_to_string(path).map_err(|error| Error::read(path, error))?;
    toml::from_str(&text).map_err(|error| Error::file(path, error.to_string()))
}
