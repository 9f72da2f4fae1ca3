//! Forces that are there on one side of a position only (docs/explanation/plant.md, eq. 13).

use super::{
    Description, Effect, Energy, Explanation, Family, ParameterSpec, Port, Quantity, Scales, Sign,
    place, strength,
};
use crate::scalar::Scalar;

const BASE: Description = Description {
    kind: "",
    family: Family::Gap,
    ports: &[],
    energy: Energy::Dissipates,
    law: "",
    equation: "13",
    parameters: &[],
    confusable: &[],
    excited_by: "",
    sentence: "",
};

/// `F = -side max(0, stiffness x + damping x')` where `x = side (q - position) > 0` (eq. 13a).
pub(super) struct EndStop;

impl Effect for EndStop {
    const DESCRIPTION: Description = Description {
        kind: "end_stop",
        ports: &[Port::Body],
        law: "F = -side max(0, stiffness x + damping x') where x = side (q - position) > 0",
        equation: "13a",
        parameters: &[
            place("position", Quantity::Coordinate, Sign::Any),
            strength("stiffness", Quantity::Stiffness, Sign::NonNegative),
            strength("damping", Quantity::Damping, Sign::NonNegative),
            place("side", Quantity::Ratio, Sign::Side),
        ],
        confusable: &["cubic_stiffness", "backlash", "input_saturation"],
        excited_by: "motion to both ends of the range, fast and slow",
        sentence: "{component} meets a stop at {position} (stiffness {stiffness}, damping \
                   {damping}) that the model does not have.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "A mechanical stop, bumper or hard limit of travel that the rig does not have. It \
                pushes and never pulls.",
        parameters: &[
            ("position", "coordinate at which contact begins"),
            ("stiffness", "force over penetration"),
            ("damping", "force over the rate of penetration"),
            (
                "side",
                "1: the stop limits large coordinates; -1: small ones",
            ),
        ],
        next: "Approach both ends slowly and fast. Then keep references away from the stop, or \
               give the rig the stop.",
    };

    /// A stop a tenth or a third of the range inside either end.
    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let (low, high) = scales.range;
        let stiffness = 10.0 * scales.force / scales.position;
        let damping = scales.force / scales.velocity;
        let start = |inside: f64, side: f64| {
            let position = if side > 0.0 {
                high - inside * (high - low)
            } else {
                low + inside * (high - low)
            };
            vec![position, stiffness, damping, side]
        };
        vec![
            start(0.1, 1.0),
            start(0.1, -1.0),
            start(0.3, 1.0),
            start(0.3, -1.0),
        ]
    }
}

/// Force (1 - gap) of a contact that never pulls, before its side: `max(0, k x + c x')` (eq. 13a).
#[inline]
pub(crate) fn press<S: Scalar>(stiffness: S, damping: S, depth: S, rate: S) -> S {
    stiffness * depth + damping * rate
}

/// A dead band of `gap`, half each side of zero force: at a spring or tendon force is transmitted
/// beyond it (eq. 13b), at an actuator the input is played (eq. 14f).
pub(super) struct Backlash;

impl Effect for Backlash {
    const DESCRIPTION: Description = Description {
        kind: "backlash",
        ports: &[Port::Spring, Port::Tendon, Port::Actuator],
        law: "no force within a dead band of gap, centred on zero force",
        equation: "13b",
        parameters: &[strength("gap", Quantity::Gap, Sign::NonNegative)],
        confusable: &[
            "cubic_stiffness",
            "tendon_slack",
            "hysteresis",
            "input_dead_zone",
            "input_delay",
        ],
        excited_by: "slow reversals of the force through zero",
        sentence: "Play of {gap} at {component} is missing from the model.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Play in a gear, coupling, joint or cable. No force is transmitted within the gap. \
                At an actuator its input has the play.",
        parameters: &[(
            "gap",
            "whole width of the play, half of it each side of zero force",
        )],
        next: "Reverse the force slowly through zero. The output rests through the gap; with \
               hysteresis it moves all the time.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        vec![vec![0.1 * scales.position], vec![0.5 * scales.position]]
    }
}

/// The dead band: `x` less half the gap beyond it, nothing within.
///
/// `branch` is the side, -1, 0 or +1, which stays put while a step is taken.
#[inline]
pub(crate) fn dead_band<S: Scalar>(x: S, gap: S, branch: i8) -> S {
    match branch {
        0 => S::ZERO,
        1 => x - gap * 0.5,
        _ => x + gap * 0.5,
    }
}

/// `T = max(0, pretension + stiffness (stretch - slack) + damping stretch')` (eq. 13c).
pub(super) struct TendonSlack;

impl Effect for TendonSlack {
    const DESCRIPTION: Description = Description {
        kind: "tendon_slack",
        ports: &[Port::Tendon],
        law: "T = max(0, T_0 + k (stretch - slack) + c stretch')",
        equation: "13c",
        parameters: &[ParameterSpec {
            zero_means_absent: true,
            ..place("slack", Quantity::Coordinate, Sign::Any)
        }],
        confusable: &["backlash", "quadratic_stiffness"],
        excited_by: "motion that lets the tendon go slack and pulls it taut again",
        sentence: "The tendon {component} cannot push: it goes slack, by {slack}, where the model \
                   pushes.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "A cable, belt or tendon, which can pull and cannot push. The rig's spring pushes \
                where the device is slack.",
        parameters: &[(
            "slack",
            "stretch at which the tension vanishes, beyond the one that the rig gives",
        )],
        next: "Let the tendon go slack and pull it taut again. Raise the pretension if the task \
               must not meet it.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        vec![vec![0.0], vec![0.2 * scales.position]]
    }
}
