//! Effects: physics that a textbook model leaves out, by the names of the vocabulary.
//!
//! One file a family, one type an effect, one trait over all of them. An effect sits at a port (a
//! body or a spring), sees the port's position and velocity, and answers with a force there. Adding
//! one is: write its type in its family's file and name it in the list below. What a search has to
//! know of it stands with it: roles and ranges of its parameters, what is plausible, how it is
//! written where parameters trade against the rig's own. A program adds an effect of its own with
//! [`Kind::register`].

mod actuator;
mod added;
mod damping;
mod description;
mod friction;
mod gap;
mod learned;
mod load;
mod memory;
mod mode;
mod sensor;
mod sentence;
mod stiffness;

use crate::scalar::Scalar;
pub use crate::unit::{Motion, Quantity};
pub use added::{Added, AddedEffect, Jet, RegisterError};
pub use description::{
    Description, Energy, Explanation, Family, ParameterSpec, Port, Role, Scales, SearchRange, Sign,
};
use description::{parameter, place, strength};
pub(crate) use friction::{presliding_rate, warming_rate};
pub(crate) use gap::{dead_band, press};
pub use learned::learned_force;
pub(crate) use memory::{creep_rate, hysteresis_rate};
pub(crate) use sensor::curve;

/// Motion of an effect's port.
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

/// One effect: what is known about it, and its law with parameters `p` in the order of its
/// description where it is a force at a body or in a spring. Effects of other form (another body, a
/// state, a stage of an input) are put together by the plant from the functions beside them.
trait Effect {
    /// Knowledge about it without simulating it.
    const DESCRIPTION: Description;

    /// Words about it for a person.
    const EXPLANATION: Explanation;

    /// Start values of a fit, made of typical sizes at the port, most likely first.
    fn starts(scales: &Scales) -> Vec<Vec<f64>>;

    /// Several rests: a free run ends in one or in another.
    const MANY_RESTS: bool = false;

    /// It is a finer description of what other laws describe: a search tries it in the place of a
    /// law that is easily taken for it, and nowhere else.
    const REFINES: bool = false;

    /// The slope of its force jumps where the velocity of its body passes zero.
    const KINK_AT_REST: bool = false;

    /// Its strengths may depend on a recorded column in real devices: a voltage, a pressure, a
    /// temperature.
    const FOLLOWS_SIGNALS: bool = false;

    /// True if fitted parameters describe what shows within a recording of `duration` seconds.
    /// Signs are judged by the description.
    fn plausible(_p: &[f64], _duration: f64) -> bool {
        true
    }

    /// Of parameters that describe the same motion, those that a report names; `damper` is the
    /// coefficient of the rig's own viscous damper between the same body and the ground, which may
    /// take over a part.
    fn canonical(_p: &mut [f64], _damper: &mut f64) {}

    /// The force at the port: on the body, or on `to` of the spring.
    fn force<S: Scalar>(_p: &[S], _at: &At<S>) -> S {
        S::ZERO
    }

    /// Bounds on its slopes near the state.
    fn slopes(_p: &[f64], _at: &At<f64>) -> Slopes {
        Slopes::default()
    }

    /// Its force is affine in position and velocity.
    fn straight(_motion: Motion) -> bool {
        false
    }

    /// Force that holds a resting body against forces in the directions (+, -); zero for
    /// everything but friction.
    fn hold<S: Scalar>(_p: &[S]) -> [S; 2] {
        [S::ZERO; 2]
    }
}

