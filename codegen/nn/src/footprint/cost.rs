//! Costs of a network's functions.

/// Cost of one function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cost {
    /// Code, weights and initial values, with what they call.
    pub flash_bytes: u64,
    /// State.
    pub ram_bytes: u64,
    /// Deepest stack of a call; none without QEMU.
    pub stack_bytes: Option<u64>,
    /// Instructions of a call; none without QEMU.
    pub instructions: Option<u64>,
}

/// Footprint of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Footprint {
    /// `predict` alone.
    pub predict: Cost,
    /// `predict` and `predict_with_jacobian` in one image; instructions and stack are those of the
    /// latter.
    pub jacobian: Cost,
    /// Share of the flash that holds weights.
    pub weight_bytes: u64,
}
