//! Springs beyond Hooke's law, and springs that the rig does not have
//! (docs/explanation/plant.md, eq. 11).

use super::{
    At, Description, Effect, Energy, Explanation, Family, Port, Quantity, Scales, Sign, Slopes,
    strength,
};
use crate::scalar::Scalar;

const BASE: Description = Description {
    kind: "",
    family: Family::Stiffness,
    ports: &[Port::Spring],
    energy: Energy::Conserves,
    law: "",
    equation: "11",
    parameters: &[],
    confusable: &[],
    excited_by: "",
    sentence: "",
};

/// `F = -coefficient x^3`; a negative coefficient softens (eq. 11a).
pub(super) struct Cubic;

impl Effect for Cubic {
    const DESCRIPTION: Description = Description {
        kind: "cubic_stiffness",
        law: "F = -coefficient x^3",
        equation: "11a",
        parameters: &[strength("coefficient", Quantity::CubicStiffness, Sign::Any)],
        confusable: &[
            "quadratic_stiffness",
            "end_stop",
            "backlash",
            "sensor_curvature",
        ],
        excited_by: "small and large extensions of the spring, both ways",
        sentence: "The spring {component} is not linear: a cubic part of {coefficient} is missing \
                   from the model.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "A spring that hardens (positive) or softens (negative) alike in both directions: \
                large bending, a soft stop, a magnetic spring.",
        parameters: &[(
            "coefficient",
            "force over the cube of the extension; negative for a spring that softens",
        )],
        next: "Load the spring statically at several extensions both ways. A sensor that is not \
               linear bends every signal of its kind, a spring only the force.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let coefficient = scales.force / (scales.position * scales.position * scales.position);
        vec![vec![0.3 * coefficient], vec![-0.1 * coefficient]]
    }

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
        law: "F = -coefficient x^2",
        equation: "11b",
        parameters: &[strength(
            "coefficient",
            Quantity::QuadraticStiffness,
            Sign::Any,
        )],
        confusable: &["cubic_stiffness", "sensor_curvature", "input_curvature"],
        excited_by: "large extensions of the spring, both ways",
        sentence: "The spring {component} is stiffer one way than the other: a quadratic part of \
                   {coefficient} is missing from the model.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "A spring that is stiffer one way than the other: a cone spring, a membrane, a \
                buckled beam, a leg that is preloaded.",
        parameters: &[(
            "coefficient",
            "force over the square of the extension; its sign is that of the stiffer direction",
        )],
        next: "Record large extensions of equal size both ways. Motion to one side alone does not \
               separate it from cubic stiffness.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let coefficient = scales.force / (scales.position * scales.position);
        vec![vec![0.2 * coefficient], vec![-0.2 * coefficient]]
    }

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

/// A spring between two bodies that the rig does not join: force on b of `a+b` is
/// `-stiffness (q_b - q_a)` (eq. 11c). The plant makes it a spring of its own.
pub(super) struct CrossCoupling;

impl Effect for CrossCoupling {
    const DESCRIPTION: Description = Description {
        kind: "cross_coupling",
        ports: &[Port::Pair],
        law: "F = -stiffness (q_b - q_a)",
        equation: "11c",
        parameters: &[strength(
            "stiffness",
            Quantity::Stiffness,
            Sign::NonNegative,
        )],
        confusable: &["hidden_mode"],
        excited_by: "motion of one body while the other is at another place",
        sentence: "The bodies {component} are joined by a stiffness of {stiffness} that the model \
                   does not have.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "An elastic connection of two bodies that the rig does not join: a frame that \
                bends, a cable, shared foam.",
        parameters: &[(
            "stiffness",
            "force over the difference of the two coordinates",
        )],
        next: "Excite one body while the other is held. Motion of the held one's sensor or force \
               confirms the connection; then add a spring to the rig.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let stiffness = scales.force / scales.position;
        vec![vec![0.05 * stiffness], vec![0.5 * stiffness]]
    }
}
