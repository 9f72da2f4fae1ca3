//! Terms of a candidate: effects that a rig may lack and bare numbers in it that may be wrong.

use sinew_sim::effects::{Description, Family, Kind, ParameterSpec, Sign};
use sinew_sim::rig::Site;
use sinew_sim::{Plant, Rig};

use crate::diagnose::by_signal::{BySignal, is_strength};
use crate::diagnose::finding::WRONG_NUMBER;
use crate::error::Result;

/// Site of an effect with the name of its component.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Place {
    /// Component of the rig.
    pub site: Site,
    /// Name of the component; a pair of bodies is written `a+b`.
    pub name: String,
}

/// One hypothesis about what a rig lacks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Term {
    /// An effect of the vocabulary with parameters of its own at each of its sites: at one
    /// component, or at every one of a group of identical components.
    Effect {
        kind: Kind,
        sites: Vec<Place>,
        /// Signal that its strengths depend on, if they do.
        by: Option<BySignal>,
    },
    /// A parameter that the rig holds as known.
    Number { name: String },
}

/// Parameter of a term before its first step: its name and the values that a search may try.
pub(crate) struct Tried {
    /// Full name in the plant.
    pub name: String,
    /// Lowest and highest value.
    pub bounds: [f64; 2],
}

impl Term {
    /// An effect at these sites of a rig.
    pub fn at(rig: &Rig, kind: Kind, sites: &[Site]) -> Self {
        let place = |&site: &Site| Place {
            site,
            name: rig.site_name(site),
        };
        Self::Effect {
            kind,
            sites: sites.iter().map(place).collect(),
            by: None,
        }
    }

    /// The same effect with strengths that depend on a signal.
    pub fn depending(mut self, signal: &BySignal) -> Self {
        if let Self::Effect { by, .. } = &mut self {
            *by = Some(signal.clone());
        }
        self
    }

    /// The signal that its strengths depend on.
    pub fn by(&self) -> Option<&BySignal> {
        match self {
            Self::Effect { by, .. } => by.as_ref(),
            Self::Number { .. } => None,
        }
    }

    /// Start values of its parameters at one component from those of the effect alone, several
    /// where its strengths depend on a signal.
    pub fn with_slopes(&self, start: &[f64]) -> Vec<Vec<f64>> {
        match self.by().zip(self.effect()) {
            Some((by, (kind, _))) => by.with_slopes(kind.description().parameters, start),
            None => vec![start.to_vec()],
        }
    }

    /// Parameters of the effect at one component at both ends of the signal's range, as they are
    /// without a signal.
    pub fn over_the_signal(&self, own: &[f64]) -> Vec<Vec<f64>> {
        match self.by().zip(self.effect()) {
            Some((by, (kind, _))) => by.over_its_range(kind.description().parameters, own),
            None => vec![own.to_vec()],
        }
    }

