//! Dry friction: it opposes sliding and holds what rests (docs/explanation/plant.md, eq. 6 to 9c).
//!
//! Each law but presliding friction is written for a body that slides one way, with `direction`
//! standing for sign(v). The integrator switches the direction at the instant of reversal and holds
//! a resting body exactly while the other forces stay within [`Effect::hold`]. Nothing is smoothed.

use super::{
    At, Description, Effect, Energy, Explanation, Family, ParameterSpec, Port, Quantity, Scales,
    SearchRange, Sign, Slopes, parameter, strength,
};
use crate::scalar::Scalar;

const BASE: Description = Description {
    kind: "",
    family: Family::Friction,
    ports: &[Port::Body],
    energy: Energy::Dissipates,
    law: "",
    equation: "6",
    parameters: &[],
    confusable: &[],
    excited_by: "",
    sentence: "",
};

/// `F = -level sign(v)`, holding up to `level` (eq. 6).
pub(super) struct Coulomb;

impl Effect for Coulomb {
    const FOLLOWS_SIGNALS: bool = true;

    const DESCRIPTION: Description = Description {
        kind: "coulomb_friction",
        law: "F = -level sign(v)",
        parameters: &[strength("level", Quantity::Force, Sign::NonNegative)],
        confusable: &[
            "stribeck_friction",
            "direction_dependent_friction",
            "load_dependent_friction",
            "presliding_friction",
            "hysteresis",
            "viscous_damping",
        ],
        excited_by: "reversals and rests at forces just above and below the level",
        sentence: "Dry friction of {level} at {component} is missing from the model.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Dry contact in a bearing, guide, seal or gear. The body sticks until the other \
                forces exceed the level, and then slides against a constant force.",
        parameters: &[(
            "level",
            "force of friction while the body slides, and largest force that holds it at rest",
        )],
        next: "Record slow and fast motion. A force that grows with speed is viscous damping, one \
               that falls after break-away is Stribeck friction, one that grows with load is \
               load-dependent friction.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        vec![vec![0.1 * scales.force], vec![0.5 * scales.force]]
    }

    #[inline]
    fn force<S: Scalar>(p: &[S], at: &At<S>) -> S {
        p[0] * -at.direction
    }

    fn hold<S: Scalar>(p: &[S]) -> [S; 2] {
        [p[0]; 2]
    }
}

/// `F = -(level + (static_level - level) exp(-(v/velocity)^2)) sign(v)`, holding up to
/// `static_level` (eq. 7).
pub(super) struct Stribeck;

impl Effect for Stribeck {
    const DESCRIPTION: Description = Description {
        kind: "stribeck_friction",
        law: "F = -(level + (static_level - level) exp(-(v/velocity)^2)) sign(v)",
        equation: "7",
        parameters: &[
            strength("level", Quantity::Force, Sign::NonNegative),
            strength("static_level", Quantity::Force, Sign::NonNegative),
            ParameterSpec {
                // Below it is dry friction with a static level that no sample shows, and as steep
                // as the fit likes.
                range: SearchRange::AtLeast(0.25),
                ..parameter("velocity", Quantity::Velocity, Sign::Positive)
            },
        ],
        confusable: &["coulomb_friction", "direction_dependent_friction"],
        excited_by: "slow motion with rests, and motion well above the Stribeck velocity",
        sentence: "Friction at {component} falls from {static_level} at rest to {level} above \
                   {velocity}; the model has none.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Lubricated contact: the static level holds the body, and friction falls as a film \
                of lubricant carries it. The fall causes stick-slip at low speed.",
        parameters: &[
            (
                "level",
                "force of friction well above the Stribeck velocity",
            ),
            ("static_level", "largest force that holds the body at rest"),
            (
                "velocity",
                "Stribeck velocity: speed at which the excess of the static level has fallen to \
                 1/e",
            ),
        ],
        next: "Move at constant speeds from the slowest possible one upward, both ways. Without \
               slow motion the static level and the velocity stay undetermined, and dry friction \
               fits as well.",
    };

