//! `summary.json` (docs/reference/results.md): every number in it was measured in the run that
//! wrote it.

use std::path::Path;

use serde::Serialize;

use crate::closed_loop::mpc::Answer;
use sinew_ident::error::{Error, Result};

/// Ticks of QEMU's 25 MHz timer last 40 ns and an instruction 32 ns of virtual time
/// (`-icount shift=5`, boards/qemu/run.sh), so that a count is good to one or two instructions.
const INSTRUCTIONS_A_TICK: f64 = 40.0 / 32.0;

/// `sinew-demo/1`.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Always `sinew-demo/1`.
    pub format: &'static str,
    /// The rig's name.
    pub rig: String,
    /// `qemu-mps2-an386` or `host`.
    pub board: String,
    /// Control steps a second.
    pub rate_hz: f64,
    /// Steps of the run.
    pub steps: usize,
    /// Steps that ended after their period, as the firmware counted them.
    pub deadline_misses: u32,
    /// Tracking errors of the first output.
    pub tracking: Tracking,
    /// Instructions of one control step; null where the board does not count them.
    pub instructions_per_step: Option<Spread>,
    /// Flash of the whole image; null on the host.
    pub flash_bytes: Option<u64>,
    /// Statics in RAM; null on the host.
    pub ram_bytes: Option<u64>,
    /// Deepest stack, painted and measured; null on the host.
    pub stack_bytes: Option<u32>,
    /// 0: no allocator is linked.
    pub heap_bytes: Option<u64>,
    /// Every command of the device has the bits of the host's build; null when only the host ran.
    pub host_equals_device: Option<bool>,
    /// Commands outside limits or rate limits, of all controllers.
    pub commands_outside_limits: usize,
    /// Free-run errors of the rig before and after its fit, by signal.
    pub fit: Vec<FitError>,
    /// Root mean square error of the network, one step ahead and at the horizon.
    pub network: NetworkError,
    /// Physics found missing from the rig; null where nobody asked (`--diagnose`).
    pub diagnosis: Option<Found>,
    /// Wall time of the whole chain.
    pub seconds: f64,
}

/// Physics that the rig lacks.
#[derive(Clone, Debug, Serialize)]
pub struct Found {
    /// The kind that was concealed; null where nobody knows.
    pub hidden: Option<String>,
    /// Kinds that were found, joined by a plus; the verdict where none was.
    pub found: String,
    /// SI unit of the first output.
    pub unit: String,
    /// Free-run error of the first output with the parameters refitted, on recordings that fitted
    /// nothing.
    pub before_rms: f64,
    /// The same with what was found in the rig; null where free runs mean nothing.
    pub after_rms: Option<f64>,
}

/// The rig that network, tuning and plant of the loop come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ModelRig {
    /// The rig with its parameters refitted.
    Fitted,
    /// The same with the effects that were found missing.
    Corrected,
}

impl ModelRig {
    /// Its name in sentences and in the JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fitted => "fitted",
            Self::Corrected => "corrected",
        }
    }
}

/// Tracking errors.
#[derive(Clone, Debug, Serialize)]
pub struct Tracking {
    /// The rig that the network was trained and every controller tuned on; the plant of the loop is
    /// the same with its parameters moved.
    pub model_rig: ModelRig,
    /// SI unit.
    pub unit: String,
    /// Root mean square.
    pub mpc_rms: f64,
    /// Root mean square, tuned on the plant of the loop itself.
    pub pid_rms: f64,
    /// Root mean square, tuned on the plants that the MPC was tuned on.
    pub informed_pid_rms: f64,
    /// Largest.
    pub mpc_max: f64,
    /// Largest, tuned on the plant of the loop itself.
    pub pid_max: f64,
    /// Largest, tuned on the plants that the MPC was tuned on.
    pub informed_pid_max: f64,
}

/// Mean and largest.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Spread {
    /// Mean over the run.
    pub mean: f64,
    /// Largest of the run.
    pub max: u64,
}

/// Instructions of a control step, by the ticks that came with `answers`.
pub fn instructions(answers: &[Answer]) -> Spread {
    let counts = answers
        .iter()
        .map(|a| f64::from(a.ticks) * INSTRUCTIONS_A_TICK);
    Spread {
        mean: counts.clone().sum::<f64>() / answers.len().max(1) as f64,
        max: counts.fold(0.0, f64::max).round() as u64,
    }
}

/// Free-run errors of one signal, SI.
#[derive(Clone, Debug, Serialize)]
pub struct FitError {
    /// The column.
    pub signal: String,
    /// `fit` or `test`.
    pub role: &'static str,
    /// SI unit.
    pub unit: String,
    /// As the rig was written.
    pub as_written_rms: f64,
    /// With its parameters refitted.
    pub fitted_rms: f64,
}

/// Prediction errors of the network on episodes that trained nothing, first output, SI.
#[derive(Clone, Debug, Serialize)]
pub struct NetworkError {
    /// Weights and biases.
    pub parameters: usize,
    /// One step ahead.
    pub one_step_rms: f64,
    /// At the end of the horizon, fed with its own predictions.
    pub horizon_rms: f64,
}

impl Summary {
    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self)
            .map_err(|e| Error::failed(format!("{}: {e}", path.display())))?;
        Ok(sinew_files::write(path, text + "\n")?)
    }
}