/// Makes the enum that stands for an effect at run time out of the list of types.
macro_rules! effects {
    (
        vocabulary { $($known:ident = $home:ident::$its:ident),* $(,)? }
        beside { $($other:ident = $place:ident::$own:ident),* $(,)? }
    ) => {
        effects! {
            [$($known),*] [$($other),*]
            $($known = $home::$its,)* $($other = $place::$own,)*
        }
    };
    (
        [$($known:ident),*] [$($other:ident),*]
        $($name:ident = $file:ident::$law:ident,)*
    ) => {
        /// An effect: one of the vocabulary, [`Kind::Learned`], or one that a program has
        /// registered.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Kind { $(
            #[doc = concat!("See `", stringify!($file), ".rs`.")]
            $name,
        )*
            /// An effect that a program has registered.
            Added(Added),
        }

        impl Kind {
            /// The vocabulary, in its order.
            pub const ALL: &[Self] = &[$(Self::$known),*];
            /// Effects that a rig may hold besides, and no diagnosis names.
            const BESIDE: &[Self] = &[$(Self::$other),*];

            /// Knowledge about it without simulating it.
            pub fn description(self) -> &'static Description {
                match self {
                    $(Self::$name => &<$file::$law as Effect>::DESCRIPTION,)*
                    Self::Added(added) => added.law().description(),
                }
            }

            /// Words about it for a person.
            pub fn explanation(self) -> &'static Explanation {
                match self {
                    $(Self::$name => &<$file::$law as Effect>::EXPLANATION,)*
                    Self::Added(added) => added.law().explanation(),
                }
            }

            /// Start values of a fit, most likely first; each in the order of the parameters.
            pub fn starts(self, scales: &Scales) -> Vec<Vec<f64>> {
                match self {
                    $(Self::$name => $file::$law::starts(scales),)*
                    Self::Added(added) => added.law().starts(scales),
                }
            }

            /// True if fitted parameters, in the order of the description, describe what shows
            /// within a recording of `duration` seconds. Signs are judged by the description.
            pub fn plausible(self, p: &[f64], duration: f64) -> bool {
                match self {
                    $(Self::$name => $file::$law::plausible(p, duration),)*
                    Self::Added(added) => added.law().plausible(p, duration),
                }
            }

            /// Replaces parameters by those of the same motion that a report names; `damper` is the
            /// coefficient of the rig's own viscous damper between the same body and the ground,
            /// which may take over a part.
            pub fn canonical(self, p: &mut [f64], damper: &mut f64) {
                match self {
                    $(Self::$name => $file::$law::canonical(p, damper),)*
                    Self::Added(_) => {}
                }
            }

            /// True if a device with it has several rests, so that a free run ends in one or in
            /// another.
            pub fn has_many_rests(self) -> bool {
                match self {
                    $(Self::$name => <$file::$law as Effect>::MANY_RESTS,)*
                    Self::Added(added) => added.law().has_many_rests(),
                }
            }

            /// True if a search tries it in the place of a law that is easily taken for it, and
            /// nowhere else.
            pub fn is_refinement(self) -> bool {
                match self {
                    $(Self::$name => <$file::$law as Effect>::REFINES,)*
                    Self::Added(_) => false,
                }
            }

            /// True if a search tries its strengths as functions of a recorded column.
            pub fn follows_signals(self) -> bool {
                match self {
                    $(Self::$name => <$file::$law as Effect>::FOLLOWS_SIGNALS,)*
                    Self::Added(_) => false,
                }
            }

            /// True if the slope of its force jumps where the velocity of its body passes zero.
            pub(crate) fn has_kink_at_rest(self) -> bool {
                match self {
                    $(Self::$name => <$file::$law as Effect>::KINK_AT_REST,)*
                    Self::Added(added) => added.law().has_kink_at_rest(),
                }
            }

            /// The force at the port.
            #[inline]
            pub(crate) fn force<S: Scalar>(self, p: &[S], at: &At<S>) -> S {
                match self {
                    $(Self::$name => $file::$law::force(p, at),)*
                    Self::Added(added) => added.force(p, at),
                }
            }

            /// Bounds on the slopes near a state.
            pub(crate) fn slopes(self, p: &[f64], at: &At<f64>) -> Slopes {
                match self {
                    $(Self::$name => $file::$law::slopes(p, at),)*
                    Self::Added(added) => added.law().slopes(p, at),
                }
            }

            /// True if the force at the port is affine in position and velocity.
            pub(crate) fn straight(self, motion: Motion) -> bool {
                match self {
                    $(Self::$name => $file::$law::straight(motion),)*
                    Self::Added(_) => false,
                }
            }

            /// Force that holds a resting body in the directions (+, -).
            #[inline]
            pub(crate) fn hold<S: Scalar>(self, p: &[S]) -> [S; 2] {
                match self {
                    $(Self::$name => $file::$law::hold(p),)*
                    Self::Added(added) => added.hold(p),
                }
            }
        }
    };
}

