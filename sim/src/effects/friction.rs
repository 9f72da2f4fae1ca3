//! Dry friction: it opposes sliding and holds what rests (docs/plant.md, eq. 6 to 9).
//!
//! Each law is written for a body that slides one way, with `direction` standing for sign(v); the
//! integrator switches the direction at the instant of reversal and holds a resting body exactly
//! while the other forces stay within [`Effect::hold`]. Nothing is smoothed.

use super::{
    At, Description, Effect, Energy, Family, ParameterSpec, Port, Quantity, Sign, Slopes, parameter,
};
use crate::scalar::Scalar;

const fn friction(
    kind: &'static str,
    law: &'static str,
    parameters: &'static [ParameterSpec],
) -> Description {
    Description {
        kind,
        family: Family::Friction,
        ports: &[Port::Body],
        energy: Energy::Dissipates,
        law,
        parameters,
    }
}

/// `F = -level sign(v)`, holding up to `level` (eq. 6).
pub(super) struct Coulomb;

impl Effect for Coulomb {
    const DESCRIPTION: Description = friction(
        "coulomb_friction",
        "F = -level sign(v)",
        &[parameter("level", Quantity::Force, Sign::NonNegative)],
    );

    #[inline]
    fn force<S: Scalar>(p: &[S], at: &At<S>) -> S {
        p[0] * -at.direction
    }

    fn slopes(_p: &[f64], _at: &At<f64>) -> Slopes {
        Slopes::default()
    }

    fn hold<S: Scalar>(p: &[S]) -> [S; 2] {
        [p[0]; 2]
    }
}

/// `F = -(level + (static_level - level) exp(-(v/velocity)^2)) sign(v)`, holding up to
/// `static_level` (eq. 7).
pub(super) struct Stribeck;

impl Effect for Stribeck {
    const DESCRIPTION: Description = friction(
        "stribeck_friction",
        "F = -(level + (static_level - level) exp(-(v/velocity)^2)) sign(v)",
        &[
            parameter("level", Quantity::Force, Sign::NonNegative),
            parameter("static_level", Quantity::Force, Sign::NonNegative),
            parameter("velocity", Quantity::Velocity, Sign::Positive),
        ],
    );

    #[inline]
    fn force<S: Scalar>(p: &[S], at: &At<S>) -> S {
        let ratio = at.velocity / p[2];
        (p[0] + (p[1] - p[0]) * (-(ratio * ratio)).exp()) * -at.direction
    }

    /// The steepest point of the bell: sqrt(2/e) per width.
    fn slopes(p: &[f64], _at: &At<f64>) -> Slopes {
        Slopes {
            stiffness: 0.0,
            damping: 0.857_763_884_960_707 * ((p[1] - p[0]) / p[2]).abs(),
        }
    }

    fn hold<S: Scalar>(p: &[S]) -> [S; 2] {
        [p[1]; 2]
    }
}

/// Forward `F = -level_pos - damping_pos v`, backward `F = level_neg - damping_neg v`, holding
/// within the two levels (eq. 8).
pub(super) struct DirectionDependent;

impl Effect for DirectionDependent {
    const DESCRIPTION: Description = friction(
        "direction_dependent_friction",
        "F = -level_pos - damping_pos v forward, level_neg - damping_neg v backward",
        &[
            parameter("level_pos", Quantity::Force, Sign::NonNegative),
            parameter("level_neg", Quantity::Force, Sign::NonNegative),
            parameter("damping_pos", Quantity::Damping, Sign::NonNegative),
            parameter("damping_neg", Quantity::Damping, Sign::NonNegative),
        ],
    );

    #[inline]
    fn force<S: Scalar>(p: &[S], at: &At<S>) -> S {
        if at.direction > 0.0 {
            -(p[0] + p[2] * at.velocity)
        } else {
            p[1] - p[3] * at.velocity
        }
    }

    fn slopes(p: &[f64], _at: &At<f64>) -> Slopes {
        Slopes {
            stiffness: 0.0,
            damping: p[2].abs().max(p[3].abs()),
        }
    }

    fn hold<S: Scalar>(p: &[S]) -> [S; 2] {
        [p[0], p[1]]
    }
}