    /// Friction that is larger in motion than at rest is some damping under another name.
    fn plausible(p: &[f64], _duration: f64) -> bool {
        p[1] >= p[0]
    }

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let (force, velocity) = (scales.force, scales.velocity);
        vec![
            vec![0.1 * force, 0.2 * force, 0.1 * velocity],
            vec![0.4 * force, 0.6 * force, 0.3 * velocity],
            vec![0.2 * force, 0.4 * force, 0.03 * velocity],
        ]
    }

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
    const DESCRIPTION: Description = Description {
        kind: "direction_dependent_friction",
        law: "F = -level_pos - damping_pos v forward, level_neg - damping_neg v backward",
        equation: "8",
        parameters: &[
            strength("level_pos", Quantity::Force, Sign::NonNegative),
            strength("level_neg", Quantity::Force, Sign::NonNegative),
            strength("damping_pos", Quantity::Damping, Sign::NonNegative),
            strength("damping_neg", Quantity::Damping, Sign::NonNegative),
        ],
        confusable: &[
            "coulomb_friction",
            "constant_load",
            "stribeck_friction",
            "viscous_damping",
        ],
        excited_by: "both directions at several speeds, and rests",
        sentence: "Friction at {component} differs with direction: {level_pos} and {damping_pos} \
                   forward, {level_neg} and {damping_neg} backward; the model has none.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Friction of a seal, ratchet, preloaded nut or gear whose two directions differ in \
                level or in growth with speed.",
        parameters: &[
            ("level_pos", "dry friction in forward motion"),
            ("level_neg", "dry friction in backward motion"),
            ("damping_pos", "viscous part in forward motion"),
            ("damping_neg", "viscous part in backward motion"),
        ],
        next: "Rest the body at several positions. A constant load moves the middle of the two \
               levels, so the rests tell it from friction that differs with direction.",
    };

    /// The smaller of its dampings is a damper's: the motion stays the same to the bit but for
    /// rounding.
    fn canonical(p: &mut [f64], damper: &mut f64) {
        let common = p[2].min(p[3]);
        if *damper + common >= 0.0 {
            *damper += common;
            p[2] -= common;
            p[3] -= common;
        }
    }

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        let (force, damping) = (scales.force, scales.force / scales.velocity);
        vec![
            vec![0.15 * force, 0.1 * force, 0.1 * damping, 0.05 * damping],
            vec![0.1 * force, 0.3 * force, 0.05 * damping, 0.1 * damping],
        ]
    }

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

/// `F = -coefficient |load| sign(v)`, holding up to `coefficient |load|` (eq. 9).
pub(super) struct LoadDependent;

impl Effect for LoadDependent {
    const DESCRIPTION: Description = Description {
        kind: "load_dependent_friction",
        ports: &[Port::Body, Port::Tendon],
        law: "F = -coefficient |load| sign(v)",
        equation: "9",
        parameters: &[strength("coefficient", Quantity::Ratio, Sign::NonNegative)],
        confusable: &["coulomb_friction", "viscous_damping", "hysteresis"],
        excited_by: "reversals at several loads, from none to the largest",
        sentence: "Friction at {component} that grows with its load, {coefficient} times the load, \
                   is missing from the model.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Friction of a tendon over its guides (capstan friction), or of a bearing or gear \
                under load. It vanishes without load.",
        parameters: &[(
            "coefficient",
            "force of friction over the load; the load is the tension of a tendon, or the \
                 actuator force at a body; over a wrap angle it is tanh(friction times angle)",
        )],
        next: "Repeat one slow reversal at three loads. Dry friction keeps its level, \
               load-dependent friction grows in proportion.",
    };

    fn starts(_scales: &Scales) -> Vec<Vec<f64>> {
        vec![vec![0.05], vec![0.25]]
    }
}

/// Dahl: `F = -level w, w' = (v - |v| w) / distance`, `w(0) = 0` (eq. 9b). It has a state, and
/// holds nothing at rest: it is no force of its own here.
pub(super) struct Presliding;

