//! Effects that a program adds to the vocabulary without a line in this crate.

use std::fmt;
use std::sync::{PoisonError, RwLock};

use super::{At, Description, Explanation, Kind, Port, Scales, Slopes};
use crate::dual::Dual;
use crate::scalar::Scalar;

/// Number with derivatives in which an added law is written: position, velocity and up to
/// fourteen parameters.
pub type Jet = Dual<WIDTH>;

const WIDTH: usize = 16;

/// Law of an effect that is a force at a body or in a spring, written by a program that uses this
/// crate.
///
/// ```
/// use sinew_sim::effects::{
///     AddedEffect, At, Description, Energy, Explanation, Family, Jet, Kind, ParameterSpec, Port,
///     Quantity, Role, Scales, Sign, Slopes,
/// };
/// use sinew_sim::Rig;
///
/// /// `F = -coefficient v^3`
/// struct CubicDrag;
/// const PARAMETERS: &[ParameterSpec] =
///     &[ParameterSpec::new("coefficient", Quantity::Ratio, Sign::NonNegative).with_role(Role::Strength)];
/// static DESCRIPTION: Description = Description {
///     kind: "cubic_drag",
///     family: Family::Damping,
///     ports: &[Port::Body],
///     energy: Energy::Dissipates,
///     law: "F = -coefficient v^3",
///     equation: "",
///     parameters: PARAMETERS,
///     confusable: &[],
///     excited_by: "motion at low and at high speed",
///     sentence: "A drag of {coefficient} at {component} is missing from the model.",
/// };
///
/// impl AddedEffect for CubicDrag {
///     fn description(&self) -> &'static Description {
///         &DESCRIPTION
///     }
///     fn explanation(&self) -> &'static Explanation {
///         &Explanation {
///             cause: "A fluid that thickens when it is sheared.",
///             parameters: &[("coefficient", "force over the cube of the velocity")],
///             next: "Record motion at low and at high speed.",
///         }
///     }
///     fn starts(&self, scales: &Scales) -> Vec<Vec<f64>> {
///         vec![vec![0.5 * scales.force / scales.velocity.powi(3)]]
///     }
///     fn force(&self, p: &[Jet], at: &At<Jet>) -> Jet {
///         -(p[0] * at.velocity * at.velocity * at.velocity)
///     }
///     fn slopes(&self, p: &[f64], at: &At<f64>) -> Slopes {
///         Slopes { damping: 3.0 * (p[0] * at.velocity * at.velocity).abs(), ..Slopes::default() }
///     }
/// }
///
/// let kind = Kind::register(&CubicDrag).unwrap();
/// assert_eq!(Kind::named("cubic_drag"), Some(kind));
/// assert!(Kind::register(&CubicDrag).is_err(), "the name is taken");
/// ```
pub trait AddedEffect: Sync {
    /// Name, ports, parameters and words of the effect. Ports other than a body and a spring are
    /// refused.
    fn description(&self) -> &'static Description;

    /// Words about it for a person.
    fn explanation(&self) -> &'static Explanation;

    /// Start values of a fit, made of typical sizes at the port, most likely first.
    fn starts(&self, scales: &Scales) -> Vec<Vec<f64>>;

    /// Force at the port: on the body, or on `to` of the spring; `p` in the order of the
    /// description.
    fn force(&self, p: &[Jet], at: &At<Jet>) -> Jet;

    /// Bounds on the magnitude of its slopes near a state, for the choice of sub-steps.
    fn slopes(&self, p: &[f64], at: &At<f64>) -> Slopes;

    /// Largest force that holds a resting body in the directions (+, -); zero for all but friction.
    fn hold(&self, _p: &[Jet]) -> [Jet; 2] {
        [Jet::ZERO; 2]
    }

    /// True if fitted parameters describe what shows within a recording of `duration` seconds.
    fn plausible(&self, _p: &[f64], _duration: f64) -> bool {
        true
    }

    /// True if a device with it has several rests, so that a free run ends in one or in another.
    fn has_many_rests(&self) -> bool {
        false
    }

