//! Result of a training, and what every trained model has in common.

use sinew_model::spec::{ControlSpec, ModelSpec};
use sinew_train::train::Epoch;

use crate::closed_loop::control_problem::ControlProblem;

/// A trained model and how good it is.
#[derive(Clone, Debug)]
pub struct Learned {
    /// The model with provisional control settings.
    pub spec: ModelSpec,
    /// The record of its training.
    pub record: Record,
}

/// Record of a training; lengths in SI.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Record {
    /// One entry a pass.
    pub history: Vec<Epoch>,
    /// The pass that was kept.
    pub kept: usize,
    /// Weights and biases.
    pub parameters: usize,
    /// Root mean square error one step ahead, each output, on episodes that trained and chose
    /// nothing.
    pub one_step_rms: Vec<f64>,
    /// The same at the end of the horizon, the network fed with its own predictions.
    pub horizon_rms: Vec<f64>,
    /// Steps of that horizon.
    pub horizon: usize,
}

/// Settings that hold until they are tuned.
pub(super) fn control(task: &ControlProblem) -> ControlSpec {
    ControlSpec {
        horizon: task.horizon,
        control_horizon: task.control_horizon,
        move_blocks: vec![],
        first_step: 1,
        tracking_weight: task.tracking_weight.clone(),
        move_suppression: task
            .move_suppression
            .clone()
            .unwrap_or_else(|| vec![0.01; task.limits.len()]),
        command_weight: task.command_weight,
        lower: task.limits.iter().map(|l| l.0).collect(),
        upper: task.limits.iter().map(|l| l.1).collect(),
        rate_limit: task.limits.iter().map(|l| l.2 / task.period_s).collect(),
        safe: task
            .limits
            .iter()
            .map(|(low, high, _)| 0.0_f64.clamp(*low, *high))
            .collect(),
        disturbance_gain: 0.2,
        observer_gain: 1.0,
        iterations: 2,
        budget: task.budget,
        max_missing_samples: 10,
        value: None,
    }
}

/// A unit; `1` for none, since a model names a unit for every signal.
pub(crate) fn unit_of(unit: &str) -> &str {
    match unit {
        "" => "1",
        unit => unit,
    }
}

/// A rig's name as cargo takes it: lower-case letters, digits and `-`.
pub fn crate_name(name: &str) -> String {
    let mut text = String::new();
    for c in name.chars() {
        if c.is_ascii_alphanumeric() {
            text.push(c.to_ascii_lowercase());
        } else if !text.ends_with('-') && !text.is_empty() {
            text.push('-');
        }
    }
    let text = text.trim_end_matches('-');
    if text.is_empty() {
        "rig".into()
    } else {
        text.into()
    }
}
