//! The largest network that is accepted, checked before anything of that size is allocated.

/// Layers.
pub const MAX_NODES: usize = 512;
/// Values that one layer gives: 256 KiB of f32, more RAM than most boards have.
pub const MAX_LENGTH: usize = 65_536;
/// Values that a selection reads: its places are 16-bit numbers, the largest of which is none.
pub const MAX_SELECTED: usize = 65_535;
/// Weights and biases: 4 MiB of f32.
pub const MAX_PARAMETERS: usize = 1_048_576;
/// Axes of a shape.
pub const MAX_AXES: usize = 3;
/// Reference vectors that come with a network.
pub const MAX_GOLDEN: usize = 256;
/// Bytes of a file that is imported.
pub const MAX_FILE_BYTES: u64 = 64 * 1024 * 1024;
/// Characters in a name.
pub const MAX_NAME: usize = 64;