effects! {
    vocabulary {
    Coulomb = friction::Coulomb,
    Stribeck = friction::Stribeck,
    DirectionDependent = friction::DirectionDependent,
    LoadDependent = friction::LoadDependent,
    Presliding = friction::Presliding,
    Viscous = damping::Viscous,
    QuadraticDrag = damping::QuadraticDrag,
    Cubic = stiffness::Cubic,
    Quadratic = stiffness::Quadratic,
    EndStop = gap::EndStop,
    Backlash = gap::Backlash,
    TendonSlack = gap::TendonSlack,
    Hysteresis = memory::Hysteresis,
    Creep = memory::Creep,
    PlasticSet = memory::PlasticSet,
    Gravity = load::Gravity,
    Constant = load::Constant,
    PositionRipple = load::PositionRipple,
    HiddenMode = mode::HiddenMode,
    CrossCoupling = stiffness::CrossCoupling,
    InputDelay = actuator::Delay,
    ActuatorLag = actuator::Lag,
    InputDeadZone = actuator::DeadZone,
    InputSaturation = actuator::Saturation,
    InputCurvature = actuator::Curvature,
    SensorLag = sensor::Lag,
    SensorCurvature = sensor::Curvature,
    }
    beside { Learned = learned::Learned, WarmUp = friction::WarmUp }
}

impl Kind {
    /// Every effect that a rig of this process may hold: the vocabulary, what stands beside it, and
    /// what was registered.
    pub fn known() -> Vec<Self> {
        let builtin = Self::ALL.iter().chain(Self::BESIDE).copied();
        builtin.chain(added::all()).collect()
    }

