//! Conditions of a closed loop that `compare` and `tune` share.

use std::path::PathBuf;

use clap::Args;

use crate::closed_loop::disturbance::Disturbance;
use crate::closed_loop::model_loop::ModelLoop;
use sinew_ident::error::{Error, Result};

/// Reference, disturbance and delay of a loop.
#[derive(Args, Clone, Debug)]
pub struct Conditions {
    /// A path to follow instead.
    ///
    /// A table like a recording, with a column an output, called as in the recordings.
    #[arg(long, value_name = "CSV")]
    pub reference: Option<PathBuf>,
    /// Disturbance of the commands on their way to the plant; no controller knows it.
    #[arg(long, value_enum, default_value = "none")]
    disturbance: Disturbance,
    /// Age of the measurements when a controller gets them; no controller is told of it.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    delay: f64,
}

/// Longer than this is not meant: it would be hundreds of steps.
const LONGEST_DELAY_S: f64 = 1.0;

impl Conditions {
    /// Before anything is read.
    ///
    /// # Errors
    /// A delay that is none.
    pub fn refuse(&self) -> Result<()> {
        if (0.0..=LONGEST_DELAY_S).contains(&self.delay) {
            return Ok(());
        }
        Err(
            Error::must_be("--delay", format!("0 to {LONGEST_DELAY_S} s"), self.delay)
                .help("for example --delay 0.008: a camera's frame at 125 Hz"),
        )
    }

    /// Puts a loop under them; `quiet` leaves out remarks about the path's file.
    ///
    /// # Errors
    /// A path that cannot be read or lacks an output.
    pub fn apply(&self, ready: &mut ModelLoop, quiet: bool) -> Result<()> {
        ready.disturbance = self.disturbance;
        ready.delay_s = self.delay;
        if let Some(path) = &self.reference {
            ready.follow(path, quiet)?;
        }
        Ok(())
    }
}
