//! Pins of the rig's sensors and actuators, in the model's order: A0 to A5, and timer 1's outputs.
//!
//! `sinew emit --wiring` and `sinew flash --wiring` print this file from a rig's own wiring.

/// Sensors that are wired.
pub const SENSORS_WIRED: usize = 6;
/// Actuators that are wired.
pub const ACTUATORS_WIRED: usize = 4;

/// Claims the pins of the peripherals `p`, and starts what reads and drives them.
macro_rules! wired {
    ($p:ident) => {
        $crate::drivers::Wired {
            sensors: [
                $crate::drivers::analogue($p.PA0),
                $crate::drivers::analogue($p.PA1),
                $crate::drivers::analogue($p.PA4),
                $crate::drivers::analogue($p.PB0),
                $crate::drivers::analogue($p.PC1),
                $crate::drivers::analogue($p.PC0),
            ],
            actuators: [
                $crate::drivers::Actuator::Pwm($crate::drivers::Timer::Tim1, 0),
                $crate::drivers::Actuator::Pwm($crate::drivers::Timer::Tim1, 1),
                $crate::drivers::Actuator::Pwm($crate::drivers::Timer::Tim1, 2),
                $crate::drivers::Actuator::Pwm($crate::drivers::Timer::Tim1, 3),
            ],
            timers: $crate::drivers::Timers {
                tim1: $crate::drivers::pulses(
                    $crate::drivers::PWM_HZ,
                    $p.TIM1,
                    $crate::drivers::output($p.PA8),
                    $crate::drivers::output($p.PA9),
                    $crate::drivers::output($p.PA10),
                    $crate::drivers::output($p.PA11),
                ),
                tim3: None,
                tim4: None,
                tim8: None,
            },
        }
    };
}
pub(crate) use wired;
