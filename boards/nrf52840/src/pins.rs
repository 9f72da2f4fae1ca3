//! Pins of the rig's sensors and actuators, in the model's order: A0 to A5, and D8 to D11.
//!
//! `sinew emit --wiring` and `sinew flash --wiring` print this file from a rig's own wiring.

/// Sensors that are wired.
pub const SENSORS_WIRED: usize = 6;
/// Actuators that are wired.
pub const ACTUATORS_WIRED: usize = 4;
/// Analogue inputs that are wired.
pub const ANALOGUE_WIRED: usize = 6;

/// Claims the pins of the peripherals `p`, and starts what reads and drives them.
macro_rules! wired {
    ($p:ident) => {
        $crate::drivers::Wired {
            analogue: [
                $crate::drivers::analogue($p.P0_03),
                $crate::drivers::analogue($p.P0_04),
                $crate::drivers::analogue($p.P0_28),
                $crate::drivers::analogue($p.P0_29),
                $crate::drivers::analogue($p.P0_30),
                $crate::drivers::analogue($p.P0_31),
            ],
            decoder: None,
            sensors: [
                $crate::drivers::Sensor::Analogue(0),
                $crate::drivers::Sensor::Analogue(1),
                $crate::drivers::Sensor::Analogue(2),
                $crate::drivers::Sensor::Analogue(3),
                $crate::drivers::Sensor::Analogue(4),
                $crate::drivers::Sensor::Analogue(5),
            ],
            actuators: [
                $crate::drivers::Actuator::Pwm(0, 0),
                $crate::drivers::Actuator::Pwm(0, 1),
                $crate::drivers::Actuator::Pwm(0, 2),
                $crate::drivers::Actuator::Pwm(0, 3),
            ],
            units: [
                $crate::drivers::power(
                    $p.PWM0,
                    [
                        $p.P1_10.into(),
                        $p.P1_11.into(),
                        $p.P1_12.into(),
                        $p.P1_13.into(),
                    ],
                ),
                None,
                None,
                None,
            ],
        }
    };
}
pub(crate) use wired;
