//! What may be wrong with a rig: an effect that it lacks, or a bare number in it.

use std::f64::consts::TAU;

use sinew_sim::effects::{Description, Family, Kind, ParameterSpec, Sign};
use sinew_sim::{Plant, Rig};

use super::alike;
use crate::error::Result;

/// One thing that may be wrong.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Suspect {
    /// An effect of the vocabulary, at a component.
    Effect { kind: Kind, component: String },
    /// The same effect at each of several components, joined by a plus, with numbers of its own at each: what one tendon
    /// does in its guide, every tendon of the rig does.
    Everywhere { kind: Kind, components: String },
    /// A parameter that the rig holds as known.
    Number { name: String },
}

impl Suspect {
    /// Its kind as a report names it.
    pub fn kind(&self) -> &str {
        match self {
            Self::Effect { kind, .. } | Self::Everywhere { kind, .. } => kind.description().kind,
            Self::Number { .. } => "wrong_number",
        }
    }

    /// The family of an effect.
    pub fn family(&self) -> Option<Family> {
        match self {
            Self::Effect { kind, .. } | Self::Everywhere { kind, .. } => {
                Some(kind.description().family)
            }
            Self::Number { .. } => None,
        }
    }

    /// The effect and every component that it sits at; `None` of a number.
    pub fn places(&self) -> Option<(Kind, Vec<&str>)> {
        match self {
            Self::Effect { kind, component } => Some((*kind, vec![component])),
            Self::Everywhere { kind, components } => Some((*kind, components.split('+').collect())),
            Self::Number { .. } => None,
        }
    }

    /// Full names of the parameters that `which` admits, a list for each component.
    fn named(&self, which: impl Fn(&ParameterSpec) -> bool) -> Vec<Vec<String>> {
        let Some((kind, components)) = self.places() else {
            return Vec::new();
        };
        let Description {
            kind, parameters, ..
        } = kind.description();
        let at = |component: &str| -> Vec<String> {
            let specs = parameters.iter().filter(|spec| which(spec));
            specs
                .map(|spec| format!("{component}.{kind}.{}", spec.name))
                .collect()
        };
        components.into_iter().map(at).collect()
    }

    /// Whether a second effect is looked for on top of it where it came out at `rank`, 0 for the best: what all of a kind
    /// do costs minutes there, so only where nothing alone does better.
    pub fn may_lead(&self, rank: usize) -> bool {
        match self {
            Self::Effect { .. } => true,
            Self::Everywhere { .. } => rank == 0,
            Self::Number { .. } => false,
        }
    }

    /// Whether it is a second effect beside these: no place has the same effect twice.
    pub fn may_join(&self, others: &[Self]) -> bool {
        let Some((kind, places)) = self.places() else {
            return false;
        };
        let repeats = |other: &Self| {
            let there = other.places().filter(|(its, _)| *its == kind);
            there.is_some_and(|(_, taken)| places.iter().any(|place| taken.contains(place)))
        };
        !others.iter().any(repeats)
    }

    /// Whether it says at least what another says: the same, or the same effect there and elsewhere.
    pub fn says(&self, other: &Self) -> bool {
        let both = self.places().zip(other.places());
        let covers = both.is_some_and(|((kind, mine), (its, theirs))| {
            kind == its && theirs.iter().all(|place| mine.contains(place))
        });
        covers || self == other
    }

    /// Where it sits: a component, or the parameter's full name.
    pub fn component(&self) -> &str {
        match self {
            Self::Effect { component, .. } => component,
            Self::Everywhere { components, .. } => components,
            Self::Number { name } => name,
        }
    }

    /// The rig with it, at some values, those of each component after the other; and the parameters that it puts under
    /// trial.
    ///
    /// # Errors
    /// A place or a value that the rig cannot take.
    pub fn apply(&self, rig: &Rig, values: &[f64]) -> Result<(Rig, Vec<(String, f64)>)> {
        let mut rig = rig.clone();
        if let Some((kind, components)) = self.places() {
            let each = kind.description().parameters.len();
            for (component, values) in components.iter().zip(values.chunks(each)) {
                let site = rig.site(kind, component)?;
                rig = rig.with_effect(kind, site, values)?;
            }
        }
        Ok((rig, self.trial()))
    }

