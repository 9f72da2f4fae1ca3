//! Verdict on a board: the network fits its memories, or what is missing.

use super::board::Board;
use super::cost::Cost;
use crate::summary::thousands;

/// Needs of a function beside the memories of a board, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fit {
    /// Flash that it takes.
    pub flash_bytes: u64,
    /// RAM that it takes, with its stack where that is known.
    pub ram_bytes: u64,
    /// Flash of the board.
    pub flash_of_board: u64,
    /// RAM of the board.
    pub ram_of_board: u64,
    /// Part of the RAM that is stack; none without QEMU.
    pub stack_bytes: Option<u64>,
}

impl Fit {
    /// The needs of a function beside a board's memories.
    ///
    /// ```
    /// use sinew_nn::footprint::{Board, Cost, Fit};
    ///
    /// let jacobian = Cost {
    ///     flash_bytes: 40_000,
    ///     ram_bytes: 0,
    ///     stack_bytes: Some(148_548),
    ///     instructions: None,
    /// };
    /// let on = |name| Board::named(name).map(|board| Fit::of(&jacobian, board).fits());
    /// assert_eq!((on("stm32f446"), on("nrf52840")), (Some(false), Some(true)));
    /// ```
    #[must_use]
    pub fn of(cost: &Cost, board: &Board) -> Self {
        Self {
            flash_bytes: cost.flash_bytes,
            ram_bytes: cost.ram_bytes + cost.stack_bytes.unwrap_or(0),
            flash_of_board: board.flash_bytes.into(),
            ram_of_board: board.ram_bytes.into(),
            stack_bytes: cost.stack_bytes,
        }
    }

    /// Returns true if both memories suffice. A board needs some of both for itself.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.flash_bytes <= self.flash_of_board && self.ram_bytes <= self.ram_of_board
    }

    /// `fits`, or what is too small by how much.
    #[must_use]
    pub fn words(&self) -> String {
        let number = |n: u64| thousands(n as usize);
        let mut missing = Vec::new();
        if self.flash_bytes > self.flash_of_board {
            missing.push(format!(
                "{} B of flash, the board has {} B",
                number(self.flash_bytes),
                number(self.flash_of_board)
            ));
        }
        if self.ram_bytes > self.ram_of_board {
            let stack = match self.stack_bytes {
                Some(stack) => format!(" ({} B of it stack)", number(stack)),
                None => String::new(),
            };
            missing.push(format!(
                "{} B of RAM{stack}, the board has {} B",
                number(self.ram_bytes),
                number(self.ram_of_board)
            ));
        }
        let share = |part: u64, whole: u64| 100.0 * part as f64 / whole as f64;
        if missing.is_empty() {
            return format!(
                "fits: {:.2} % of flash, {:.2} % of RAM{}",
                share(self.flash_bytes, self.flash_of_board),
                share(self.ram_bytes, self.ram_of_board),
                if self.stack_bytes.is_some() {
                    ""
                } else {
                    ", its stack unknown"
                }
            );
        }
        format!("does not fit: {}", missing.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::footprint::BOARDS;

    #[test]
    fn a_stack_larger_than_the_ram_is_said_with_both_numbers() {
        let cost = Cost {
            flash_bytes: 600 << 10,
            ram_bytes: 0,
            stack_bytes: Some(148_548),
            instructions: Some(1),
        };
        let words = BOARDS.map(|board| Fit::of(&cost, &board).words());
        assert_eq!(
            words[0],
            "does not fit: 614,400 B of flash, the board has 524,288 B; 148,548 B of RAM (148,548 B \
             of it stack), the board has 131,072 B"
        );
        assert_eq!(words[1], "fits: 58.59 % of flash, 56.67 % of RAM");
        assert!(words[2].starts_with("fits"), "{}", words[2]);
        let without = Cost {
            stack_bytes: None,
            ..cost
        };
        let words = Fit::of(&without, &BOARDS[1]).words();
        assert!(words.ends_with("its stack unknown"), "{words}");
    }
}
