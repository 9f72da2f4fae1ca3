//! Forces that depend on what went before (docs/explanation/plant.md, eq. 15).

use super::{
    Description, Effect, Energy, Explanation, Family, ParameterSpec, Port, Quantity, Scales,
    SearchRange, Sign, parameter, strength,
};
use crate::scalar::Scalar;

const BASE: Description = Description {
    kind: "",
    family: Family::Memory,
    ports: &[Port::Spring],
    energy: Energy::Dissipates,
    law: "",
    equation: "15",
    parameters: &[],
    confusable: &[],
    excited_by: "",
    sentence: "",
};

/// A rate of a loop. Eight times as sharp as its start, a loop is dry friction by now and costs
/// thousands of sub-steps a row.
const fn loop_rate(name: &'static str, sign: Sign) -> ParameterSpec {
    ParameterSpec {
        range: SearchRange::WithinLargest(8.0, &["beta", "gamma"]),
        ..parameter(name, Quantity::Memory, sign)
    }
}

/// Bouc-Wen: `F = -alpha z, z' = v - beta |v| |z|^(n-1) z - gamma v |z|^n`, `z(0) = 0` (eq. 15a).
pub(super) struct Hysteresis;

impl Effect for Hysteresis {
    const DESCRIPTION: Description = Description {
        kind: "hysteresis",
        law: "F = -alpha z, z' = v - beta |v| |z|^(exponent - 1) z - gamma v |z|^exponent",
        equation: "15a",
        parameters: &[
            strength("alpha", Quantity::Stiffness, Sign::NonNegative),
            loop_rate("beta", Sign::NonNegative),
            loop_rate("gamma", Sign::Any),
            ParameterSpec {
                range: SearchRange::Fixed([0.7, 5.0]),
                ..parameter("exponent", Quantity::Ratio, Sign::Positive)
            },
        ],
        confusable: &[
            "coulomb_friction",
            "viscoelastic_creep",
            "backlash",
            "plastic_set",
        ],
        excited_by: "loops of several amplitudes, slow and fast",
        sentence: "The spring {component} has hysteresis (Bouc-Wen, {alpha}, beta {beta}, gamma \
                   {gamma}, exponent {exponent}) that the model does not have.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Internal friction of a spring, rubber, braided cable or piezo stack (Bouc-Wen). \
                The force depends on the path, not on the rate.",
        parameters: &[
            ("alpha", "stiffness of the hysteretic part at a reversal"),
            ("beta", "rate of saturation while the spring is loaded"),
            (
                "gamma",
                "rate of saturation that differs between loading and unloading",
            ),
            ("exponent", "sharpness of the transition to saturation"),
        ],
        next: "Record loops of three amplitudes, each slow and fast. Loops that change with speed \
               are creep or damping; parallel steps at reversals are dry friction.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let alpha = 0.5 * scales.force / scales.position;
        let start = |reach: f64, share: f64| {
            let rate = 1.0 / (reach * scales.position);
            vec![alpha, share * rate, (1.0 - share) * rate, 1.0]
        };
        vec![start(0.3, 0.5), start(0.1, 0.5), start(1.0, 0.7)]
    }
}

/// `|z|^n` and `|z|^(n-1) z` on the side `sign` of zero, continued as an odd function a little way
/// beyond.
#[inline]
fn powers<S: Scalar>(z: S, exponent: S, sign: f64) -> (S, S) {
    let size = z * sign;
    let magnitude = size.abs();
    let power = if exponent.value() == 1.0 {
        // d/dn |z|^n = |z|^n ln |z| is carried even where n is 1.
        let slope = exponent - 1.0;
        if magnitude.value() > 0.0 {
            magnitude * (slope * magnitude.ln()).exp()
        } else {
            magnitude
        }
    } else if magnitude.value() > 0.0 {
        (exponent * magnitude.ln()).exp()
    } else {
        S::ZERO
    };
    let power = if size.value() < 0.0 { -power } else { power };
    (power, power * sign)
}

