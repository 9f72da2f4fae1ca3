//! Forces from outside (docs/explanation/plant.md, eq. 12).

use super::{
    At, Description, Effect, Energy, Explanation, Family, Motion, ParameterSpec, Port, Quantity,
    Scales, SearchRange, Sign, Slopes, parameter, place, strength,
};
use crate::scalar::Scalar;

const BASE: Description = Description {
    kind: "",
    family: Family::Load,
    ports: &[Port::Body],
    energy: Energy::Conserves,
    law: "",
    equation: "12",
    parameters: &[],
    confusable: &[],
    excited_by: "",
    sentence: "",
};

/// Slide: `F = -amplitude`; hinge: `F = -amplitude sin(q - zero)` (eq. 12a).
pub(super) struct Gravity;

impl Effect for Gravity {
    const DESCRIPTION: Description = Description {
        kind: "gravity_load",
        law: "F = -amplitude on a slide, -amplitude sin(q - zero) on a hinge",
        equation: "12a",
        parameters: &[
            strength("amplitude", Quantity::Force, Sign::Any),
            ParameterSpec {
                default: Some(0.0),
                ..place("zero", Quantity::Coordinate, Sign::Any)
            },
        ],
        confusable: &["constant_load", "position_ripple", "cubic_stiffness"],
        excited_by: "a wide range of angles, on a slide any motion",
        sentence: "A weight of {amplitude} at {component}, hanging at {zero}, is missing from the \
                   model.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Weight of a link, tool or payload that the rig does not have, or a device that is \
                not level.",
        parameters: &[
            (
                "amplitude",
                "weight on a slide; weight times lever arm on a hinge",
            ),
            (
                "zero",
                "angle at which the weight hangs straight down; no meaning on a slide",
            ),
        ],
        next: "Move through a wide range of angles slowly. A narrow range shows a constant load. \
               Then add a gravity component to the rig.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let force = 0.3 * scales.force;
        let turn = std::f64::consts::FRAC_PI_2;
        vec![vec![force, 0.0], vec![force, turn], vec![force, -turn]]
    }

    #[inline]
    fn force<S: Scalar>(p: &[S], at: &At<S>) -> S {
        match at.motion {
            Motion::Slide => -p[0],
            Motion::Hinge => -(p[0] * (at.position - p[1]).sin()),
        }
    }

    fn straight(motion: Motion) -> bool {
        motion == Motion::Slide
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
    const DESCRIPTION: Description = Description {
        kind: "constant_load",
        law: "F = level",
        equation: "12b",
        parameters: &[strength("level", Quantity::Force, Sign::Any)],
        confusable: &["gravity_load", "direction_dependent_friction"],
        excited_by: "any motion; rests show it best",
        sentence: "A constant load of {level} at {component} is missing from the model.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "A constant force: a preload, a counterweight, a tilted table, an offset of the \
                driver.",
        parameters: &[("level", "the force, in the direction of the coordinate")],
        next: "Look for an offset of the input or a rest of the spring first: a fit cannot tell \
               them from a load. Record rests at several positions.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        vec![vec![0.2 * scales.force], vec![-0.2 * scales.force]]
    }

    fn straight(_motion: Motion) -> bool {
        true
    }

    #[inline]
    fn force<S: Scalar>(p: &[S], _at: &At<S>) -> S {
        p[0]
    }
}

/// `F = amplitude sin(wave_number q + phase)`: cogging, eccentricity (eq. 12c).
pub(super) struct PositionRipple;

impl Effect for PositionRipple {
    const DESCRIPTION: Description = Description {
        kind: "position_ripple",
        law: "F = amplitude sin(wave_number q + phase)",
        equation: "12c",
        parameters: &[
            strength("amplitude", Quantity::Force, Sign::Any),
            ParameterSpec {
                // The longest start is a wave over all of the motion; of a longer one nobody has
                // seen that it is one.
                range: SearchRange::AtLeast(0.7),
                ..parameter("wave_number", Quantity::WaveNumber, Sign::Any)
            },
            place("phase", Quantity::Phase, Sign::Any),
        ],
        confusable: &["gravity_load", "cubic_stiffness"],
        excited_by: "slow motion over several periods of the ripple",
        sentence: "A ripple of {amplitude} over the position of {component}, wave number \
                   {wave_number}, is missing from the model.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Force that repeats over the position: cogging of a motor, an eccentric wheel, \
                teeth of a belt.",
        parameters: &[
            ("amplitude", "largest force of the ripple"),
            (
                "wave_number",
                "radians of the ripple per unit of the coordinate",
            ),
            ("phase", "angle of the ripple at coordinate zero"),
        ],
        next: "Move slowly and evenly over three periods or more. Compare the wave number with \
               pole pairs or teeth.",
    };

    /// A free run over a ripple ends in one of its wells or in another.
    const MANY_RESTS: bool = true;

    /// Wave numbers from one period in the range to twelve, at two phases a quarter apart.
    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let span = (scales.range.1 - scales.range.0).max(scales.position);
        let turn = std::f64::consts::TAU / span;
        let periods = [1.0, 1.5, 2.2, 3.2, 4.6, 6.6, 9.0, 12.0];
        let start = |periods: f64, phase| vec![0.2 * scales.force, periods * turn, phase];
        periods
            .iter()
            .flat_map(|&p| [start(p, 0.0), start(p, std::f64::consts::FRAC_PI_2)])
            .collect()
    }

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
