//! Drivers of the rig's pins: converter, encoder timers, pulses of power stages and of
//! servos.

#![allow(dead_code, reason = "a rig uses some of them (src/pins.rs)")]

use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, AdcChannel, AnyAdcChannel, SampleTime};
use embassy_stm32::gpio::{Level, Output, OutputType, Pin, Pull, Speed};
use embassy_stm32::pac;
use embassy_stm32::peripherals::{ADC1, TIM1, TIM3, TIM4, TIM8};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::qei::{Config, Qei};
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm};
use embassy_stm32::timer::{Ch1, Ch2, Ch3, Ch4, GeneralInstance4Channel, TimerChannel, TimerPin};

use crate::pins::{ACTUATORS_WIRED, SENSORS_WIRED};

/// Pulses of a power stage a second: beyond hearing.
pub const PWM_HZ: u32 = 20_000;
/// Timer 1 counts 180 MHz.
pub const PWM_COUNTS: u16 = 9_000;
/// Channels of a timer.
const CHANNELS: usize = 4;
/// Duty that stands for no size of a signed actuator.
const MIDDLE: u16 = PWM_COUNTS / 2;
/// Pulses of a servo a second.
pub const SERVO_HZ: u32 = 50;
/// A servo's pulse is 1 to 2 of the 20 ms of its period.
const SERVO_SHARES: u32 = 20;

/// Sensors and actuators of the rig, in the model's order.
pub struct Wired {
    /// Sensors: outputs, then channels.
    pub sensors: [Sensor; SENSORS_WIRED],
    /// Actuators.
    pub actuators: [Actuator; ACTUATORS_WIRED],
    /// Kept, or its pins would be given back.
    pub pwm: Option<SimplePwm<'static, TIM1>>,
    /// Kept, or its pins would be given back.
    pub servo: Option<SimplePwm<'static, TIM8>>,
}

/// One sensor.
pub enum Sensor {
    /// Input of the converter.
    Analogue(AnyAdcChannel<'static, ADC1>),
    /// Encoder on timer 3.
    Timer3(Qei<'static, TIM3>),
    /// Encoder on timer 4.
    Timer4(Qei<'static, TIM4>),
}

impl Sensor {
    /// Code of the converter or counter of the encoder. A conversion takes about 8 us: 84 cycles of
    /// sampling at 22.5 MHz suit a source of 10 kilohms (DS10693, 6.3.20).
    pub fn read(&mut self, adc: &mut Adc<'static, ADC1>) -> u16 {
        match self {
            Self::Analogue(channel) => adc.blocking_read(channel, SampleTime::CYCLES84),
            Self::Timer3(encoder) => encoder.count(),
            Self::Timer4(encoder) => encoder.count(),
        }
    }
}

/// An input of the converter.
pub fn analogue(pin: impl AdcChannel<ADC1> + 'static) -> Sensor {
    Sensor::Analogue(pin.degrade_adc())
}

/// Every edge counts. Encoders with open outputs need the pull-up, others do not mind it.
fn pulled_up() -> Config {
    Config {
        ch1_pull: Pull::Up,
        ch2_pull: Pull::Up,
        ..Config::default()
    }
}

/// An encoder on timer 3: signals A and B.
pub fn encoder3(
    timer: Peri<'static, TIM3>,
    a: Peri<'static, impl TimerPin<TIM3, Ch1>>,
    b: Peri<'static, impl TimerPin<TIM3, Ch2>>,
) -> Sensor {
    Sensor::Timer3(Qei::new(timer, a, b, pulled_up()))
}

/// An encoder on timer 4: signals A and B.
pub fn encoder4(
    timer: Peri<'static, TIM4>,
    a: Peri<'static, impl TimerPin<TIM4, Ch1>>,
    b: Peri<'static, impl TimerPin<TIM4, Ch2>>,
) -> Sensor {
    Sensor::Timer4(Qei::new(timer, a, b, pulled_up()))
}

/// One actuator; channels count from 0.
pub enum Actuator {
    /// A channel of timer 1.
    Pwm(usize),
    /// A channel of timer 1 for the size, a bit for the sign.
    Signed(usize, Output<'static>),
    /// A channel of timer 8.
    Servo(usize),
}

impl Actuator {
    /// Sets a duty of 0 to [`PWM_COUNTS`]. A servo has no ENABLE: it gets no pulses while the rig
    /// is not live, and lets go.
    pub fn drive(&mut self, duty: u16, live: bool) {
        match self {
            Self::Pwm(channel) => set_pwm(*channel, duty),
            Self::Signed(channel, direction) => {
                direction.set_level(Level::from(duty >= MIDDLE));
                set_pwm(*channel, 2 * duty.abs_diff(MIDDLE).min(MIDDLE));
            }
            Self::Servo(channel) => {
                let shortest = (u32::from(pac::TIM8.arr().read().arr()) + 1) / SERVO_SHARES;
                let pulse = shortest + shortest * u32::from(duty) / u32::from(PWM_COUNTS);
                let pulse = u16::try_from(pulse).unwrap_or(u16::MAX);
                let pulse = if live { pulse } else { 0 };
                pac::TIM8.ccr(*channel).write(|w| w.set_ccr(pulse));
            }
        }
    }
}

fn set_pwm(channel: usize, duty: u16) {
    pac::TIM1.ccr(channel).write(|w| w.set_ccr(duty));
}

/// An actuator with a bit for its sign.
pub fn signed(channel: usize, direction: Peri<'static, impl Pin>) -> Actuator {
    Actuator::Signed(channel, Output::new(direction, Level::Low, Speed::Low))
}

/// A pin that makes pulses.
pub fn output<T: GeneralInstance4Channel, C: TimerChannel>(
    pin: Peri<'static, impl TimerPin<T, C>>,
) -> Option<PwmPin<'static, T, C>> {
    Some(PwmPin::new(pin, OutputType::PushPull))
}

/// Timer 1 on the pins of its channels, those that are there.
pub fn pwm(
    timer: Peri<'static, TIM1>,
    one: Option<PwmPin<'static, TIM1, Ch1>>,
    two: Option<PwmPin<'static, TIM1, Ch2>>,
    three: Option<PwmPin<'static, TIM1, Ch3>>,
    four: Option<PwmPin<'static, TIM1, Ch4>>,
) -> Option<SimplePwm<'static, TIM1>> {
    let rate = Hertz(PWM_HZ);
    let timer = SimplePwm::new(timer, one, two, three, four, rate, Default::default());
    for channel in 0..CHANNELS {
        pac::TIM1.ccer().modify(|w| w.set_cce(channel, true));
    }
    Some(timer)
}

/// Timer 8 on the pins of its channels, those that are there.
pub fn servo(
    timer: Peri<'static, TIM8>,
    one: Option<PwmPin<'static, TIM8, Ch1>>,
    two: Option<PwmPin<'static, TIM8, Ch2>>,
    three: Option<PwmPin<'static, TIM8, Ch3>>,
    four: Option<PwmPin<'static, TIM8, Ch4>>,
) -> Option<SimplePwm<'static, TIM8>> {
    let rate = Hertz(SERVO_HZ);
    let timer = SimplePwm::new(timer, one, two, three, four, rate, Default::default());
    for channel in 0..CHANNELS {
        pac::TIM8.ccer().modify(|w| w.set_cce(channel, true));
    }
    Some(timer)
}
