//! Table of the microcontrollers. It uses nothing, so that the tests of `boards/probe` can include
//! it.

/// Cycles of an instruction on a Cortex-M4F that runs from flash, by a table of instruction
/// timings: an estimate, measured on no board.
pub const CYCLES_PER_INSTRUCTION: f64 = 1.7;

/// Microcontroller with its clock, memories and supply currents.
///
/// ```
/// use sinew_nn::footprint::chip::STM32F446;
///
/// assert_eq!(STM32F446.flash_bytes, 512 * 1024);
/// assert_eq!(STM32F446.identification.mask & STM32F446.identification.value, 0x421);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chip {
    /// Name in probe-rs.
    pub name: &'static str,
    /// Register that identifies it.
    pub identification: Identification,
    /// Core clock as the board sets it, in hertz.
    pub clock_hz: u32,
    /// Start of the flash that code runs from.
    pub flash_origin: u32,
    /// Size of that flash.
    pub flash_bytes: u32,
    /// Start of the RAM in the linker script.
    pub ram_origin: u32,
    /// Size of that RAM.
    pub ram_bytes: u32,
    /// Supply current while the core computes from flash, peripherals off: typical value of the
    /// data sheet.
    pub run_current_ma: f64,
    /// Supply current in sleep between steps, with the same clocks.
    pub sleep_current_ma: f64,
    /// Supply voltage of these currents.
    pub supply_v: f64,
    /// Source of the figures.
    pub source: &'static str,
}

/// Register that tells chips apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identification {
    /// Address of the register.
    pub address: u64,
    /// Mask of the bits that count.
    pub mask: u32,
    /// Value of these bits.
    pub value: u32,
}

/// Microcontroller of the Nucleo-F446RE.
pub const STM32F446: Chip = Chip {
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

/// Microcontroller of the nRF52840 DK.
pub const NRF52840: Chip = Chip {
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