impl Effect for Presliding {
    const REFINES: bool = true;

    const DESCRIPTION: Description = Description {
        kind: "presliding_friction",
        law: "F = -level w, w' = (v - |v| w) / distance",
        equation: "9b",
        parameters: &[
            strength("level", Quantity::Force, Sign::NonNegative),
            ParameterSpec {
                // Shorter, it is dry friction by now and costs thousands of sub-steps a row.
                range: SearchRange::AtLeast(0.125),
                ..parameter("distance", Quantity::Coordinate, Sign::Positive)
            },
        ],
        confusable: &["coulomb_friction", "stribeck_friction", "hysteresis"],
        excited_by: "reversals of several sizes, the smallest shorter than the distance",
        sentence: "Friction at {component} that builds up to {level} over {distance} after each \
                   reversal is missing from the model.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Contact of a bearing, ball screw, gear or seal that yields before it slips \
                (Dahl). After a reversal the force builds up over a distance, as a spring would.",
        parameters: &[
            ("level", "force of friction in steady sliding"),
            (
                "distance",
                "way after which the force has come within 1/e of the level; the stiffness before \
                 slip is level over distance",
            ),
        ],
        next: "Record reversals of several sizes, some shorter than the distance. Dry friction has \
               its whole level at once. Hysteresis of a spring follows the spring's extension.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        [0.3, 0.08]
            .map(|part| vec![0.3 * scales.force, part * scales.position])
            .to_vec()
    }
}

/// Rate of w (eq. 9b); `direction` stands for sign(v).
#[inline]
pub(crate) fn presliding_rate<S: Scalar>(p: &[S], w: S, v: S, direction: f64) -> S {
    v * (S::constant(1.0) - w * direction) / p[1]
}

/// `F = -level exp(-theta) sign(v)`, holding up to `level exp(-theta)`, with
/// `theta' = (|v| / velocity - theta) / time_constant`, `theta(0) = 0` (eq. 9c).
pub(super) struct WarmUp;

impl Effect for WarmUp {
    const DESCRIPTION: Description = Description {
        kind: "warm_up_friction",
        law: "F = -level exp(-theta) sign(v), theta' = (|v|/velocity - theta) / time_constant",
        equation: "9c",
        parameters: &[
            strength("level", Quantity::Force, Sign::NonNegative),
            parameter("velocity", Quantity::Velocity, Sign::Positive),
            ParameterSpec {
                // Sooner, it is a friction that falls with the speed.
                range: SearchRange::AtLeast(0.1),
                ..parameter("time_constant", Quantity::Time, Sign::Positive)
            },
        ],
        confusable: &["coulomb_friction", "stribeck_friction"],
        excited_by: "long motion from a cold start, without rests and then with rests",
        sentence: "Friction at {component} of {level} when cold, which falls as it warms within \
                   {time_constant}, is missing from the model.",
        ..BASE
    };

    const EXPLANATION: Explanation = Explanation {
        cause: "Grease or seals that warm as they slide: the level falls as the viscosity does, \
                exponentially with the temperature. Every recording begins cold.",
        parameters: &[
            ("level", "dry friction when cold"),
            (
                "velocity",
                "mean sliding speed at which the warm friction is 1/e of the cold one",
            ),
            (
                "time_constant",
                "time in which the temperature comes within 1/e of its end",
            ),
        ],
        next: "Record several minutes of the same motion from a cold start. Where a temperature is \
               measured, give its column to the rig: friction may follow it.",
    };

    fn starts(scales: &Scales) -> Vec<Vec<f64>> {
        [20.0, 100.0]
            .map(|times| {
                vec![
                    0.4 * scales.force,
                    2.0 * scales.velocity,
                    times * scales.time,
                ]
            })
            .to_vec()
    }
}

/// Rate of theta (eq. 9c); `direction` stands for sign(v).
#[inline]
pub(crate) fn warming_rate<S: Scalar>(p: &[S], theta: S, v: S, direction: f64) -> S {
    (v * direction / p[1] - theta) / p[2]
}
