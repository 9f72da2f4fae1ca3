//! Drivers of the rig's pins: converter, decoder of an encoder, pulses of power stages and of
//! servos.

#![allow(dead_code, reason = "a rig uses some of them (src/pins.rs)")]

use core::sync::atomic::{AtomicU16, Ordering};

use embassy_nrf::gpio::{AnyPin, Level, Output, OutputDrive, Pin};
use embassy_nrf::peripherals::QDEC;
use embassy_nrf::pwm::{Instance, Prescaler, SimpleConfig, SimplePwm};
use embassy_nrf::qdec::{self, Qdec, SamplePeriod};
use embassy_nrf::saadc::{ChannelConfig, Input};
use embassy_nrf::{Peri, bind_interrupts, pac};

use crate::pins::{ACTUATORS_WIRED, ANALOGUE_WIRED, SENSORS_WIRED};

/// Steps of a duty. 16 MHz / 1600 = 10 kHz.
pub const PWM_COUNTS: u16 = 1_600;
/// Duty that stands for no size of a signed actuator.
const MIDDLE: u16 = PWM_COUNTS / 2;
/// A servo's unit counts microseconds, 20 ms of them.
const SERVO_COUNTS: u16 = 20_000;
/// Microseconds of a servo's shortest pulse, and how much longer the longest is.
const SERVO_PULSE: u32 = 1_000;
/// Units of pulses.
pub const UNITS: usize = 4;
/// Outputs of a unit.
const OUTPUTS: usize = 4;

bind_interrupts!(struct Interrupts {
    QDEC => qdec::InterruptHandler<QDEC>;
});