    /// True if the slope of its force jumps where the velocity of its body passes zero.
    fn has_kink_at_rest(&self) -> bool {
        false
    }
}

/// A registered law; equal where its name is.
#[derive(Clone, Copy)]
pub struct Added {
    law: &'static dyn AddedEffect,
}

impl PartialEq for Added {
    fn eq(&self, other: &Self) -> bool {
        self.law.description().kind == other.law.description().kind
    }
}

impl Eq for Added {}

impl std::fmt::Debug for Added {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.law.description().kind)
    }
}

/// Laws by the order of their registration.
static REGISTERED: RwLock<Vec<Added>> = RwLock::new(Vec::new());

/// Every registered effect.
pub(super) fn all() -> Vec<Kind> {
    let known = REGISTERED.read().unwrap_or_else(PoisonError::into_inner);
    known.iter().map(|added| Kind::Added(*added)).collect()
}

/// Refusal of an effect that no rig file could use.
///
/// ```
/// use sinew_sim::effects::RegisterError;
/// let refused = RegisterError::NameTaken { name: "coulomb_friction" };
/// assert_eq!(refused.to_string(), "there is an effect `coulomb_friction` already");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RegisterError {
    /// An effect has this name already.
    NameTaken {
        /// The name.
        name: &'static str,
    },
    /// It sits at another port than a body or a spring.
    Port {
        /// Name of the effect.
        name: &'static str,
        /// The port.
        port: Port,
    },
    /// It has more parameters than [`Jet`] has derivatives for.
    Parameters {
        /// Name of the effect.
        name: &'static str,
        /// Number of its parameters.
        found: usize,
    },
}

impl fmt::Display for RegisterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NameTaken { name } => write!(f, "there is an effect `{name}` already"),
            Self::Port { name, port } => write!(
                f,
                "`{name}` must sit at a body or a spring; it sits at {}",
                port.noun()
            ),
            Self::Parameters { name, found } => write!(
                f,
                "`{name}` must have at most {} parameters; it has {found}",
                WIDTH - 2
            ),
        }
    }
}

impl std::error::Error for RegisterError {}

impl Kind {
    /// Registers the law of an effect, so that rig files of this process may hold it. A diagnosis
    /// looks for it where it is told to.
    ///
    /// # Errors
    /// A description that no rig file could use: its name is taken, it sits at another port than a
    /// body or a spring, or it has more than fourteen parameters.
    pub fn register(law: &'static dyn AddedEffect) -> Result<Self, RegisterError> {
        let description = law.description();
        let name = description.kind;
        if description.parameters.len() + 2 > WIDTH {
            let found = description.parameters.len();
            return Err(RegisterError::Parameters { name, found });
        }
        let mut ports = description.ports.iter().copied();
        if let Some(port) = ports.find(|port| !matches!(port, Port::Body | Port::Spring)) {
            return Err(RegisterError::Port { name, port });
        }
        let mut known = REGISTERED.write().unwrap_or_else(PoisonError::into_inner);
        let builtin = Self::ALL.iter().chain(Self::BESIDE);
        let mut names = builtin
            .map(|kind| kind.description().kind)
            .chain(known.iter().map(|added| added.law.description().kind));
        if names.any(|taken| taken == name) {
            return Err(RegisterError::NameTaken { name });
        }
        let added = Added { law };
        known.push(added);
        Ok(Self::Added(added))
    }
}

