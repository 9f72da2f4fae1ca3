//! Table of the boards.

use super::chip::{Chip, NRF52840, STM32F446};

/// Board with the memories that a network shares with everything else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    /// Name, as `--board` and the folders of `boards/` have it.
    pub name: &'static str,
    /// Microcontroller; none for QEMU, which has no clock to speak of.
    pub chip: Option<&'static Chip>,
    /// Size of the flash.
    pub flash_bytes: u32,
    /// Size of the RAM.
    pub ram_bytes: u32,
}

/// Every board.
pub const BOARDS: [Board; 3] = [
    Board::with_chip("stm32f446", &STM32F446),
    Board::with_chip("nrf52840", &NRF52840),
    Board {
        name: "qemu",
        chip: None,
        flash_bytes: 4 << 20,
        ram_bytes: 4 << 20,
    },
];

impl Board {
    const fn with_chip(name: &'static str, chip: &'static Chip) -> Self {
        Self {
            name,
            chip: Some(chip),
            flash_bytes: chip.flash_bytes,
            ram_bytes: chip.ram_bytes,
        }
    }

    /// The board of a name.
    ///
    /// ```
    /// use sinew_nn::footprint::Board;
    ///
    /// assert_eq!(Board::named("nrf52840").map(|board| board.flash_bytes), Some(1 << 20));
    /// assert_eq!(Board::named("nrf9160"), None);
    /// ```
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        BOARDS.iter().find(|board| board.name == name)
    }
}
