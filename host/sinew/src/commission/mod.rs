//! First power-up of a rig: from bare hardware to a recording that a fit can use, each step
//! resumable (docs/how-to/commission.md).
//!
//! A board carries the *bare model* first ([`setup::Setup::bare_model`]): limits, scales and rate
//! of the rig, and a network that predicts nothing. [`Commissioning`] then takes the steps on it in
//! their order. What was found lies in the [`journal`]; a fault ends the run with everything at
//! rest.

pub mod bench;
pub mod ends;
pub mod journal;
mod judge;
mod moves;
mod on_board;
pub mod rehearsal;
mod rest;
pub mod setup;
#[cfg(test)]
pub(crate) mod simulated;
mod soft_limits;
pub mod step;
#[cfg(test)]
pub(crate) mod tests;

use std::path::{Path, PathBuf};

use sinew_ident::error::{Error, Result};
use sinew_model::spec::ModelSpec;
use sinew_model::store;

use journal::Journal;
use setup::Setup;
use step::Step;

/// Folder of the bare model.
pub const BARE: &str = "bare";
/// The rig with its soft limits.
pub const RIG: &str = "rig.toml";
/// The recordings: one to fit to, one to score.
pub const RECORDINGS: [&str; 2] = ["fit.csv", "test.csv"];

/// Settings of a commissioning.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Largest part of the way from the safe command to a limit in the step `move`.
    pub amplitude: f64,
    /// Factor by which a scale may be off.
    pub tolerance: f64,
    /// Seconds at rest.
    pub rest_s: f64,
    /// Seconds of the way to one end.
    pub sweep_s: f64,
    /// Seconds of each experiment.
    pub excite_s: f64,
    /// Seed of the experiments.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            amplitude: 0.2,
            tolerance: 2.0,
            rest_s: 3.0,
            sweep_s: 10.0,
            excite_s: 30.0,
            seed: 1,
        }
    }
}

impl Settings {
    /// Checks that the settings make sense.
    ///
    /// # Errors
    /// The first that does not.
    pub fn check(&self) -> Result<()> {
        if !(self.amplitude > 0.0 && self.amplitude <= 0.5) {
            let expectation = "a part of the way to the limits in (0, 0.5]";
            return Err(Error::must_be("--amplitude", expectation, self.amplitude));
        }
        if !(self.tolerance > 1.0 && self.tolerance <= 10.0) {
            let expectation = "a factor above 1, at most 10";
            return Err(Error::must_be("--tolerance", expectation, self.tolerance));
        }
        for (flag, value, least) in [
            ("--sweep-seconds", self.sweep_s, 1.0),
            ("--seconds", self.excite_s, 1.0),
        ] {
            if !(least..=3600.0).contains(&value) {
                return Err(Error::must_be(flag, format!("{least} to 3600 s"), value));
            }
        }
        Ok(())
    }
}

/// A commissioning under way: its rig, its folder, what is known.
pub struct Commissioning {
    /// Signals and declared numbers.
    pub setup: Setup,
    /// State on disk.
    pub journal: Journal,
    /// Model that the board carries meanwhile.
    pub bare: ModelSpec,
    folder: PathBuf,
    rig_crc32: u32,
    settings: Settings,
}

impl Commissioning {
    /// Opens or begins the commissioning in `folder`. The bare model is written once and kept, so
    /// that a corrected number in the rig does not ask for the board to be flashed again.
    ///
    /// # Errors
    /// A rig that cannot be commissioned, a folder of another one, a bare model of other signals.
    pub fn open(setup: Setup, folder: &Path, rehearsal: bool, settings: Settings) -> Result<Self> {
        settings.check()?;
        let journal = Journal::open(folder, &setup.rig.name, rehearsal)?;
        let path = folder.join(BARE);
        let fresh = setup.bare_model()?;
        let bare = if path.join(store::MODEL_FILE).exists() {
            let kept = store::load(&path).map_err(Error::refused)?;
            if !same_board(&kept, &fresh) {
                return Err(Error::file(
                    path.join(store::MODEL_FILE),
                    "it has other signals, limits or another rate than the rig has now",
                )
                .help("remove the folder of the bare model, and flash the board again"));
            }
            kept
        } else {
            store::save(&path, &fresh).map_err(Error::refused)?;
            fresh
        };
        Ok(Self {
            rig_crc32: crc32fast::hash(setup.rig.to_toml().as_bytes()),
            setup,
            journal,
            bare,
            folder: folder.into(),
            settings,
        })
    }

    /// Folder of the bare model.
    pub fn bare_folder(&self) -> PathBuf {
        self.folder.join(BARE)
    }

    /// True for a step that is finished and still holds.
    pub fn has(&self, step: Step) -> bool {
        self.journal.has(step, self.rig_crc32)
    }

    /// The first step that is not finished.
    pub fn next(&self) -> Option<Step> {
        Step::ALL.into_iter().find(|step| !self.has(*step))
    }

    /// Forgets a step and those after it.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn forget(&mut self, step: Step) -> Result<()> {
        self.journal.forget(step);
        self.journal.save(&self.folder).map(|_| ())
    }

    /// Notes that a step is finished.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn finish(&mut self, step: Step) -> Result<()> {
        self.journal.finish(step, self.rig_crc32);
        self.journal.save(&self.folder).map(|_| ())
    }
}

/// True where a board with one model has the signals, limits and rate of the other. Scales may
/// differ: they are those of the day when the board was flashed.
fn same_board(a: &ModelSpec, b: &ModelSpec) -> bool {
    let names = |spec: &ModelSpec| {
        let signals = spec
            .inputs
            .iter()
            .chain(&spec.outputs)
            .chain(&spec.channels);
        signals
            .map(|s| (s.name.clone(), s.unit.clone()))
            .collect::<Vec<_>>()
    };
    a.period_s == b.period_s
        && a.outputs.len() == b.outputs.len()
        && names(a) == names(b)
        && a.control.lower == b.control.lower
        && a.control.upper == b.control.upper
        && a.control.rate_limit == b.control.rate_limit
}