    /// Description of each parameter at one component, in the order of [`Term::apply`]: the
    /// description's, then a slope for each strength that depends on a signal.
    pub fn specs(&self) -> Vec<&'static ParameterSpec> {
        let Some((kind, _)) = self.effect() else {
            return Vec::new();
        };
        let own = kind.description().parameters.iter();
        let slopes = own.clone().filter(|spec| is_strength(spec));
        let slopes = slopes.filter(|_| self.by().is_some());
        own.chain(slopes).collect()
    }

    /// Its kind as a report names it.
    pub fn kind(&self) -> &str {
        match self {
            Self::Effect { kind, .. } => kind.description().kind,
            Self::Number { .. } => WRONG_NUMBER,
        }
    }

    /// The family of an effect.
    pub fn family(&self) -> Option<Family> {
        match self {
            Self::Effect { kind, .. } => Some(kind.description().family),
            Self::Number { .. } => None,
        }
    }

    /// The effect and every component that it sits at; `None` of a number.
    pub fn effect(&self) -> Option<(Kind, &[Place])> {
        match self {
            Self::Effect { kind, sites, .. } => Some((*kind, sites)),
            Self::Number { .. } => None,
        }
    }

    /// The effect and its component, where it sits at one alone.
    pub fn single(&self) -> Option<(Kind, &Place)> {
        match self {
            Self::Effect { kind, sites, .. } => match &sites[..] {
                [one] => Some((*kind, one)),
                _ => None,
            },
            Self::Number { .. } => None,
        }
    }

    /// Tells whether it is tried in the place of a term that is easily taken for it, and nowhere
    /// else.
    pub fn is_refinement(&self) -> bool {
        self.effect().is_some_and(|(kind, _)| kind.is_refinement())
    }

    /// Tells whether it is an effect at a group of identical components.
    pub fn is_group(&self) -> bool {
        matches!(self, Self::Effect { sites, .. } if sites.len() > 1)
    }

    /// Tells whether another term has the same place: the same components, or the same number.
    pub fn has_place_of(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Effect { sites: mine, .. }, Self::Effect { sites: its, .. }) => mine == its,
            _ => self == other,
        }
    }

    /// Full names of the parameters that `which` admits, a list for each component.
    fn named(&self, which: impl Fn(&ParameterSpec) -> bool) -> Vec<Vec<String>> {
        let Some((kind, sites)) = self.effect() else {
            return Vec::new();
        };
        let Description {
            kind, parameters, ..
        } = kind.description();
        let at = |place: &Place| -> Vec<String> {
            let specs = parameters.iter().filter(|spec| which(spec));
            let full = |spec: &ParameterSpec| format!("{}.{kind}.{}", place.name, spec.name);
            let slopes = specs.clone().filter(|spec| is_strength(spec));
            let slopes = slopes.filter(|_| self.by().is_some());
            let slopes = slopes.map(|spec| format!("{}.slope", full(spec)));
            specs.map(full).chain(slopes).collect()
        };
        sites.iter().map(at).collect()
    }

    /// Tells whether a second effect is looked for on top of it where it came out at `rank`, 0 for
    /// the best. A group costs minutes there, so it leads only where nothing alone does better.
    pub fn may_lead(&self, rank: usize) -> bool {
        match self {
            Self::Effect { sites, .. } => sites.len() == 1 || rank == 0,
            Self::Number { .. } => false,
        }
    }

    /// Tells whether it is a second effect beside these: no place has the same effect twice.
    pub fn may_join(&self, others: &[Self]) -> bool {
        let Some((kind, places)) = self.effect() else {
            return false;
        };
        let repeats = |other: &Self| {
            let there = other.effect().filter(|(its, _)| *its == kind);
            there.is_some_and(|(_, taken)| places.iter().any(|place| taken.contains(place)))
        };
        !others.iter().any(repeats)
    }

    /// Tells whether it says at least what another says: the same, or the same effect there and
    /// elsewhere.
    pub fn says(&self, other: &Self) -> bool {
        let both = self.effect().zip(other.effect());
        let covers = both.is_some_and(|((kind, mine), (its, theirs))| {
            kind == its && theirs.iter().all(|place| mine.contains(place))
        });
        let covers = covers && (other.by().is_none() || self.by() == other.by());
        covers || self == other
    }

    /// Tells whether it is the same effect at the same components, whatever its strengths depend
    /// on.
    pub fn is_effect_of(&self, other: &Self) -> bool {
        self.effect().is_some() && self.effect() == other.effect()
    }

    /// Name of its place in a report: components joined by a plus, or the parameter's full name.
    pub fn component(&self) -> String {
        match self {
            Self::Effect { sites, .. } => {
                let names: Vec<&str> = sites.iter().map(|place| place.name.as_str()).collect();
                names.join("+")
            }
            Self::Number { name } => name.clone(),
        }
    }

    /// The rig with it, at some values, those of each component after the other.
    ///
    /// # Errors
    /// A place or a value that the rig cannot take.
    pub fn apply(&self, rig: &Rig, values: &[f64]) -> Result<Rig> {
        let mut rig = rig.clone();
        if let Some((kind, sites)) = self.effect() {
            // Slopes that are not given begin at zero.
            let each = (values.len() / sites.len()).max(1);
            for (place, values) in sites.iter().zip(values.chunks(each)) {
                rig = match self.by() {
                    None => rig.with_effect(kind, place.site, values)?,
                    Some(by) => {
                        let mut values = values.to_vec();
                        values.resize(self.specs().len(), 0.0);
                        rig.with_dependent_effect(kind, place.site, &values, &by.name)?
                    }
                };
            }
        }
        Ok(rig)
    }

    /// The parameters that it puts under trial, with the values that a search may try from those
    /// that `plant` has. Forces are signed, so that a wrong sign shows instead of hiding behind a
    /// bound; what has no meaning below zero (a time, a gap, a mass) stays above it.
    pub fn tried(&self, plant: &Plant) -> Vec<Tried> {
        let Some((kind, sites)) = self.effect() else {
            return vec![Tried {
                name: self.component(),
                bounds: [f64::NEG_INFINITY, f64::INFINITY],
            }];
        };
        let description = kind.description();
        let signed = description.family.searched_with_either_sign();
        let lowest = |spec: &ParameterSpec| match spec.sign {
            Sign::Positive => f64::MIN_POSITIVE,
            Sign::NonNegative if !signed => 0.0,
            _ => f64::NEG_INFINITY,
        };
        let at = |place: &Place| {
            let full = |name: &str| format!("{}.{}.{name}", place.name, description.kind);
            let start = |name: &str| {
                let slot = plant.slot(&full(name));
                slot.map_or(0.0, |slot| plant.parameters()[slot].value)
            };
            let free = description.parameters.iter().filter(|spec| !spec.held);
            let slopes = free.clone().filter(|spec| is_strength(spec));
            let slopes = slopes.filter(|_| self.by().is_some()).map(|spec| Tried {
                name: full(&format!("{}.slope", spec.name)),
                bounds: [f64::NEG_INFINITY, f64::INFINITY],
            });
            let tried = free.map(|spec| {
                let [least, most] = spec.range.bounds(spec.name, start);
                // With a slope it is the value at the signal's zero, which need not be met.
                let depends = self.by().is_some() && is_strength(spec);
                let lowest = if depends {
                    f64::NEG_INFINITY
                } else {
                    lowest(spec)
                };
                Tried {
                    name: full(spec.name),
                    bounds: [lowest.max(least), most],
                }
            });
            tried.chain(slopes).collect::<Vec<_>>()
        };
        sites.iter().flat_map(at).collect()
    }

    /// Tells whether it sits at one body, and not in what holds one.
    pub fn at_body(&self) -> bool {
        matches!(self.single(), Some((_, place)) if matches!(place.site, Site::Body(_)))
    }

    /// Every parameter of an effect, as [`Term::apply`] takes their values.
    pub fn parameters(&self) -> Vec<String> {
        self.named(|_| true).into_iter().flatten().collect()
    }

    /// Parameters of an effect that can be zero, a list for each component: where none of a list is
    /// known to be away from it, nothing shows that the effect is there.
    pub fn sizes(&self) -> Vec<Vec<String>> {
        self.named(|spec| spec.zero_means_absent)
    }

    /// Its parameters at identical components, a list for each that they all have; none of what
    /// sits at one component.
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
        let depends = |spec: &ParameterSpec| self.by().is_some() && is_strength(spec);
        let each = self.named(|spec| spec.sign == Sign::NonNegative && !depends(spec));
        each.into_iter().flatten().collect()
    }

    /// Tells whether fitted parameters have the signs that the vocabulary gives them, and describe
    /// what shows within a recording of `duration` seconds.
    pub fn plausible(&self, plant: &Plant, values: &[f64], duration: f64) -> bool {
        let Some((kind, _)) = self.effect() else {
            return true;
        };
        let specs = kind.description().parameters;
        let at = |names: &Vec<String>| {
            let slots = names.iter().map(|name| plant.slot(name));
            let Some(slots) = slots.collect::<Option<Vec<usize>>>() else {
                return false;
            };
            let own: Vec<f64> = slots.into_iter().map(|slot| values[slot]).collect();
            self.over_the_signal(&own).iter().all(|own| {
                let mut signs = specs.iter().zip(own);
                signs.all(|(spec, value)| spec.sign.admits(*value)) && kind.plausible(own, duration)
            })
        };
        self.named(|_| true).iter().all(at)
    }
}

