//! A board that can be wired: its pins, and the uses of each.

/// Use of a pin. Timers and channels count from 1, as in the chip's manual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// Input of the analogue-to-digital converter.
    Analogue,
    /// First (1) or second (2) input of a timer that counts a quadrature encoder.
    Encoder {
        /// The timer.
        timer: u8,
        /// 1 for signal A, 2 for signal B.
        phase: u8,
    },
    /// Output of the timer that makes the power stages' pulses.
    Pwm {
        /// Channel of the timer.
        channel: u8,
    },
    /// Output of the timer that makes a servo's pulses.
    Servo {
        /// Channel of the timer.
        channel: u8,
    },
    /// Output of one bit, such as a direction.
    Bit,
}

/// A pin of a board's headers.
#[derive(Clone, Copy, Debug)]
pub struct Pin {
    /// Name in the chip's manual, for instance `PA0`.
    pub name: &'static str,
    /// Place on the board, for instance `A0` or `CN10-14`.
    pub place: &'static str,
    /// Its uses.
    pub uses: &'static [Use],
}

/// A board's pins and speeds.
#[derive(Clone, Copy, Debug)]
pub struct Board {
    /// Name on the command line, and folder under `boards/`.
    pub name: &'static str,
    /// Name for people.
    pub title: &'static str,
    /// Its pins, in the order in which a first wiring takes them.
    pub pins: &'static [Pin],
    /// Pins that the firmware itself uses, each with its purpose.
    pub taken: &'static [(&'static str, &'static str)],
    /// Seconds that one analogue input takes.
    pub conversion_s: f64,
    /// Voltage of the converter's largest code.
    pub full_scale_v: f64,
    /// Timer of the power stages' pulses.
    pub pwm: &'static str,
    /// Timer of the servos' pulses.
    pub servo: &'static str,
    /// Pulses of a servo a second.
    pub servo_hz: f64,
}

impl Board {
    /// The pin of this name.
    pub fn pin(&self, name: &str) -> Option<&'static Pin> {
        self.pins.iter().find(|pin| pin.name == name)
    }

    /// Names of the pins that can be this, for a message.
    pub(crate) fn able(&self, able: impl Fn(Use) -> bool) -> String {
        let pins = self.pins.iter();
        let names = pins.filter(|pin| pin.uses.iter().any(|of| able(*of)));
        names.map(|pin| pin.name).collect::<Vec<_>>().join(", ")
    }
}
