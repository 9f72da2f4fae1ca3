//! Pins of a Nucleo-F446RE (UM1724, table 16 and figure 18; DS10693, table 11).

use crate::board::{Board, Pin, Use};

const fn pin(name: &'static str, place: &'static str, uses: &'static [Use]) -> Pin {
    Pin { name, place, uses }
}

const fn encoder(timer: u8, phase: u8) -> Use {
    Use::Encoder { timer, phase }
}

const fn pwm(channel: u8) -> Use {
    Use::Pwm { channel }
}

const fn servo(channel: u8) -> Use {
    Use::Servo { channel }
}

use Use::{Analogue, Bit};

/// Encoders count in timers 3 and 4, power stages are timer 1's, servos timer 8's. Timer 2 paces
/// the loop, timer 5 is the clock of embassy.
pub(crate) const BOARD: Board = Board {
    name: "stm32f446",
    title: "Nucleo-F446RE",
    pins: &[
        pin("PA0", "A0", &[Analogue]),
        pin("PA1", "A1", &[Analogue]),
        pin("PA4", "A2", &[Analogue]),
        pin("PB0", "A3", &[Analogue]),
        pin("PC1", "A4", &[Analogue]),
        pin("PC0", "A5", &[Analogue]),
        pin("PC2", "CN7-35", &[Analogue]),
        pin("PC3", "CN7-37", &[Analogue]),
        pin("PB1", "CN10-24", &[Analogue]),
        pin("PC4", "CN10-34", &[Analogue]),
        pin("PC5", "CN10-6", &[Analogue]),
        pin("PA6", "D12", &[Analogue, encoder(3, 1)]),
        pin("PA7", "D11", &[Analogue, encoder(3, 2)]),
        pin("PA5", "D13", &[Analogue]),
        pin("PB6", "D10", &[encoder(4, 1)]),
        pin("PB7", "CN7-21", &[encoder(4, 2)]),
        pin("PA8", "D7", &[pwm(1)]),
        pin("PA9", "D8", &[pwm(2)]),
        pin("PA10", "D2", &[pwm(3)]),
        pin("PA11", "CN10-14", &[pwm(4)]),
        pin("PC6", "CN10-4", &[servo(1)]),
        pin("PC7", "D9", &[servo(2)]),
        pin("PC8", "CN10-2", &[servo(3)]),
        pin("PC9", "CN10-1", &[servo(4)]),
        pin("PB10", "D6", &[Bit]),
        pin("PB4", "D5", &[Bit]),
        pin("PB8", "D15", &[Bit]),
        pin("PB9", "D14", &[Bit]),
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
    pwm: "TIM1",
    servo: "TIM8",
    servo_hz: 50.0,
};
