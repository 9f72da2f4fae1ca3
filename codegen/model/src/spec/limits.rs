//! The largest model that is accepted, checked before anything of that size is allocated.
//!
//! Signals and regressor are bounded by the frames between host and device, parameters
//! by the flash of the largest board.

/// Inputs, and outputs: the vectors in a frame.
pub const MAX_SIGNALS: usize = 8;
/// Sensor channels in a frame.
pub const MAX_CHANNELS: usize = 32;
/// Values in a flattened regressor, as a probe frame carries it.
pub const MAX_REGRESSOR: usize = 128;
/// Steps that are predicted: more than any board computes in a period.
pub const MAX_HORIZON: usize = 128;
/// Decision variables: `control_horizon * inputs`.
pub const MAX_DECISION_VARIABLES: usize = 64;
/// Newton iterations in one control step.
pub const MAX_ITERATIONS: u8 = 8;
/// Least budget of the optimisation of a step, instructions: no model has a shorter iteration.
pub const MIN_BUDGET: u32 = 1000;
/// Largest budget: more than any chip computes in a period.
pub const MAX_BUDGET: u32 = 1_000_000_000;
/// Layers of a network.
pub const MAX_LAYERS: usize = 16;
/// Outputs of one layer.
pub const MAX_WIDTH: usize = 1024;
/// Weights and biases: 1 MiB of f32, the flash of the largest board.
pub const MAX_PARAMETERS: usize = 262_144;
/// Reference vectors that come with a model.
pub const MAX_GOLDEN: usize = 256;
/// Characters in a name or unit.
pub use sinew_nn::limits::MAX_NAME;