    /// The parameters that it puts under trial, each with its lowest value. Forces are signed, so that a
    /// wrong sign shows instead of hiding behind a bound; what has no meaning below zero (a time, a gap, a
    /// mass) stays above it.
    pub fn trial(&self) -> Vec<(String, f64)> {
        let Some((kind, _)) = self.places() else {
            return vec![(self.component().to_owned(), f64::NEG_INFINITY)];
        };
        let description = kind.description();
        let signed = [
            Family::Friction,
            Family::Damping,
            Family::Stiffness,
            Family::Load,
        ]
        .contains(&description.family);
        let lowest = |spec: &ParameterSpec| match spec.sign {
            Sign::Positive => f64::MIN_POSITIVE,
            Sign::NonNegative if !signed => 0.0,
            _ => f64::NEG_INFINITY,
        };
        let free = description.parameters.iter().filter(|spec| !spec.held);
        let lows: Vec<f64> = free.map(lowest).collect();
        let names = self.named(|spec| !spec.held);
        let of_each = names
            .into_iter()
            .map(|names| names.into_iter().zip(lows.clone()));
        of_each.flatten().collect()
    }

    /// Whether it sits at a body, and not in what holds one.
    pub fn at_body(&self, rig: &Rig) -> bool {
        let mut bodies = rig.bodies.iter();
        bodies.any(|body| body.name == self.component())
    }

    /// Every parameter of an effect, as [`Suspect::apply`] takes their values.
    pub fn parameters(&self) -> Vec<String> {
        self.named(|_| true).into_iter().flatten().collect()
    }

    /// Parameters of an effect that can be zero, a list for each component: where none of a list is known to be away from it,
    /// nothing shows that the effect is there. Without its inertia a mode pushes nothing, whatever it is damped by.
    pub fn sizes(&self) -> Vec<Vec<String>> {
        match self.family() {
            Some(Family::Mode) => self.named(|spec| spec.name == "inertia"),
            _ => self.named(|spec| !spec.held && spec.sign != Sign::Positive),
        }
    }

    /// Its parameters at components that are alike, a list for each that they all have; none of what sits at one component.
    pub fn alike(&self) -> Vec<Vec<String>> {
        match self.named(|spec| !spec.held) {
            each if each.len() > 1 => (0..each[0].len())
                .map(|which| each.iter().map(|names| names[which].clone()).collect())
                .collect(),
            _ => Vec::new(),
        }
    }

    /// Those of its parameters that the vocabulary wants at zero or more.
    pub fn not_below_zero(&self) -> Vec<String> {
        let each = self.named(|spec| spec.sign == Sign::NonNegative);
        each.into_iter().flatten().collect()
    }

    /// Whether fitted parameters have the signs that the vocabulary gives them, and what they describe happens
    /// within a recording of `duration` seconds.
    pub fn sane(&self, plant: &Plant, values: &[f64], duration: f64) -> bool {
        let Some((kind, components)) = self.places() else {
            return true;
        };
        let at = |component: &&str| sane(kind, component, plant, values, duration);
        components.iter().all(at)
    }
}

