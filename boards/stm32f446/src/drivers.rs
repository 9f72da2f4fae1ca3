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
use embassy_stm32::timer::{
    Ch1, Ch2, Ch3, Ch4, Channel, GeneralInstance4Channel, TimerChannel, TimerPin,
};

use crate::pins::{ACTUATORS_WIRED, SENSORS_WIRED};

/// Pulses of a power stage a second: beyond hearing.
pub const PWM_HZ: Hertz = Hertz(20_000);
/// Steps of a duty: timers 1 and 8 count 180 MHz. Timers 3 and 4 count half of it, and take every
/// second step.
pub const PWM_COUNTS: u16 = 9_000;
/// Duty that stands for no size of a signed actuator.
const MIDDLE: u16 = PWM_COUNTS / 2;
/// Pulses of a servo a second.
pub const SERVO_HZ: Hertz = Hertz(50);
/// A servo's pulse is 1 to 2 of the 20 ms of its period.
const SERVO_SHARES: u32 = 20;

/// Sensors and actuators of the rig, in the model's order.
pub struct Wired {
    /// Sensors: outputs, then channels.
    pub sensors: [Sensor; SENSORS_WIRED],
    /// Actuators.
    pub actuators: [Actuator; ACTUATORS_WIRED],
    /// Timers that make their pulses.
    pub timers: Timers,
}

/// Timers that make pulses. Kept, or their pins would be given back.
pub struct Timers {
    /// Timer 1.
    pub tim1: Option<SimplePwm<'static, TIM1>>,
    /// Timer 3, where it counts no encoder.
    pub tim3: Option<SimplePwm<'static, TIM3>>,
    /// Timer 4, where it counts no encoder.
    pub tim4: Option<SimplePwm<'static, TIM4>>,
    /// Timer 8.
    pub tim8: Option<SimplePwm<'static, TIM8>>,
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

/// A timer that makes pulses.
#[derive(Clone, Copy)]
pub enum Timer {
    /// Timer 1.
    Tim1,
    /// Timer 3.
    Tim3,
    /// Timer 4.
    Tim4,
    /// Timer 8.
    Tim8,
}

impl Timer {
    /// Counts of its period.
    fn period(self) -> u32 {
        let last = match self {
            Self::Tim1 => pac::TIM1.arr().read().arr(),
            Self::Tim3 => pac::TIM3.arr().read().arr(),
            Self::Tim4 => pac::TIM4.arr().read().arr(),
            Self::Tim8 => pac::TIM8.arr().read().arr(),
        };
        u32::from(last) + 1
    }

    /// Sets a pulse's counts from the next period on.
    fn set(self, channel: usize, counts: u32) {
        let counts = u16::try_from(counts).unwrap_or(u16::MAX);
        match self {
            Self::Tim1 => pac::TIM1.ccr(channel).write(|w| w.set_ccr(counts)),
            Self::Tim3 => pac::TIM3.ccr(channel).write(|w| w.set_ccr(counts)),
            Self::Tim4 => pac::TIM4.ccr(channel).write(|w| w.set_ccr(counts)),
            Self::Tim8 => pac::TIM8.ccr(channel).write(|w| w.set_ccr(counts)),
        }
    }

    /// Sets a pulse of a duty's part of the period.
    fn set_duty(self, channel: usize, duty: u16) {
        self.set(
            channel,
            self.period() * u32::from(duty) / u32::from(PWM_COUNTS),
        );
    }
}

/// One actuator: its timer, and the channel from 0.
pub enum Actuator {
    /// Pulses.
    Pwm(Timer, usize),
    /// Pulses for the size, a bit for the sign.
    Signed(Timer, usize, Output<'static>),
    /// Pulses of a servo.
    Servo(Timer, usize),
}

impl Actuator {
    /// Sets a duty of 0 to [`PWM_COUNTS`]. A servo has no ENABLE: it gets no pulses while the rig
    /// is not live, and lets go.
    pub fn drive(&mut self, duty: u16, live: bool) {
        match self {
            Self::Pwm(timer, channel) => timer.set_duty(*channel, duty),
            Self::Signed(timer, channel, direction) => {
                direction.set_level(Level::from(duty >= MIDDLE));
                timer.set_duty(*channel, 2 * duty.abs_diff(MIDDLE).min(MIDDLE));
            }
            Self::Servo(timer, channel) => {
                let shortest = timer.period() / SERVO_SHARES;
                let pulse = shortest + shortest * u32::from(duty) / u32::from(PWM_COUNTS);
                timer.set(*channel, if live { pulse } else { 0 });
            }
        }
    }
}

/// An actuator with a bit for its sign.
pub fn signed(timer: Timer, channel: usize, direction: Peri<'static, impl Pin>) -> Actuator {
    Actuator::Signed(
        timer,
        channel,
        Output::new(direction, Level::Low, Speed::Low),
    )
}

/// A pin that makes pulses.
pub fn output<T: GeneralInstance4Channel, C: TimerChannel>(
    pin: Peri<'static, impl TimerPin<T, C>>,
) -> Option<PwmPin<'static, T, C>> {
    Some(PwmPin::new(pin, OutputType::PushPull))
}

/// A timer on the pins of its channels, those that are there.
pub fn pulses<T: GeneralInstance4Channel>(
    rate: Hertz,
    timer: Peri<'static, T>,
    one: Option<PwmPin<'static, T, Ch1>>,
    two: Option<PwmPin<'static, T, Ch2>>,
    three: Option<PwmPin<'static, T, Ch3>>,
    four: Option<PwmPin<'static, T, Ch4>>,
) -> Option<SimplePwm<'static, T>> {
    let mut timer = SimplePwm::new(timer, one, two, three, four, rate, Default::default());
    for channel in [Channel::Ch1, Channel::Ch2, Channel::Ch3, Channel::Ch4] {
        timer.channel(channel).enable();
    }
    Some(timer)
}
