//! Effects: physics that a textbook model leaves out, by the names of the vocabulary.
//!
//! One file a family, one type an effect, one trait over all of them. An effect sits at a port (a
//! body or a spring), sees the port's position and velocity, and answers with a force there.
//! Adding one is: write its type in its family's file and name it in the list below.

mod damping;
mod friction;
mod load;
mod stiffness;

use crate::scalar::Scalar;
pub use crate::unit::{Motion, Quantity};

/// Where an effect can sit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// A body: position and velocity are its coordinate and its rate.
    Body,
    /// A spring: position is the extension beyond its rest, the force acts on its `to`.
    Spring,
}

/// What kind of physics it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Depends on the direction of motion, and truly sticks.
    Friction,
    /// Smooth in velocity.
    Damping,
    /// Smooth in the extension of a spring.
    Stiffness,
    /// A force from outside.
    Load,
}

/// What an effect does to the energy of the rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Energy {
    /// Never adds any.
    Dissipates,
    /// Gives back what it took: there is a potential.
    Conserves,
}

/// Which values of a parameter make sense in a rig file. A fit may go elsewhere and be judged after.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// Any finite number.
    Any,
    /// Zero or more.
    NonNegative,
    /// More than zero.
    Positive,
    /// Any finite number but zero.
    NonZero,
}

/// One parameter of an effect, as it is written in a rig and reported by a diagnosis.
#[derive(Clone, Copy, Debug)]
pub struct ParameterSpec {
    /// Its key in the rig file.
    pub name: &'static str,
    /// What it measures; with the port's motion it becomes a unit.
    pub quantity: Quantity,
    /// Which values a rig file may give.
    pub sign: Sign,
    /// The value where the rig gives none; no value: it is required.
    pub default: Option<f64>,
}

const fn parameter(name: &'static str, quantity: Quantity, sign: Sign) -> ParameterSpec {
    ParameterSpec {
        name,
        quantity,
        sign,
        default: None,
    }
}

/// What is known about an effect without simulating it.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// Its name in a rig file.
    pub kind: &'static str,
    /// The kind of physics.
    pub family: Family,
    /// Where it can sit.
    pub ports: &'static [Port],
    /// What it does to the energy of the rig.
    pub energy: Energy,
    /// The law in one line, in the letters of docs/plant.md.
    pub law: &'static str,
    /// Its parameters, in the order of the slots.
    pub parameters: &'static [ParameterSpec],
}

/// What an effect sees of its port.
#[derive(Clone, Copy, Debug)]
pub struct At<S> {
    /// Coordinate of the body, or extension of the spring beyond its rest; m or rad.
    pub position: S,
    /// Its rate; m/s or rad/s.
    pub velocity: S,
    /// +1 or -1: the way a body with friction slides. It stands for sign(v) and stays put while a
    /// step is taken, so that a law is smooth within the step; 0 at a port without friction.
    pub direction: f64,
    /// Length or angle.
    pub motion: Motion,
}

/// Bounds on the magnitude of an effect's slopes near a state, for the choice of sub-steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Slopes {
    /// |dF/dx|, N/m or N m/rad.
    pub stiffness: f64,
    /// |dF/dv|, N s/m or N m s/rad.
    pub damping: f64,
}

/// One effect: a law with parameters `p`, in the order of its description.
trait Effect {
    /// What is known about it without simulating it.
    const DESCRIPTION: Description;

    /// The force at the port: on the body, or on `to` of the spring.
    fn force<S: Scalar>(p: &[S], at: &At<S>) -> S;

    /// Bounds on its slopes near the state.
    fn slopes(p: &[f64], at: &At<f64>) -> Slopes;

    /// How much it holds a resting body against forces in the directions (+, -); zero for
    /// everything but friction.
    fn hold<S: Scalar>(_p: &[S]) -> [S; 2] {
        [S::ZERO; 2]
    }
}