impl Added {
    pub(super) fn law(self) -> &'static dyn AddedEffect {
        self.law
    }

    /// The law at numbers of any sort: exact in its value and its first derivatives (chain rule).
    pub(super) fn force<S: Scalar>(self, p: &[S], at: &At<S>) -> S {
        let (parameters, state) = self.seeds(p, Some(at));
        let [position, velocity] = state;
        let here = At {
            position,
            velocity,
            direction: at.direction,
            motion: at.motion,
        };
        let found = self.law.force(&parameters, &here);
        self.chained(found, p, Some(at))
    }

    /// As [`Added::force`].
    pub(super) fn hold<S: Scalar>(self, p: &[S]) -> [S; 2] {
        let (parameters, _) = self.seeds(p, None);
        let found = self.law.hold(&parameters);
        found.map(|level| self.chained(level, p, None))
    }

    /// Parameters, position and velocity as independent variables.
    fn seeds<S: Scalar>(self, p: &[S], at: Option<&At<S>>) -> (Vec<Jet>, [Jet; 2]) {
        let count = self.law.description().parameters.len();
        let parameters = p.iter().take(count).enumerate();
        let parameters = parameters.map(|(index, p)| Jet::variable(p.value(), index + 2));
        let state = at.map_or([Jet::ZERO; 2], |at| {
            [
                Jet::variable(at.position.value(), 0),
                Jet::variable(at.velocity.value(), 1),
            ]
        });
        (parameters.collect(), state)
    }

    /// `f + sum df/dx_i (x_i - value of x_i)`, of which the sum has derivatives and no value.
    fn chained<S: Scalar>(self, found: Jet, p: &[S], at: Option<&At<S>>) -> S {
        let count = self.law.description().parameters.len();
        let state = at
            .map(|at| [at.position, at.velocity])
            .into_iter()
            .flatten();
        let first = if at.is_some() { 0 } else { 2 };
        let variables = state.chain(p.iter().take(count).copied());
        let mut all = S::constant(found.value);
        for (slope, x) in found.derivative[first..].iter().zip(variables) {
            if *slope != 0.0 {
                all += (x - x.value()) * *slope;
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Energy, Family, Motion, ParameterSpec, Port, Quantity, Sign};

    static DESCRIPTION: Description = Description {
        kind: "root_drag",
        family: Family::Damping,
        ports: &[Port::Body],
        energy: Energy::Dissipates,
        law: "",
        equation: "",
        parameters: &[ParameterSpec::new(
            "coefficient",
            Quantity::Ratio,
            Sign::Any,
        )],
        confusable: &[],
        excited_by: "",
        sentence: "",
    };

    struct Root;

    impl AddedEffect for Root {
        fn description(&self) -> &'static Description {
            &DESCRIPTION
        }

        fn explanation(&self) -> &'static Explanation {
            &Explanation {
                cause: "",
                parameters: &[],
                next: "",
            }
        }

        fn starts(&self, _scales: &Scales) -> Vec<Vec<f64>> {
            Vec::new()
        }

        fn force(&self, p: &[Jet], at: &At<Jet>) -> Jet {
            -(p[0] * at.velocity * (at.velocity.abs() + 1.0).sqrt())
        }

        fn slopes(&self, _p: &[f64], _at: &At<f64>) -> Slopes {
            Slopes::default()
        }
    }

    #[test]
    fn an_added_law_has_the_derivatives_of_differences_and_the_same_value_for_every_number() {
        let added = Added { law: &Root };
        let at = |velocity: f64| At {
            position: 0.3,
            velocity,
            direction: 1.0,
            motion: Motion::Slide,
        };
        let exact = At {
            position: Dual::<2>::constant(0.3),
            velocity: Dual::variable(1.7, 0),
            direction: 1.0,
            motion: Motion::Slide,
        };
        let found = added.force(&[Dual::variable(2.0, 1), Dual::constant(9.0)], &exact);
        assert_eq!(found.value, added.force(&[2.0, 9.0], &at(1.7)));
        let (h, p) = (1e-6, [2.0]);
        let slope = (added.force(&p, &at(1.7 + h)) - added.force(&p, &at(1.7 - h))) / (2.0 * h);
        assert!((found.derivative[0] - slope).abs() < 1e-8, "{found:?}");
        let of_p = added.force(&[2.0], &at(1.7)) / 2.0;
        assert!((found.derivative[1] - of_p).abs() < 1e-12, "{found:?}");
        assert_eq!(added.hold(&[2.0]), [0.0; 2]);
    }
}