/// [`Suspect::sane`] of an effect at one component.
fn sane(kind: Kind, component: &str, plant: &Plant, values: &[f64], duration: f64) -> bool {
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

/// Everything that may be wrong with a rig.
pub(super) fn suspects(rig: &Rig, plant: &Plant) -> Vec<Suspect> {
    let mut all = Vec::new();
    for &kind in Kind::ALL {
        for site in kind.sites(rig) {
            let component = rig.site_name(site);
            all.push(Suspect::Effect { kind, component });
        }
    }
    for &kind in Kind::ALL {
        for sites in alike::groups(rig, kind) {
            let names: Vec<String> = sites.into_iter().map(|site| rig.site_name(site)).collect();
            let components = names.join("+");
            all.push(Suspect::Everywhere { kind, components });
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
            "/../../rigs/mass-spring-damper.toml"
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

    /// A shipped rig, and the suspects that put an effect at several places of it.
    fn alike(name: &str) -> (Rig, Vec<Suspect>) {
        let rig = Rig::load(format!("{}/../../rigs/{name}", env!("CARGO_MANIFEST_DIR")));
        let rig = rig.expect("it ships with the project");
        let plant = Plant::new(&rig).expect("it is sound");
        let all = suspects(&rig, &plant).into_iter();
        let together = all.filter(|one| matches!(one, Suspect::Everywhere { .. }));
        let together = together.collect();
        (rig, together)
    }

    #[test]
    fn what_one_tendon_spring_winch_or_camera_does_all_alike_are_suspected_of() {
        let (rig, together) = alike("tendon.toml");
        let of = |components: &str| -> Vec<&str> {
            let them = together.iter().filter(|one| one.component() == components);
            them.map(Suspect::kind).collect()
        };
        let tendons = of("east+west+north+south");
        assert_eq!(
            tendons,
            ["load_dependent_friction", "backlash", "tendon_slack"]
        );
        let joints = [1, 2, 3].map(|k| format!("spine.flex_x{k}+spine.flex_y{k}"));
        assert!(of(&joints.join("+")).contains(&"viscoelastic_creep"));
        assert!(of("pull_east+pay_out_west+pull_north+pay_out_south").contains(&"input_dead_zone"));
        assert_eq!(of("tip_x+tip_y+tip_z"), ["sensor_lag", "sensor_curvature"]);
        let rub = Suspect::Everywhere {
            kind: Kind::named("load_dependent_friction").expect("it is in the vocabulary"),
            components: "east+west+north+south".into(),
        };
        let (with, trial) = rub
            .apply(&rig, &[0.1, 0.2, 0.3, 0.4])
            .expect("it can sit there");
        assert_eq!((with.effects.len(), trial.len()), (4, 4));
        assert_eq!(
            rub.sizes().len(),
            4,
            "each of them has to show that it is there"
        );
        let plant = Plant::new(&with).expect("it is sound");
        let slot = |name: &String| plant.values()[plant.slot(name).expect("it has one")];
        let values: Vec<f64> = rub.parameters().iter().map(slot).collect();
        assert_eq!(values, [0.1, 0.2, 0.3, 0.4]);
    }

    #[test]
    fn springs_of_one_plate_are_alike_and_those_of_several_bodies_are_not() {
        let (_, together) = alike("hasel.toml");
        let foam = "column_rise+column_roll+column_pitch";
        assert!(together.iter().any(|one| one.component() == foam));
        let field = "field_1x+field_1y+field_1z";
        assert!(together.iter().any(|one| one.component() == field));
        for rig in [
            "mass-spring-damper.toml",
            "two-mass-drive.toml",
            "three-mass.toml",
        ] {
            assert!(alike(rig).1.is_empty(), "{rig}");
        }
    }

    #[test]
    fn joints_of_one_chain_rub_alike_and_no_load_hangs_at_all_of_them() {
        let (_, together) = alike("tendon.toml");
        let joints = "spine.x1+spine.y1+spine.x2+spine.y2+spine.x3+spine.y3";
        let at_joints = together.iter().filter(|one| one.component() == joints);
        let kinds: Vec<&str> = at_joints.map(Suspect::kind).collect();
        for kind in ["coulomb_friction", "viscous_damping", "end_stop"] {
            assert!(kinds.contains(&kind), "{kind}");
        }
        for kind in ["constant_load", "position_ripple", "hidden_mode"] {
            assert!(!kinds.contains(&kind), "{kind}");
        }
    }

    #[test]
    fn no_place_is_suspected_of_the_same_effect_twice() {
        let kind = |name: &str| Kind::named(name).expect("it is in the vocabulary");
        let at = |name: &str, component: &str| Suspect::Effect {
            kind: kind(name),
            component: component.into(),
        };
        let all = Suspect::Everywhere {
            kind: kind("tendon_slack"),
            components: "east+west".into(),
        };
        let number = Suspect::Number {
            name: "east.stiffness".into(),
        };
        assert!(!at("tendon_slack", "west").may_join(std::slice::from_ref(&all)));
        assert!(!all.may_join(&[at("tendon_slack", "east")]));
        assert!(!all.may_join(std::slice::from_ref(&all)));
        assert!(at("backlash", "west").may_join(std::slice::from_ref(&all)));
        assert!(at("tendon_slack", "north").may_join(std::slice::from_ref(&all)));
        assert!(all.may_join(&[at("sensor_lag", "tip_x"), number.clone()]));
        assert!(!number.may_join(std::slice::from_ref(&all)));
        assert!(all.says(&at("tendon_slack", "west")) && number.says(&number));
        assert!(!all.says(&at("backlash", "west")) && !all.says(&at("tendon_slack", "north")));
        assert!(!at("tendon_slack", "west").says(&all));
    }

    #[test]
    fn a_second_effect_is_looked_for_on_top_of_many_only_where_they_did_best() {
        let kind = Kind::named("tendon_slack").expect("it is in the vocabulary");
        let one = Suspect::Effect {
            kind,
            component: "west".into(),
        };
        let all = Suspect::Everywhere {
            kind,
            components: "east+west".into(),
        };
        let number = Suspect::Number {
            name: "east.stiffness".into(),
        };
        let lead = |rank| [&one, &all, &number].map(|suspect| suspect.may_lead(rank));
        assert_eq!(lead(0), [true, true, false]);
        assert_eq!(lead(1), [true, false, false]);
    }
}