/// Makes the enum that stands for an effect at run time out of the list of types.
macro_rules! effects {
    ($($file:ident::$name:ident),* $(,)?) => {
        /// An effect that this version simulates.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Kind { $(
            #[doc = concat!("See `", stringify!($file), ".rs`.")]
            $name
        ),* }

        impl Kind {
            /// Every effect that this version simulates, in the order of the vocabulary.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// What is known about it without simulating it.
            pub fn description(self) -> &'static Description {
                match self { $(Self::$name => &<$file::$name as Effect>::DESCRIPTION),* }
            }

            /// The force at the port.
            #[inline]
            pub(crate) fn force<S: Scalar>(self, p: &[S], at: &At<S>) -> S {
                match self { $(Self::$name => $file::$name::force(p, at)),* }
            }

            /// Bounds on the slopes near a state.
            pub(crate) fn slopes(self, p: &[f64], at: &At<f64>) -> Slopes {
                match self { $(Self::$name => $file::$name::slopes(p, at)),* }
            }

            /// How much a resting body is held in the directions (+, -).
            #[inline]
            pub(crate) fn hold<S: Scalar>(self, p: &[S]) -> [S; 2] {
                match self { $(Self::$name => $file::$name::hold(p)),* }
            }
        }
    };
}

effects! {
    friction::Coulomb,
    friction::Stribeck,
    friction::DirectionDependent,
    damping::Viscous,
    damping::QuadraticDrag,
    stiffness::Cubic,
    stiffness::Quadratic,
    load::Gravity,
    load::Constant,
    load::PositionRipple,
}

/// Names of the vocabulary that a rig may not use yet, because this version does not simulate them.
pub const NOT_SIMULATED: &[&str] = &[
    "load_dependent_friction",
    "end_stop",
    "backlash",
    "tendon_slack",
    "hysteresis",
    "viscoelastic_creep",
    "hidden_mode",
    "cross_coupling",
    "input_delay",
    "actuator_lag",
    "input_dead_zone",
    "input_saturation",
    "input_curvature",
    "sensor_lag",
    "sensor_curvature",
];

impl Kind {
    /// The effect of that name, if this version simulates it.
    pub fn named(kind: &str) -> Option<Self> {
        Self::ALL
            .iter()
            .copied()
            .find(|candidate| candidate.description().kind == kind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sliding(position: f64, velocity: f64) -> At<f64> {
        At {
            position,
            velocity,
            direction: velocity.signum(),
            motion: Motion::Hinge,
        }
    }

    #[test]
    fn the_vocabulary_is_complete_and_has_no_name_twice() {
        let mut names: Vec<&str> = Kind::ALL.iter().map(|k| k.description().kind).collect();
        names.extend(NOT_SIMULATED);
        assert_eq!(names.len(), 25);
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), 25);
    }

    /// What is declared to dissipate takes power out of every motion; slopes bound what differences
    /// measure.
    #[test]
    fn declared_energy_and_slopes_are_true() {
        for &kind in Kind::ALL {
            let description = kind.description();
            let p: Vec<f64> = (0..description.parameters.len())
                .map(|i| 0.7 + 0.3 * i as f64)
                .collect();
            let mut largest = 0.0f64;
            for i in 0..40 {
                for j in 0..40 {
                    let (x, v) = (0.1 * (f64::from(i) - 19.5), 0.1 * (f64::from(j) - 19.5));
                    let at = sliding(x, v);
                    let force = kind.force(&p, &at);
                    if description.energy == Energy::Dissipates {
                        assert!(force * v <= 0.0, "{} at v = {v}", description.kind);
                    }
                    let step = 1e-6;
                    let beside = |dx: f64, dv: f64| {
                        let at = At {
                            position: x + dx,
                            velocity: v + dv,
                            ..at
                        };
                        kind.force(&p, &at)
                    };
                    let dx = (beside(step, 0.0) - beside(-step, 0.0)) / (2.0 * step);
                    let dv = (beside(0.0, step) - beside(0.0, -step)) / (2.0 * step);
                    let bound = kind.slopes(&p, &at);
                    assert!(dx.abs() <= bound.stiffness + 1e-6, "{}", description.kind);
                    assert!(dv.abs() <= bound.damping + 1e-6, "{}", description.kind);
                    largest = largest.max(force.abs());
                }
            }
            assert!(largest > 0.1, "{} does nothing", description.kind);
        }
    }
}
