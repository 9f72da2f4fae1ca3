//! Values of flags that other rooms define, with their words and their help.
//!
//! The rooms know no command line; each word stands here once.

use clap::ValueEnum;
use clap::builder::PossibleValue;

use crate::closed_loop::disturbance::Disturbance;
use crate::new_rig::Motion;
use crate::project::{Board, Optimise};
use crate::tuning::objective::Objective;
use crate::tuning::tune::Method;

/// One value of a flag.
fn word(name: &'static str, help: &'static str) -> Option<PossibleValue> {
    Some(PossibleValue::new(name).help(help))
}

impl ValueEnum for Board {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let help = match self {
            Self::Qemu => {
                "QEMU's mps2-an386, a Cortex-M4F: instruction counts are exact, time is not"
            }
            Self::Host => "This computer, the same code over a pipe",
            Self::Stm32f446 => "A Nucleo-F446RE",
            Self::Nrf52840 => "An nRF52840 DK",
        };
        word(self.folder(), help)
    }
}

impl ValueEnum for Optimise {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::Speed, Self::Size]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        match self {
            Self::Speed => word("speed", "As few instructions a step as it knows how to"),
            Self::Size => word(
                "size",
                "A quarter to nearly half less flash, 12 to 36 % more instructions a step \
                 (docs/lab/0055): loops stay loops, but for the network's own",
            ),
        }
    }
}

impl ValueEnum for Disturbance {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::None, Self::Step, Self::Ramp, Self::Sine]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let help = match self {
            Self::None => "None",
            Self::Step => "A fifth of half the input's range, from a quarter of the run on",
            Self::Ramp => {
                "Rises to a fifth of half the input's range, from a quarter of the run to its end"
            }
            Self::Sine => {
                "A sine of that amplitude, four periods over the last three quarters of the run"
            }
        };
        word(self.name(), help)
    }
}

impl ValueEnum for Objective {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::Tracking, Self::Smooth, Self::Peak]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let help = match self {
            Self::Tracking => {
                "Mean square error, and 1e-5 of the mean square change of the command"
            }
            Self::Smooth => "Mean square error, and 1e-2 of the mean square change of the command",
            Self::Peak => {
                "Square of the largest error, and 1e-5 of the mean square change of the command"
            }
        };
        word(self.name(), help)
    }
}

impl ValueEnum for Method {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::Simplex, Self::Gradient, Self::Population]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, help) = match self {
            Self::Simplex => ("simplex", "Nelder-Mead from several starts"),
            Self::Gradient => (
                "gradient",
                "Levenberg-Marquardt on derivatives of the closed loop, for the MPC alone",
            ),
            Self::Population => ("population", "CMA-ES from several starts, then Nelder-Mead"),
        };
        word(name, help)
    }
}

impl ValueEnum for Motion {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::Slide, Self::Hinge]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        match self {
            Self::Slide => word("slide", "Along a line"),
            Self::Hinge => word("hinge", "About an axis"),
        }
    }
}