    /// The effect of that name.
    pub fn named(kind: &str) -> Option<Self> {
        (Self::known().into_iter()).find(|candidate| candidate.description().kind == kind)
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

    const SCALES: Scales = Scales {
        position: 0.2,
        velocity: 0.5,
        force: 3.0,
        inertia: 1.5,
        time: 0.4,
        interval: 0.01,
        input: 5.0,
        reading: 0.2,
        range: (-0.1, 0.3),
    };

    #[test]
    fn the_vocabulary_is_complete_and_has_no_name_twice() {
        let mut names: Vec<&str> = Kind::ALL.iter().map(|k| k.description().kind).collect();
        assert_eq!(names.len(), 27);
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), 27);
    }

    #[test]
    fn descriptions_are_whole_and_name_each_other() {
        for &kind in Kind::ALL {
            let description = kind.description();
            assert!(!description.ports.is_empty() && !description.excited_by.is_empty());
            for &other in description.confusable {
                assert!(
                    Kind::named(other).is_some_and(|other| other != kind),
                    "{other}"
                );
            }
            let values = vec![(1.5, "N"); description.parameters.len()];
            let sentence = kind.sentence("part", &values);
            assert!(
                sentence.contains("part") && !sentence.contains('{'),
                "{sentence}"
            );
            let starts = kind.starts(&SCALES);
            assert!(!starts.is_empty());
            for start in starts {
                assert_eq!(start.len(), description.parameters.len());
                for (value, spec) in start.iter().zip(description.parameters) {
                    assert!(
                        spec.sign.admits(*value),
                        "{}.{}",
                        description.kind,
                        spec.name
                    );
                }
            }
        }
    }

    #[test]
    fn an_explanation_has_every_parameter_once_and_sentences_of_a_readable_length() {
        for kind in Kind::known() {
            let (description, words) = (kind.description(), kind.explanation());
            for spec in description.parameters {
                let about = |entry: &&(&str, &str)| Explanation::is_about(entry.0, spec.name);
                let entries = words.parameters.iter().filter(about).count();
                assert_eq!(entries, 1, "{}.{}", description.kind, spec.name);
            }
            for (entry, meaning) in words.parameters {
                let about = |spec: &&ParameterSpec| Explanation::is_about(entry, spec.name);
                let known = description.parameters.iter().find(about).is_some();
                assert!(
                    known && !meaning.is_empty(),
                    "{}: {entry}",
                    description.kind
                );
            }
            for text in [words.cause, words.next] {
                assert!(text.ends_with('.'), "{}: {text}", description.kind);
                let mut sentences = text.split(". ");
                let long = sentences.find(|sentence| sentence.split(' ').count() > 25);
                assert_eq!(long, None, "{}", description.kind);
            }
        }
    }

    /// A strength that is not marked as one has no weak start, and a strong effect is then seldom
    /// found.
    #[test]
    fn roles_ranges_and_sizes_change_only_with_a_new_blind_table() {
        let of = |wanted: &dyn Fn(&ParameterSpec) -> bool| {
            let mut all = Vec::new();
            for &kind in Kind::ALL {
                let Description {
                    kind, parameters, ..
                } = kind.description();
                let named = parameters.iter().filter(|spec| wanted(spec));
                all.extend(named.map(|spec| format!("{kind}.{}", spec.name)));
            }
            all
        };
        let strengths = of(&|spec| spec.role == Role::Strength);
        let known = [
            "level",
            "static_level",
            "level_pos",
            "level_neg",
            "damping_pos",
            "damping_neg",
            "damping",
            "coefficient",
            "stiffness",
            "alpha",
            "amplitude",
            "inertia",
            "gap",
            "width",
            "quadratic",
            "cubic",
        ];
        assert_eq!(strengths, of(&|spec| known.contains(&spec.name)));
        assert_eq!(
            of(&|spec| spec.range != SearchRange::Unlimited),
            [
                "stribeck_friction.velocity",
                "presliding_friction.distance",
                "hysteresis.beta",
                "hysteresis.gamma",
                "hysteresis.exponent",
                "plastic_set.yield_extension",
                "position_ripple.wave_number",
            ]
        );
        assert_eq!(
            of(&|spec| spec.zero_means_absent == (spec.held || spec.sign == Sign::Positive)),
            [
                // A place has no size.
                "end_stop.position",
                "gravity_load.zero",
                "position_ripple.phase",
                "hidden_mode.inertia",
                "hidden_mode.stiffness",
                "hidden_mode.damping"
            ]
        );
    }

    /// With all scales ten times as large, start values are what their units make of it: none holds
    /// a number of its own.
    #[test]
    fn starts_scale_with_the_rig() {
        let lengths = Scales {
            position: 2.0,
            velocity: 5.0,
            range: (-1.0, 3.0),
            ..SCALES
        };
        let cubic = Kind::Cubic.starts(&SCALES)[0][0];
        assert!((Kind::Cubic.starts(&lengths)[0][0] * 1e3 / cubic - 1.0).abs() < 1e-12);
        let stop = &Kind::EndStop.starts(&SCALES)[0];
        assert!((Kind::EndStop.starts(&lengths)[0][0] / stop[0] - 10.0).abs() < 1e-12);
    }

    /// Check that dissipative effects take power out of every motion; slopes bound what differences
    /// measure.
    #[test]
    fn declared_energy_and_slopes_are_true() {
        let forces = [
            Family::Friction,
            Family::Damping,
            Family::Stiffness,
            Family::Load,
        ];
        let at_a_port = |kind: &&Kind| {
            let description = kind.description();
            forces.contains(&description.family)
                && description.ports != [Port::Pair]
                && ![Kind::LoadDependent, Kind::Presliding].contains(kind)
        };
        for &kind in Kind::ALL.iter().filter(at_a_port) {
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
