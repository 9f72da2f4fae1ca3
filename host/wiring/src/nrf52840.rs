//! Pins of an nRF52840 DK (PCA10056; Zephyr's `nrf52840dk_nrf52840.dts` and the chip's product
//! specification v1.7, 6.20 and 7.1).

use crate::board::{Board, Decoder, Pin, Units, Use};

const fn analogue(name: &'static str, place: &'static str) -> Pin {
    let uses = &[Use::Analogue, Use::Routed];
    Pin { name, place, uses }
}

const fn digital(name: &'static str, place: &'static str) -> Pin {
    let uses = &[Use::Routed];
    Pin { name, place, uses }
}

/// Eight analogue inputs, four units of pulses and one decoder. Timer 1 paces the loop.
pub(crate) const BOARD: Board = Board {
    name: "nrf52840",
    title: "nRF52840 DK",
    pins: &[
        analogue("P0.03", "A0"),
        analogue("P0.04", "A1"),
        analogue("P0.28", "A2"),
        analogue("P0.29", "A3"),
        analogue("P0.30", "A4"),
        analogue("P0.31", "A5"),
        analogue("P0.02", "AIN0"),
        analogue("P0.05", "AIN3"),
        digital("P1.10", "D8"),
        digital("P1.11", "D9"),
        digital("P1.12", "D10"),
        digital("P1.13", "D11"),
        digital("P1.14", "D12"),
        digital("P1.15", "D13"),
        digital("P1.01", "D0"),
        digital("P1.02", "D1"),
        digital("P1.03", "D2"),
        digital("P1.04", "D3"),
        digital("P1.06", "D5"),
        digital("P1.07", "D6"),
        digital("P1.08", "D7"),
        digital("P0.26", "D14"),
        digital("P0.27", "D15"),
    ],
    taken: &[
        ("P0.06", "the serial line"),
        ("P0.08", "the serial line"),
        ("P1.05", "ENABLE of the power stages"),
        ("P0.00", "the crystal"),
        ("P0.01", "the crystal"),
        ("P0.18", "the reset button"),
    ],
    // 10 us of sampling and 2 of conversion.
    conversion_s: 12e-6,
    full_scale_v: 3.3,
    units: Units::Routed {
        units: 4,
        channels: 4,
        // 128 us is the shortest; ACC holds 1,023 (product specification, 6.17).
        decoder: Decoder {
            look_s: 128e-6,
            holds: 1023.0,
        },
    },
    pwm_hz: 10_000.0,
    servo_hz: 50.0,
};