/// An effect at one component of a rig, or at all of several.
#[cfg(test)]
pub(crate) fn term(rig: &Rig, kind: &str, at: &[&str]) -> Term {
    let kind = Kind::named(kind).expect("the vocabulary has it");
    let site = |name: &&str| rig.site(kind, name).expect("the rig has such a component");
    Term::at(rig, kind, &at.iter().map(site).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shipped(name: &str) -> Rig {
        let rig = Rig::load(format!("{}/../../rigs/{name}", env!("CARGO_MANIFEST_DIR")));
        rig.expect("the rig ships with the project")
    }

    /// A damping by the root of speed was once named as friction that "falls" from 0.06 to 0.15 N
    /// m.
    #[test]
    fn friction_that_is_larger_in_motion_than_at_rest_makes_no_sense() {
        let stribeck = term(
            &shipped("mass-spring-damper.toml"),
            "stribeck_friction",
            &["mass"],
        );
        let plausible = |level: f64, at_rest: f64| {
            let rig = stribeck
                .apply(&shipped("mass-spring-damper.toml"), &[level, at_rest, 0.1])
                .expect("the mass bears friction");
            let plant = Plant::new(&rig).expect("the rig is sound");
            stribeck.plausible(&plant, &plant.values(), 10.0)
        };
        assert!(plausible(1.0, 1.5));
        assert!(!plausible(1.5, 1.0));
    }

    #[test]
    fn no_place_is_suspected_of_the_same_effect_twice() {
        let rig = shipped("tendon.toml");
        let at = |name: &str, component: &str| term(&rig, name, &[component]);
        let all = term(&rig, "tendon_slack", &["east", "west"]);
        let number = Term::Number {
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
        let rig = shipped("tendon.toml");
        let one = term(&rig, "tendon_slack", &["west"]);
        let all = term(&rig, "tendon_slack", &["east", "west"]);
        let number = Term::Number {
            name: "east.stiffness".into(),
        };
        let lead = |rank| [&one, &all, &number].map(|term| term.may_lead(rank));
        assert_eq!(lead(0), [true, true, false]);
        assert_eq!(lead(1), [true, false, false]);
    }
}
