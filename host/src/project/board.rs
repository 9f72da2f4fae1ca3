//! What is known of each board: one table for building, flashing and sizing.

use super::Board;

/// A microcontroller with its memories and what it takes to run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chip {
    /// Its name in probe-rs, which flashes it.
    pub name: &'static str,
    /// What it says of itself.
    pub identification: Identification,
    /// Core clock as the board sets it.
    pub clock_hz: u32,
    /// Start of the flash that code runs from.
    pub flash_origin: u32,
    /// Its size.
    pub flash_bytes: u32,
    /// Start of the RAM that the linker is told of.
    pub ram_origin: u32,
    /// Its size.
    pub ram_bytes: u32,
    /// Supply current while the core computes from flash, peripherals off: typical value of the data sheet.
    pub run_current_ma: f64,
    /// While it sleeps between steps, clocks as they are.
    pub sleep_current_ma: f64,
    /// Supply voltage of these currents.
    pub supply_v: f64,
    /// Where the figures stand.
    pub source: &'static str,
}

/// A register that tells chips apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identification {
    /// Its address.
    pub address: u64,
    /// The bits that count.
    pub mask: u32,
    /// What they are.
    pub value: u32,
}

const STM32F446: Chip = Chip {
    name: "STM32F446RETx",
    // DBGMCU_IDCODE, DEV_ID (RM0390, 33.6.1).
    identification: Identification {
        address: 0xE004_2000,
        mask: 0xFFF,
        value: 0x421,
    },
    clock_hz: 180_000_000,
    flash_origin: 0x0800_0000,
    flash_bytes: 512 * 1024,
    ram_origin: 0x2000_0000,
    ram_bytes: 128 * 1024,
    run_current_ma: 46.0,
    sleep_current_ma: 21.0,
    supply_v: 3.3,
    source: "DS10693, tables 22 and 25, read from memory: check before you rely on it",
};

const NRF52840: Chip = Chip {
    name: "nRF52840_xxAA",
    // FICR, INFO.PART (PS v1.7, 4.4.1.16).
    identification: Identification {
        address: 0x1000_0100,
        mask: 0xFFFF_FFFF,
        value: 0x0005_2840,
    },
    clock_hz: 64_000_000,
    flash_origin: 0,
    flash_bytes: 1024 * 1024,
    ram_origin: 0x2000_0000,
    ram_bytes: 256 * 1024,
    run_current_ma: 6.3,
    sleep_current_ma: 0.4,
    supply_v: 3.0,
    source: "nRF52840 PS v1.7, 5.2.1.1 (without the DC/DC converter), read from memory: check before you rely on it",
};

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
        match self {
            Self::Qemu | Self::Host => None,
            Self::Stm32f446 => Some(&STM32F446),
            Self::Nrf52840 => Some(&NRF52840),
        }
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
