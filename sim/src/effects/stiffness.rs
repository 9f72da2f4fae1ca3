//! What a spring does beyond Hooke (docs/plant.md, eq. 11).

use super::{At, Description, Effect, Energy, Family, Port, Quantity, Sign, Slopes, parameter};
use crate::scalar::Scalar;

/// `F = -coefficient x^3`; a negative coefficient softens (eq. 11a).
pub(super) struct Cubic;

impl Effect for Cubic {
    const DESCRIPTION: Description = Description {
        kind: "cubic_stiffness",
        family: Family::Stiffness,
        ports: &[Port::Spring],
        energy: Energy::Conserves,
        law: "F = -coefficient x^3",
        parameters: &[parameter(
            "coefficient",
            Quantity::CubicStiffness,
            Sign::Any,
        )],
    };

    #[inline]
    fn force<S: Scalar>(p: &[S], at: &At<S>) -> S {
        -(p[0] * at.position * at.position * at.position)
    }

    fn slopes(p: &[f64], at: &At<f64>) -> Slopes {
        Slopes {
            stiffness: 3.0 * (p[0] * at.position * at.position).abs(),
            damping: 0.0,
        }
    }
}

/// `F = -coefficient x^2`: stiffer one way than the other (eq. 11b).
pub(super) struct Quadratic;

impl Effect for Quadratic {
    const DESCRIPTION: Description = Description {
        kind: "quadratic_stiffness",
        family: Family::Stiffness,
        ports: &[Port::Spring],
        energy: Energy::Conserves,
        law: "F = -coefficient x^2",
        parameters: &[parameter(
            "coefficient",
            Quantity::QuadraticStiffness,
            Sign::Any,
        )],
    };

    #[inline]
    fn force<S: Scalar>(p: &[S], at: &At<S>) -> S {
        -(p[0] * at.position * at.position)
    }

    fn slopes(p: &[f64], at: &At<f64>) -> Slopes {
        Slopes {
            stiffness: 2.0 * (p[0] * at.position).abs(),
            damping: 0.0,
        }
    }
}
