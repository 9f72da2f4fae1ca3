//! What is easily taken for what was found, in its place: a race is coarse, and of two laws that nearly agree it may have
//! brought the wrong one to the final (docs/explanation/diagnosis.md, "Neighbours").

use sinew_sim::Rig;
use sinew_sim::rig::End;

use super::evidence::Contender;
use super::race::{Track, Tried};
use super::search::Bench;
use super::suspect::Suspect;
use crate::error::Result;

impl Bench<'_> {
    /// Each effect of `best` exchanged for those that are near it, from where `best` ended; `start` is the rig without
    /// effects. What `known` holds is not tried again.
    pub fn neighbours(
        &self,
        track: &Track,
        start: &Tried,
        best: &Tried,
        known: &[Contender],
        all: &[Suspect],
    ) -> Result<Vec<Contender>> {
        let mut found = Vec::new();
        for (at, replaced) in best.suspects.iter().enumerate() {
            let mut others = best.suspects.clone();
            others.remove(at);
            let tried = |suspect: &Suspect| {
                known.iter().any(|contender| {
                    let suspects = &contender.tried.suspects;
                    suspects.len() == best.suspects.len()
                        && suspects.contains(suspect)
                        && others.iter().all(|other| suspects.contains(other))
                })
            };
            let rig = &start.model.rig;
            let alone = |suspect: &Suspect| {
                let singles = known.iter().map(|contender| &contender.tried.suspects[..]);
                let mut singles = singles.filter(|_| !others.is_empty());
                singles.any(|single| single == std::slice::from_ref(suspect))
                    && touch(rig, replaced, suspect)
            };
            let exchanged: Vec<Suspect> = all
                .iter()
                .filter(|suspect| suspect.may_join(&others) && !tried(suspect))
                .filter(|suspect| near(rig, replaced, suspect) || alone(suspect))
                .cloned()
                .collect();
            if exchanged.is_empty() {
                continue;
            }
            let parent = match &others[..] {
                [] => track.as_written(&start.model.rig)?,
                [other] => track.alone(start, best, other, 0)?,
                _ => None,
            };
            if let Some(parent) = parent {
                found.extend(self.round(track, &parent, &exchanged, "neighbours")?);
            }
        }
        Ok(found)
    }
}

/// Whether `other` may be what was taken for `found`: confusable with it, at the same component or one that touches it; or the
/// same, at a body that the spring which was found touches.
fn near(rig: &Rig, found: &Suspect, other: &Suspect) -> bool {
    let moved = found.kind() == other.kind() && !found.at_body(rig) && other.at_body(rig);
    (confusable(found, other) || moved) && touch(rig, found, other)
}

/// Whether one is called confusable with the other, either way round.
fn confusable(a: &Suspect, b: &Suspect) -> bool {
    let lists = |one: &Suspect, other: &Suspect| match one {
        Suspect::Effect { kind, .. } => kind.description().confusable.contains(&other.kind()),
        Suspect::Everywhere { .. } | Suspect::Number { .. } => false,
    };
    lists(a, b) || lists(b, a)
}

/// The same component, or a body and what is fastened to it.
fn touch(rig: &Rig, a: &Suspect, b: &Suspect) -> bool {
    let bodies = |suspect: &Suspect| -> Vec<usize> {
        let name = suspect.component();
        let ends = |ends: [End; 2]| {
            let bodies = ends.into_iter().filter_map(|end| match end {
                End::Body(body) => Some(body),
                End::Ground => None,
            });
            bodies.collect::<Vec<usize>>()
        };
        let of_body = rig.bodies.iter().position(|body| body.name == name);
        let spring = rig.springs.iter().find(|spring| spring.name == name);
        let tendon = rig.tendons.iter().find(|tendon| tendon.name == name);
        match (of_body, spring, tendon) {
            (Some(body), _, _) => vec![body],
            (_, Some(spring), _) => ends([spring.from, spring.to]),
            (_, _, Some(tendon)) => tendon.path.iter().map(|(body, _)| *body).collect(),
            _ => Vec::new(),
        }
    };
    let (of_a, of_b) = (bodies(a), bodies(b));
    a.component() == b.component() || of_a.iter().any(|body| of_b.contains(body))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_sim::effects::Kind;

    fn suspect(kind: &str, component: &str) -> Suspect {
        Suspect::Effect {
            kind: Kind::named(kind).expect("it is in the vocabulary"),
            component: component.into(),
        }
    }

    fn rig() -> Rig {
        let file = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../rigs/two-mass-drive.toml"
        );
        Rig::load(file).expect("it ships with the project")
    }

    #[test]
    fn what_was_found_in_a_spring_may_be_at_a_body_that_it_touches() {
        let (rig, shaft) = (rig(), suspect("viscous_damping", "shaft"));
        for body in ["motor", "load"] {
            let there = suspect("viscous_damping", body);
            assert!(near(&rig, &shaft, &there), "{body}");
            assert!(!near(&rig, &there, &shaft), "{body}");
        }
        assert!(!near(&rig, &shaft, &suspect("coulomb_friction", "drive")));
    }

    #[test]
    fn neighbours_are_confusable_and_touch() {
        let rig = rig();
        let are = |a: &Suspect, b: &Suspect| {
            let both = (
                confusable(a, b) && touch(&rig, a, b),
                confusable(b, a) && touch(&rig, b, a),
            );
            assert_eq!(both.0, both.1);
            both.0
        };
        let friction = suspect("direction_dependent_friction", "load");
        assert!(are(&friction, &suspect("viscous_damping", "load")));
        assert!(!are(&friction, &suspect("viscous_damping", "motor")));
        assert!(!are(&friction, &suspect("end_stop", "load")));
        let creep = suspect("viscoelastic_creep", "shaft");
        assert!(are(&creep, &suspect("viscous_damping", "load")));
        assert!(are(&creep, &suspect("viscous_damping", "motor")));
    }
}