/// Rate of z (eq. 15a); `direction` stands for sign(v) and `side` for sign(z).
#[inline]
pub(crate) fn hysteresis_rate<S: Scalar>(p: &[S], z: S, v: S, direction: f64, side: f64) -> S {
    let (even, odd) = powers(z, p[3], side);
    v - p[1] * v * direction * odd - p[2] * v * even
}

/// A Maxwell branch in parallel: `F = -f, f' = stiffness v - f/time_constant` (eq. 15b).
pub(super) struct Creep;

impl Effect for Creep {
    const DESCRIPTION: Description = Description {
        kind: "viscoelastic_creep",
        law: "F = -f, f' = stiffness v - f/time_constant",
        equation: "15b",
        parameters: &[
            strength("stiffness", Quantity::Stiffness, Sign::NonNegative),
            parameter("time_constant", Quantity::Time, Sign::Positive),
        ],
        confusable: &["viscous_damping", "hysteresis", "hidden_mode"],
        excited_by: "steps that are held for several time constants",
        sentence: "The spring {component} creeps: a branch of {stiffness} that relaxes in \
                   {time_constant} is missing from the model.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "A polymer, foam, gel or tendon that relaxes: after a step the force decays by the \
                share of a Maxwell branch.",
        parameters: &[
            (
                "stiffness",
                "stiffness of the branch, which adds to the spring's in fast motion",
            ),
            (
                "time_constant",
                "time in which the force of the branch falls to 1/e",
            ),
        ],
        next: "Hold steps for five time constants. Motion that is all slow or all fast shows a \
               spring alone, or a damper alone.",
    };

    /// A lag that does not end is a slow drift under another name.
    fn plausible(p: &[f64], duration: f64) -> bool {
        p[1] < duration
    }

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let stiffness = 0.3 * scales.force / scales.position;
        [0.3, 3.0]
            .map(|times| vec![stiffness, times * scales.time])
            .to_vec()
    }
}

/// Rate of the force of the branch (eq. 15b).
#[inline]
pub(crate) fn creep_rate<S: Scalar>(p: &[S], force: S, v: S) -> S {
    p[0] * v - force / p[1]
}

/// A branch in parallel that yields: `F = -stiffness z`, `z' = v` within `|z| < yield_extension`
/// and 0 while it yields, `z(0) = 0` (eq. 15c).
pub(super) struct PlasticSet;

impl Effect for PlasticSet {
    const REFINES: bool = true;

    const DESCRIPTION: Description = Description {
        kind: "plastic_set",
        law: "F = -stiffness z, z' = v, 0 while |z| = yield_extension and rising",
        equation: "15c",
        parameters: &[
            strength("stiffness", Quantity::Stiffness, Sign::NonNegative),
            ParameterSpec {
                range: SearchRange::AtLeast(0.02),
                ..parameter("yield_extension", Quantity::Coordinate, Sign::Positive)
            },
        ],
        confusable: &["hysteresis", "coulomb_friction", "presliding_friction"],
        excited_by: "slow loads and unloads, the largest well beyond the yield",
        sentence: "The spring {component} takes a set: a branch of {stiffness} that yields at \
                   {yield_extension} is missing from the model.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "A polymer, wire or clamped end that yields (a Jenkin element). Beyond some \
                extension it stays longer than it was, and comes back along the first slope.",
        parameters: &[
            (
                "stiffness",
                "stiffness of the branch before it yields, which adds to the spring's",
            ),
            (
                "yield_extension",
                "extension of the branch at which it yields; stiffness times it is its largest \
                 force",
            ),
        ],
        next: "Load and unload slowly with rising peaks. A set has straight slopes with corners; \
               hysteresis (Bouc-Wen) rounds them, and creep gives the set back with time.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let stiffness = 0.5 * scales.force / scales.position;
        [0.5, 0.15]
            .map(|part| vec![stiffness, part * scales.position])
            .to_vec()
    }
}
