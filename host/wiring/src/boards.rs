//! List of the boards that can be wired.

use std::fmt;

use crate::board::Board;
use crate::{nrf52840, stm32f446};

/// Every board that can be wired.
const BOARDS: [&Board; 2] = [&stm32f446::BOARD, &nrf52840::BOARD];

/// Error of a name that no board has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownBoard {
    /// The name.
    pub name: String,
}

impl fmt::Display for UnknownBoard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = BOARDS.iter().map(|board| board.name).collect();
        let (name, names) = (&self.name, names.join(", "));
        write!(f, "`{name}` cannot be wired: there are {names}")
    }
}

impl std::error::Error for UnknownBoard {}

/// As a message of a caller's own error.
impl From<UnknownBoard> for String {
    fn from(error: UnknownBoard) -> Self {
        error.to_string()
    }
}

/// The board of this name.
///
/// ```
/// assert!(sinew_wiring::board("stm32f446").is_ok());
/// let unknown = sinew_wiring::board("uno").unwrap_err();
/// assert!(unknown.to_string().starts_with("`uno` cannot be wired: there are stm32f446"));
/// ```
///
/// # Errors
/// No board has this name; the message lists those that there are.
pub fn board(name: &str) -> Result<&'static Board, UnknownBoard> {
    let unknown = || UnknownBoard { name: name.into() };
    BOARDS
        .into_iter()
        .find(|board| board.name == name)
        .ok_or_else(unknown)
}
