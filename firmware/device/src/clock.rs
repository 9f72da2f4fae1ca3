//! Time source of a board.

/// A free-running counter of the board, cycles or ticks, that wraps at 32 bits.
pub trait Clock {
    /// The count now.
    fn ticks(&self) -> u32;
}
