//! Forces from outside (docs/plant.md, eq. 12).

use super::{
    At, Description, Effect, Energy, Family, Motion, ParameterSpec, Port, Quantity, Sign, Slopes,
    parameter,
};
use crate::scalar::Scalar;

const fn load(
    kind: &'static str,
    law: &'static str,
    parameters: &'static [ParameterSpec],
) -> Description {
    Description {
        kind,
        family: Family::Load,
        ports: &[Port::Body],
        energy: Energy::Conserves,
        law,
        parameters,
    }
}

/// Slide: `F = -amplitude`; hinge: `F = -amplitude sin(q - zero)` (eq. 12a).
pub(super) struct Gravity;

impl Effect for Gravity {
    const DESCRIPTION: Description = load(
        "gravity_load",
        "F = -amplitude on a slide, -amplitude sin(q - zero) on a hinge",
        &[
            parameter("amplitude", Quantity::Force, Sign::Any),
            ParameterSpec {
                default: Some(0.0),
                ..parameter("zero", Quantity::Coordinate, Sign::Any)
            },
        ],
    );

    #[inline]
    fn force<S: Scalar>(p: &[S], at: &At<S>) -> S {
        match at.motion {
            Motion::Slide => -p[0],
            Motion::Hinge => -(p[0] * (at.position - p[1]).sin()),
        }
    }

    fn slopes(p: &[f64], at: &At<f64>) -> Slopes {
        Slopes {
            stiffness: match at.motion {
                Motion::Slide => 0.0,
                Motion::Hinge => p[0].abs(),
            },
            damping: 0.0,
        }
    }
}

/// `F = level` (eq. 12b).
pub(super) struct Constant;

impl Effect for Constant {
    const DESCRIPTION: Description = load(
        "constant_load",
        "F = level",
        &[parameter("level", Quantity::Force, Sign::Any)],
    );

    #[inline]
    fn force<S: Scalar>(p: &[S], _at: &At<S>) -> S {
        p[0]
    }

    fn slopes(_p: &[f64], _at: &At<f64>) -> Slopes {
        Slopes::default()
    }
}

/// `F = amplitude sin(wave_number q + phase)`: cogging, eccentricity (eq. 12c).
pub(super) struct PositionRipple;

impl Effect for PositionRipple {
    const DESCRIPTION: Description = load(
        "position_ripple",
        "F = amplitude sin(wave_number q + phase)",
        &[
            parameter("amplitude", Quantity::Force, Sign::Any),
            parameter("wave_number", Quantity::WaveNumber, Sign::Any),
            parameter("phase", Quantity::Phase, Sign::Any),
        ],
    );

    #[inline]
    fn force<S: Scalar>(p: &[S], at: &At<S>) -> S {
        p[0] * (p[1] * at.position + p[2]).sin()
    }

    fn slopes(p: &[f64], _at: &At<f64>) -> Slopes {
        Slopes {
            stiffness: (p[0] * p[1]).abs(),
            damping: 0.0,
        }
    }
}
