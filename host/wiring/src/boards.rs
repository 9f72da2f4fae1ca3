//! List of the boards that can be wired.

use crate::board::Board;
use crate::{nrf52840, stm32f446};

/// Every board that can be wired.
const BOARDS: [&Board; 2] = [&stm32f446::BOARD, &nrf52840::BOARD];

/// The board of this name.
///
/// # Errors
/// The names that there are.
pub fn board(name: &str) -> Result<&'static Board, String> {
    let names: Vec<&str> = BOARDS.iter().map(|board| board.name).collect();
    BOARDS
        .into_iter()
        .find(|board| board.name == name)
        .ok_or_else(|| format!("`{name}` cannot be wired: there are {}", names.join(", ")))
}
