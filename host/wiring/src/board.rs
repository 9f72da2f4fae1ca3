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
    /// Output of a timer that makes pulses: of power stages, or of servos.
    Pulses {
        /// The timer.
        timer: u8,
        /// Channel of the timer.
        channel: u8,
    },
    /// Output of one bit, such as a direction.
    Bit,
    /// Anything digital: the chip routes pulses, both inputs of its decoder and bits to it.
    Routed,
}

impl Use {
    /// Pulses can come out of it.
    pub(crate) fn is_pulses(self) -> bool {
        matches!(self, Self::Pulses { .. } | Self::Routed)
    }

    /// A bit can come out of it.
    pub(crate) fn is_bit(self) -> bool {
        matches!(self, Self::Bit | Self::Routed)
    }
}

/// A pin of a board's headers.
#[derive(Clone, Copy, Debug)]
pub struct Pin {
    /// Name in the chip's manual, for instance `PA0` or `P0.03`.
    pub name: &'static str,
    /// Place on the board, for instance `A0` or `CN10-14`.
    pub place: &'static str,
    /// Its uses.
    pub uses: &'static [Use],
}

/// Peripherals behind the digital pins.
#[derive(Clone, Copy, Debug)]
pub enum Units {
    /// Timers on the pins that their uses name. One counts an encoder, or makes pulses of one rate.
    Timers,
    /// Units of pulses and one decoder, which the chip routes to any digital pin.
    Routed {
        /// Units, each of one rate.
        units: usize,
        /// Outputs of a unit.
        channels: usize,
        /// The decoder of an encoder.
        decoder: Decoder,
    },
}

/// A decoder that looks at its encoder's signals at times, rather than at each edge.
#[derive(Clone, Copy, Debug)]
pub struct Decoder {
    /// Seconds between two looks; each sees one edge at most.
    pub look_s: f64,
    /// Largest number of edges that it holds until it is read.
    pub holds: f64,
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
    /// Voltage that [`SensorBy::Analogue`](crate::SensorBy) calls full.
    pub full_scale_v: f64,
    /// Peripherals behind the digital pins.
    pub units: Units,
    /// Pulses of a power stage a second.
    pub pwm_hz: f64,
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
