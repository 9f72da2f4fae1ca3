//! Pins of a Nucleo-F446RE (UM1724, table 16 and figure 18; DS10693, table 11).

use crate::board::{Board, Pin, Units, Use};

const fn pin(name: &'static str, place: &'static str, uses: &'static [Use]) -> Pin {
    Pin { name, place, uses }
}

const fn encoder(timer: u8, phase: u8) -> Use {
    Use::Encoder { timer, phase }
}

const fn pulses(timer: u8, channel: u8) -> Use {
    Use::Pulses { timer, channel }
}

use Use::{Analogue, Bit};

/// Timers 1 and 8 make pulses; timers 3 and 4 make pulses or count an encoder. Timer 2 paces the
/// loop, timer 5 is the clock of embassy. Each channel of a timer stands at one pin here, though
/// the chip may offer others.
pub(crate) const BOARD: Board = Board {
    name: "stm32f446",
    title: "Nucleo-F446RE",
    pins: &[
        pin("PA0", "A0", &[Analogue]),
        pin("PA1", "A1", &[Analogue]),
        pin("PA4", "A2", &[Analogue]),
        pin("PB0", "A3", &[Analogue, pulses(3, 3)]),
        pin("PC1", "A4", &[Analogue]),
        pin("PC0", "A5", &[Analogue]),
        pin("PC2", "CN7-35", &[Analogue]),
        pin("PC3", "CN7-37", &[Analogue]),
        pin("PB1", "CN10-24", &[Analogue, pulses(3, 4)]),
        pin("PC4", "CN10-34", &[Analogue]),
        pin("PC5", "CN10-6", &[Analogue]),
        pin("PA6", "D12", &[Analogue, encoder(3, 1), pulses(3, 1)]),
        pin("PA7", "D11", &[Analogue, encoder(3, 2), pulses(3, 2)]),
        pin("PA5", "D13", &[Analogue]),
        pin("PB6", "D10", &[encoder(4, 1), pulses(4, 1)]),
        pin("PB7", "CN7-21", &[encoder(4, 2), pulses(4, 2)]),
        pin("PA8", "D7", &[pulses(1, 1)]),
        pin("PA9", "D8", &[pulses(1, 2)]),
        pin("PA10", "D2", &[pulses(1, 3)]),
        pin("PA11", "CN10-14", &[pulses(1, 4)]),
        pin("PC6", "CN10-4", &[pulses(8, 1)]),
        pin("PC7", "D9", &[pulses(8, 2)]),
        pin("PC8", "CN10-2", &[pulses(8, 3)]),
        pin("PC9", "CN10-1", &[pulses(8, 4)]),
        pin("PB10", "D6", &[Bit]),
        pin("PB4", "D5", &[Bit]),
        pin("PB8", "D15", &[Bit, pulses(4, 3)]),
        pin("PB9", "D14", &[Bit, pulses(4, 4)]),
        pin("PB12", "CN10-16", &[Bit]),
        pin("PB13", "CN10-30", &[Bit]),
        pin("PB14", "CN10-28", &[Bit]),
        pin("PB15", "CN10-26", &[Bit]),
    ],
    taken: &[
        ("PA2", "the serial line"),
        ("PA3", "the serial line"),
        ("PB5", "ENABLE of the power stages"),
        ("PA13", "the debugger"),
        ("PA14", "the debugger"),
    ],
    // 84 cycles of sampling and 12 of conversion at 22.5 MHz, and the call.
    conversion_s: 8e-6,
    full_scale_v: 3.3,
    units: Units::Timers,
    pwm_hz: 20_000.0,
    servo_hz: 50.0,
};
