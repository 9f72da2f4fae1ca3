//! A published problem: what is asked, of which plants, of which controllers.

use serde_json::Value;

use super::targets::Target;

/// One of the published problems.
pub struct Problem {
    /// As on the command line, and the folder of its results.
    pub name: &'static str,
    /// Rig file of the controller's owner.
    pub nominal: &'static str,
    /// Effects that the owner knows of beside the rig, such as the delay of his electronics.
    pub known: &'static str,
    /// Part of the inputs' range that the recordings use: enough to go a little beyond what is
    /// asked.
    pub amplitude: &'static str,
    /// Kind of input signal.
    pub kind: &'static str,
    /// Effects that only the plants have.
    pub left_out: &'static str,
    /// Reference, and what tuning follows backwards: tables with a column an output. Without,
    /// smooth moves to the levels of the staircase.
    pub paths: Option<[fn() -> String; 2]>,
    /// PID and RISE once more as textbooks have them, without a look ahead at the reference.
    pub textbook: bool,
    /// Interval in which errors are judged, seconds; all of it without.
    pub judged: Option<&'static str>,
    /// Age of the measurements, seconds.
    pub delay: &'static str,
    /// Rate that its controller is to reach on an 84 MHz part, by estimate.
    pub rate_hz: f64,
    /// A load at the inputs, in tuning with the opposite sign.
    pub disturbance: &'static str,
    /// Evaluations that tuning may cost each MPC, and each of PID and RISE where the plant is slow.
    pub evaluations: (&'static str, Option<&'static str>),
    /// Controllers, the one that is held against the targets first.
    pub variants: &'static [Variant],
    /// Targets, from the comparison.
    pub targets: fn(&Value) -> Vec<Target>,
}

/// A predictive controller.
pub struct Variant {
    /// Its name in tables.
    pub name: &'static str,
    /// `[control]` and `[network]` instead of the rig's own.
    pub tables: Option<&'static str>,
    /// The rig it is trained on.
    pub knows: Knowledge,
    /// A file of another tool with its network, which takes the place of training.
    pub imported: Option<&'static str>,
    /// The variant whose network it has; without, one is trained.
    pub network_of: Option<&'static str>,
    /// Further arguments of `sinew tune`.
    pub tune: &'static [&'static str],
    /// The variant whose model it has, weights and all, in an image made for size.
    pub small: Option<&'static str>,
}

impl Variant {
    /// The variant whose model it has: itself, but where an image is made for size.
    pub fn model(&self) -> &'static str {
        self.small.unwrap_or(self.name)
    }
}

/// Knowledge of the plants in a controller's model.
#[derive(Clone, Copy, PartialEq)]
pub enum Knowledge {
    /// The nominal rig.
    Nominal,
    /// Model by `sinew diagnose`, from recordings of the plant in the middle of those drawn.
    Corrected,
}
