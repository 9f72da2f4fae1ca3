//! Names and programs of each board; its memories and clock are in the table of `sinew-nn`.

use super::Board;
use sinew_nn::footprint::{self, chip::Chip};

impl Board {
    /// Every board.
    pub const ALL: [Self; 4] = [Self::Qemu, Self::Host, Self::Stm32f446, Self::Nrf52840];

    /// Folder under `boards/`.
    pub fn folder(self) -> &'static str {
        match self {
            Self::Qemu => "qemu",
            Self::Host => "host",
            Self::Stm32f446 => "stm32f446",
            Self::Nrf52840 => "nrf52840",
        }
    }

    /// The name that stands in summaries.
    pub fn name(self) -> &'static str {
        match self {
            Self::Qemu => "qemu-mps2-an386",
            Self::Host => "host",
            Self::Stm32f446 => "nucleo-f446re",
            Self::Nrf52840 => "nrf52840-dk",
        }
    }

    /// Its microcontroller; none where nothing is flashed.
    pub fn chip(self) -> Option<&'static Chip> {
        footprint::Board::named(self.folder())?.chip
    }

    /// Program to run, in cargo's folder for the target; of two, the one that answers in lockstep.
    pub(super) fn program(self) -> &'static str {
        match self {
            Self::Qemu => "lockstep",
            Self::Host => "sinew-board-host",
            Self::Stm32f446 => "sinew-board-stm32f446",
            Self::Nrf52840 => "sinew-board-nrf52840",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::sources::SOURCES;

    /// `KEY : ORIGIN = 0x..., LENGTH = 512K` of a linker script.
    fn region(script: &str, key: &str) -> (u32, u32) {
        let line = script.lines().find(|line| line.trim().starts_with(key));
        let line = line.unwrap_or_else(|| panic!("no {key} in\n{script}"));
        let field = |name: &str| {
            let from = line.find(name).expect("a region has both") + name.len();
            let text = line[from..].trim_start_matches([' ', '=']);
            let end = text.find([',', ' ']).unwrap_or(text.len());
            text[..end].to_string()
        };
        let origin = field("ORIGIN");
        let origin = u32::from_str_radix(origin.trim_start_matches("0x"), 16).expect("hex");
        let length = field("LENGTH");
        let length: u32 = length.trim_end_matches('K').parse().expect("kibibytes");
        (origin, length * 1024)
    }

    #[test]
    fn boards_that_are_flashed_have_a_chip() {
        let with_chip = Board::ALL
            .into_iter()
            .filter(|board| board.chip().is_some());
        let with_chip: Vec<Board> = with_chip.collect();
        assert_eq!(with_chip, [Board::Stm32f446, Board::Nrf52840]);
    }

    #[test]
    fn the_linker_is_told_what_the_table_says() {
        for board in Board::ALL {
            let Some(chip) = board.chip() else { continue };
            let path = format!("boards/{}/memory.x", board.folder());
            let (_, script) = SOURCES
                .iter()
                .find(|(name, _)| *name == path)
                .expect("embedded");
            let script = String::from_utf8_lossy(script);
            assert_eq!(
                region(&script, "FLASH"),
                (chip.flash_origin, chip.flash_bytes),
                "{path}"
            );
            assert_eq!(
                region(&script, "RAM"),
                (chip.ram_origin, chip.ram_bytes),
                "{path}"
            );
        }
    }

    #[test]
    fn cargo_run_flashes_the_same_chip() {
        for board in Board::ALL {
            let Some(chip) = board.chip() else { continue };
            let path = format!("boards/{}/.cargo/config.toml", board.folder());
            let (_, config) = SOURCES
                .iter()
                .find(|(name, _)| *name == path)
                .expect("embedded");
            let runner = format!("runner = \"probe-rs run --chip {}\"", chip.name);
            assert!(
                String::from_utf8_lossy(config).contains(&runner),
                "{path}: not {runner}"
            );
        }
    }
}
