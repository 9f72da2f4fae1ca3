//! Damping that the rig has no component for (docs/explanation/plant.md, eq. 10).

use super::{
    At, Description, Effect, Energy, Explanation, Family, Motion, Port, Quantity, Scales, Sign,
    Slopes, strength,
};
use crate::scalar::Scalar;

/// `F = -damping v` (eq. 10a).
pub(super) struct Viscous;

impl Effect for Viscous {
    const FOLLOWS_SIGNALS: bool = true;

    const DESCRIPTION: Description = Description {
        kind: "viscous_damping",
        family: Family::Damping,
        ports: &[Port::Body, Port::Spring],
        energy: Energy::Dissipates,
        law: "F = -damping v",
        equation: "10a",
        parameters: &[strength("damping", Quantity::Damping, Sign::NonNegative)],
        confusable: &["quadratic_drag", "viscoelastic_creep", "coulomb_friction"],
        excited_by: "motion at several speeds",
        sentence: "Viscous damping of {damping} at {component} is missing from the model.",
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Lubricant, air gap, eddy currents or back-EMF. The force is proportional to the \
                velocity.",
        parameters: &[("damping", "force over velocity")],
        next: "Add a damper to the rig if the device has one by design. Record several speeds: \
               drag grows with their square, dry friction not at all.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let damping = scales.force / scales.velocity;
        vec![vec![0.05 * damping], vec![0.5 * damping]]
    }

    #[inline]
    fn force<S: Scalar>(p: &[S], at: &At<S>) -> S {
        -(p[0] * at.velocity)
    }

    fn straight(_motion: Motion) -> bool {
        true
    }

    fn slopes(p: &[f64], _at: &At<f64>) -> Slopes {
        Slopes {
            stiffness: 0.0,
            damping: p[0].abs(),
        }
    }
}

/// `F = -coefficient v |v|` (eq. 10b).
pub(super) struct QuadraticDrag;

impl Effect for QuadraticDrag {
    const DESCRIPTION: Description = Description {
        kind: "quadratic_drag",
        family: Family::Damping,
        ports: &[Port::Body],
        energy: Energy::Dissipates,
        law: "F = -coefficient v |v|",
        equation: "10b",
        parameters: &[strength("coefficient", Quantity::Drag, Sign::NonNegative)],
        confusable: &["viscous_damping"],
        excited_by: "motion at low and at high speed",
        sentence: "Drag of {coefficient} times the speed squared at {component} is missing from the \
                   model.",
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Drag of a fluid that is displaced: air at speed, oil through an orifice.",
        parameters: &[("coefficient", "force over the square of the velocity")],
        next: "Record speeds that differ by a factor of four or more. Over a narrow range of \
               speeds viscous damping fits as well.",
    };

    const KINK_AT_REST: bool = true;

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let drag = scales.force / (scales.velocity * scales.velocity);
        vec![vec![0.05 * drag], vec![0.5 * drag]]
    }

    #[inline]
    fn force<S: Scalar>(p: &[S], at: &At<S>) -> S {
        -(p[0] * at.velocity * at.velocity.abs())
    }

    fn slopes(p: &[f64], at: &At<f64>) -> Slopes {
        Slopes {
            stiffness: 0.0,
            damping: 2.0 * (p[0] * at.velocity).abs(),
        }
    }
}
