//! What may be wrong with a rig: an effect that it lacks, or a bare number in it.

use std::f64::consts::TAU;

use sinew_sim::effects::{Family, Kind, Sign};
use sinew_sim::{Plant, Rig};

use crate::error::Result;

/// One thing that may be wrong.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Suspect {
    /// An effect of the vocabulary, at a component.
    Effect { kind: Kind, component: String },
    /// A parameter that the rig holds as known.
    Number { name: String },
}

impl Suspect {
    /// Its kind as a report names it.
    pub fn kind(&self) -> &str {
        match self {
            Self::Effect { kind, .. } => kind.description().kind,
            Self::Number { .. } => "wrong_number",
        }
    }

    /// The family of an effect.
    pub fn family(&self) -> Option<Family> {
        match self {
            Self::Effect { kind, .. } => Some(kind.description().family),
            Self::Number { .. } => None,
        }
    }

    /// Where it sits: a component, or the parameter's full name.
    pub fn component(&self) -> &str {
        match self {
            Self::Effect { component, .. } => component,
            Self::Number { name } => name,
        }
    }

    /// The rig with it, at some values; and the parameters that it puts under trial.
    ///
    /// # Errors
    /// A place or a value that the rig cannot take.
    pub fn apply(&self, rig: &Rig, values: &[f64]) -> Result<(Rig, Vec<(String, f64)>)> {
        match self {
            Self::Effect { kind, component } => {
                let site = rig.site(*kind, component)?;
                let rig = rig.with_effect(*kind, site, values)?;
                Ok((rig, self.trial()))
            }
            Self::Number { .. } => Ok((rig.clone(), self.trial())),
        }
    }

    /// The parameters that it puts under trial, each with its lowest value. Forces are signed, so that a
    /// wrong sign shows instead of hiding behind a bound; what has no meaning below zero (a time, a gap, a
    /// mass) stays above it.
    pub fn trial(&self) -> Vec<(String, f64)> {
        match self {
            Self::Effect { kind, component } => {
                let description = kind.description();
                let signed = [
                    Family::Friction,
                    Family::Damping,
                    Family::Stiffness,
                    Family::Load,
                ]
                .contains(&description.family);
                let of = description.parameters.iter();
                of.filter(|spec| !spec.held)
                    .map(|spec| {
                        let low = match spec.sign {
                            Sign::Positive => f64::MIN_POSITIVE,
                            Sign::NonNegative if !signed => 0.0,
                            _ => f64::NEG_INFINITY,
                        };
                        let name = format!("{component}.{}.{}", description.kind, spec.name);
                        (name, low)
                    })
                    .collect()
            }
            Self::Number { name } => vec![(name.clone(), f64::NEG_INFINITY)],
        }
    }

    /// Parameters of an effect that can be zero: where none of them is known to be away from it, nothing shows that the effect
    /// is there.
    pub fn sizes(&self) -> Vec<String> {
        match self {
            Self::Effect { kind, component } => {
                let description = kind.description();
                let free = description.parameters.iter().filter(|spec| !spec.held);
                free.filter(|spec| spec.sign != Sign::Positive)
                    .map(|spec| format!("{component}.{}.{}", description.kind, spec.name))
                    .collect()
            }
            Self::Number { .. } => Vec::new(),
        }
    }

    /// Those of its parameters that the vocabulary wants at zero or more.
    pub fn not_below_zero(&self) -> Vec<String> {
        match self {
            Self::Effect { kind, component } => {
                let description = kind.description();
                let signed = description.parameters.iter();
                let signed = signed.filter(|spec| spec.sign == Sign::NonNegative);
                let name = |name| format!("{component}.{}.{name}", description.kind);
                signed.map(|spec| name(spec.name)).collect()
            }
            Self::Number { .. } => Vec::new(),
        }
    }

    /// Whether fitted parameters have the signs that the vocabulary gives them, and what they describe happens
    /// within a recording of `duration` seconds.
    pub fn sane(&self, plant: &Plant, values: &[f64], duration: f64) -> bool {
        let Self::Effect { kind, component } = self else {
            return true;
        };
        let description = kind.description();
        let value = |name: &str| {
            let slot = plant.slot(&format!("{component}.{}.{name}", description.kind));
            slot.map(|slot| values[slot])
        };
        let signs = description
            .parameters
            .iter()
            .all(|spec| value(spec.name).is_some_and(|value| spec.sign.admits(value)));
        // A mode that does not swing once, or a lag that does not end, is a slow drift under another name.
        let within = match (value("inertia"), value("stiffness"), value("time_constant")) {
            (Some(inertia), Some(stiffness), _) => TAU * (inertia / stiffness).sqrt() < duration,
            (_, _, Some(time)) => time < duration,
            _ => true,
        };
        // Friction that is larger in motion than at rest is some damping under another name.
        let falls = match (value("level"), value("static_level")) {
            (Some(moving), Some(at_rest)) => at_rest >= moving,
            _ => true,
        };
        signs && within && falls
    }
}

/// Everything that may be wrong with a rig.
pub(super) fn suspects(rig: &Rig, plant: &Plant) -> Vec<Suspect> {
    let mut all = Vec::new();
    for &kind in Kind::ALL {
        for site in kind.sites(rig) {
            let component = rig.site_name(site);
            all.push(Suspect::Effect { kind, component });
        }
    }
    // A number that is not zero has a size to be wrong by; a zero (an offset, a rest) is left to the loads.
    for parameter in plant.parameters() {
        let starts =
            parameter.name.ends_with(".start") || parameter.name.ends_with(".start_velocity");
        if !parameter.free && !starts && parameter.value != 0.0 && !of_effect(rig, &parameter.name)
        {
            all.push(Suspect::Number {
                name: parameter.name.clone(),
            });
        }
    }
    all
}

fn of_effect(rig: &Rig, name: &str) -> bool {
    rig.effects.iter().any(|effect| {
        let prefix = format!(
            "{}.{}.",
            rig.site_name(effect.site),
            effect.kind.description().kind
        );
        name.starts_with(&prefix)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shipped() -> Rig {
        let file = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../rigs/mass-spring-damper.toml"
        );
        Rig::load(file).expect("the demo's rig ships with the project")
    }

    /// A damping by the root of speed was once named as friction that "falls" from 0.06 to 0.15 N m.
    #[test]
    fn friction_that_is_larger_in_motion_than_at_rest_makes_no_sense() {
        let stribeck = Suspect::Effect {
            kind: Kind::named("stribeck_friction").expect("it is in the vocabulary"),
            component: "mass".into(),
        };
        let sane = |level: f64, at_rest: f64| {
            let (rig, _) = stribeck
                .apply(&shipped(), &[level, at_rest, 0.1])
                .expect("it can sit there");
            let plant = Plant::new(&rig).expect("it is sound");
            stribeck.sane(&plant, &plant.values(), 10.0)
        };
        assert!(sane(1.0, 1.5));
        assert!(!sane(1.5, 1.0));
    }
}