/// Sensors and actuators of the rig, in the model's order.
pub struct Wired {
    /// Analogue inputs, for the converter to claim.
    pub analogue: [ChannelConfig<'static>; ANALOGUE_WIRED],
    /// The decoder, where there is an encoder.
    pub decoder: Option<Decoder>,
    /// Sensors: outputs, then channels.
    pub sensors: [Sensor; SENSORS_WIRED],
    /// Actuators.
    pub actuators: [Actuator; ACTUATORS_WIRED],
    /// Units that make pulses. Kept, or their pins would be given back.
    pub units: [Option<SimplePwm<'static>>; UNITS],
}

/// One sensor.
pub enum Sensor {
    /// An analogue input, from 0.
    Analogue(usize),
    /// The decoder.
    Encoder,
}

/// An input of the converter: single-ended, a sixth of it against 0.6 V, so that full scale is
/// 3.6 V.
pub fn analogue(pin: impl Input + 'static) -> ChannelConfig<'static> {
    ChannelConfig::single_ended(pin.degrade_saadc())
}

/// The decoder of an encoder, continued to 16 bits.
pub struct Decoder {
    _pins: Qdec<'static>,
    count: u16,
}

/// An encoder's signals A and B on the decoder. It looks each 128 us, its shortest, without the
/// filter that would ask for twice as long (PS v1.7, 6.17.2).
pub fn decoder(
    unit: Peri<'static, QDEC>,
    a: Peri<'static, impl Pin>,
    b: Peri<'static, impl Pin>,
) -> Option<Decoder> {
    let mut config = qdec::Config::default();
    config.period = SamplePeriod::_128us;
    config.debounce = false;
    Some(Decoder {
        _pins: Qdec::new(unit, Interrupts, a, b, config),
        count: 0,
    })
}

impl Decoder {
    /// Edges so far, modulo 2^16. The accumulator holds 1,023 since the reading before.
    pub fn count(&mut self) -> u16 {
        pac::QDEC.tasks_readclracc().write_value(1);
        // Two's complement: the lower half is the signed number of edges.
        let moved = pac::QDEC.accread().read() & u32::from(u16::MAX);
        self.count = self
            .count
            .wrapping_add(u16::try_from(moved).unwrap_or_default());
        self.count
    }
}

/// Polarity of a pulse (PS v1.7, 6.16.1.2): high while the counter is below it.
const BELOW: u16 = 1 << 15;

/// Pulse of each output, from which the units read; none at first.
static WORDS: [[AtomicU16; OUTPUTS]; UNITS] =
    [const { [const { AtomicU16::new(BELOW) }; OUTPUTS] }; UNITS];

/// One actuator: its unit, and the output from 0.
pub enum Actuator {
    /// Pulses.
    Pwm(usize, usize),
    /// Pulses for the size, a bit for the sign.
    Signed(usize, usize, Output<'static>),
    /// Pulses of a servo.
    Servo(usize, usize),
}

impl Actuator {
    /// Sets a duty of 0 to [`PWM_COUNTS`], for [`load`] to hand over. A servo has no ENABLE: it
    /// gets no pulses while the rig is not live, and lets go.
    pub fn set(&mut self, duty: u16, live: bool) {
        match self {
            Self::Pwm(unit, output) => set(*unit, *output, duty),
            Self::Signed(unit, output, direction) => {
                direction.set_level(Level::from(duty >= MIDDLE));
                set(*unit, *output, 2 * duty.abs_diff(MIDDLE).min(MIDDLE));
            }
            Self::Servo(unit, output) => {
                let longer = SERVO_PULSE * u32::from(duty) / u32::from(PWM_COUNTS);
                let pulse = u16::try_from(SERVO_PULSE + longer).unwrap_or(0);
                set(*unit, *output, if live { pulse } else { 0 });
            }
        }
    }
}

fn set(unit: usize, output: usize, counts: u16) {
    let word = WORDS.get(unit).and_then(|words| words.get(output));
    if let Some(word) = word {
        word.store(counts | BELOW, Ordering::Relaxed);
    }
}

/// Lets each unit read its pulses, which hold from its next period on. Not by the driver, which
/// waits for that: 20 ms of a servo.
pub fn load(units: &[Option<SimplePwm<'static>>; UNITS]) {
    let registers = [pac::PWM0, pac::PWM1, pac::PWM2, pac::PWM3];
    for ((unit, registers), words) in units.iter().zip(registers).zip(&WORDS) {
        if unit.is_none() {
            continue;
        }
        let words = words.as_ptr() as u32;
        registers.dma().seq(0).ptr().write_value(words);
        registers.tasks_dma().seq(0).start().write_value(1);
    }
}

/// An actuator with a bit for its sign.
pub fn signed(unit: usize, output: usize, direction: Peri<'static, impl Pin>) -> Actuator {
    let direction = Output::new(direction, Level::Low, OutputDrive::Standard);
    Actuator::Signed(unit, output, direction)
}

/// A unit of power stages on these pins.
pub fn power<const N: usize>(
    unit: Peri<'static, impl Instance>,
    pins: [Peri<'static, AnyPin>; N],
) -> Option<SimplePwm<'static>> {
    let mut config = SimpleConfig::default();
    config.max_duty = PWM_COUNTS;
    config.prescaler = Prescaler::Div1;
    pulses(unit, pins, &config)
}

/// A unit of servos on these pins.
pub fn servos<const N: usize>(
    unit: Peri<'static, impl Instance>,
    pins: [Peri<'static, AnyPin>; N],
) -> Option<SimplePwm<'static>> {
    let mut config = SimpleConfig::default();
    config.max_duty = SERVO_COUNTS;
    config.prescaler = Prescaler::Div16;
    pulses(unit, pins, &config)
}

/// A unit on its one to four pins.
fn pulses<const N: usize>(
    unit: Peri<'static, impl Instance>,
    pins: [Peri<'static, AnyPin>; N],
    config: &SimpleConfig,
) -> Option<SimplePwm<'static>> {
    let mut pins = pins.into_iter();
    Some(match (pins.next(), pins.next(), pins.next(), pins.next()) {
        (Some(a), Some(b), Some(c), Some(d)) => SimplePwm::new_4ch(unit, a, b, c, d, config),
        (Some(a), Some(b), Some(c), None) => SimplePwm::new_3ch(unit, a, b, c, config),
        (Some(a), Some(b), None, _) => SimplePwm::new_2ch(unit, a, b, config),
        (Some(a), None, ..) => SimplePwm::new_1ch(unit, a, config),
        (None, ..) => return None,
    })
}
