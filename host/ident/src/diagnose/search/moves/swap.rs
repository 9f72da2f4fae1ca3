//! Exchange of a term for those that are easily taken for it, in its place: a screening is coarse,
//! and of two laws that nearly agree it may have brought the wrong one to the final
//! (docs/explanation/diagnosis.md, "Moves").

use sinew_sim::Rig;
use sinew_sim::rig::{End, Site};

use crate::diagnose::acceptance::{leaves_something, ranking};
use crate::diagnose::candidate::{Candidate, Trial};
use crate::diagnose::case::Case;
use crate::diagnose::pool::{Pool, Proposal, Selection};
use crate::diagnose::search::context::{Context, Move};
use crate::diagnose::search::refit::screen_and_refit;
use crate::diagnose::search::subset::Subset;
use crate::diagnose::term::Term;
use crate::error::Result;

/// Exchanges each term of the best candidate for those that are easily taken for it, in its place
/// or beside it.
pub(crate) struct Swap;

impl Move for Swap {
    fn name(&self) -> &'static str {
        "swap"
    }

    fn applies(&self, context: &Context, pool: &Pool) -> bool {
        context.case.has_rows_for_two() && promising(context, pool).is_some()
    }

    fn propose(&self, context: &Context, pool: &Pool) -> Result<Option<Proposal>> {
        let Context {
            case,
            subset,
            start,
            terms,
            refinements,
            ..
        } = context;
        let all = [&terms[..], refinements].concat();
        let Some(index) = promising(context, pool) else {
            return Ok(None);
        };
        let best = &pool.candidates[index].trial;
        Ok(Some(Proposal {
            candidates: swapped(case, subset, start, best, &pool.candidates, &all)?,
            ..Proposal::default()
        }))
    }

    fn selection(&self) -> Selection {
        Selection::BestBySize
    }
}

/// The chosen candidate; or, as a pair that is not believed may be right in one half, the best pair
/// that explains all, or the best pair.
fn promising(context: &Context, pool: &Pool) -> Option<usize> {
    let near_miss = || {
        let mut pairs = ranking(context.case, &pool.baseline, &pool.candidates);
        pairs.retain(|&index| pool.candidates[index].terms().len() == 2);
        let explains = |index: &usize| !leaves_something(context.case, &pool.candidates[*index]);
        let best = pairs.first().copied();
        pairs.into_iter().find(explains).or(best)
    };
    pool.chosen.or_else(near_miss)
}

/// Each effect of `best` exchanged for those that are near it, from where `best` ended; `start` is
/// the rig without effects. What `known` holds is not tried again.
pub(crate) fn swapped(
    case: &Case,
    subset: &Subset,
    start: &Trial,
    best: &Trial,
    known: &[Candidate],
    all: &[Term],
) -> Result<Vec<Candidate>> {
    let mut found = Vec::new();
    for (at, replaced) in best.terms.iter().enumerate() {
        let mut others = best.terms.clone();
        others.remove(at);
        let trial = |term: &Term| {
            known.iter().any(|candidate| {
                let terms = &candidate.trial.terms;
                terms.len() == best.terms.len()
                    && terms.contains(term)
                    && others.iter().all(|other| terms.contains(other))
            })
        };
        let rig = &start.model.rig;
        let alone = |term: &Term| {
            let singles = known.iter().map(|candidate| &candidate.trial.terms[..]);
            let mut singles = singles.filter(|_| !others.is_empty());
            singles.any(|single| single == std::slice::from_ref(term)) && touch(rig, replaced, term)
        };
        let exchanged: Vec<Term> = all
            .iter()
            .filter(|term| term.may_join(&others) && !trial(term))
            .filter(|term| near(rig, replaced, term) || alone(term))
            .cloned()
            .collect();
        if exchanged.is_empty() || case.time.is_spent() {
            continue;
        }
        let parent = match &others[..] {
            [] => subset.as_written(&start.model.rig)?,
            [other] => subset.alone(start, best, other, 0)?,
            _ => None,
        };
        if let Some(parent) = parent {
            found.extend(screen_and_refit(
                case,
                subset,
                &parent,
                &exchanged,
                "neighbours",
            )?);
        }
    }
    Ok(found)
}

/// Tells whether `other` may be what was taken for `found`: confusable with it, at the same
/// component or one that touches it; or the same, at a body that the spring which was found
/// touches.
pub(super) fn near(rig: &Rig, found: &Term, other: &Term) -> bool {
    let moved = found.kind() == other.kind() && !found.at_body() && other.at_body();
    (confusable(found, other) || moved) && touch(rig, found, other)
}

/// Tells whether one is called confusable with the other, either way round.
fn confusable(a: &Term, b: &Term) -> bool {
    let lists = |one: &Term, other: &Term| {
        let single = one.single();
        single.is_some_and(|(kind, _)| kind.description().confusable.contains(&other.kind()))
    };
    lists(a, b) || lists(b, a)
}

/// The same component, or a body and what is fastened to it.
fn touch(rig: &Rig, a: &Term, b: &Term) -> bool {
    let bodies = |term: &Term| -> Vec<usize> {
        let ends = |ends: [End; 2]| {
            let bodies = ends.into_iter().filter_map(|end| match end {
                End::Body(body) => Some(body),
                End::Ground => None,
            });
            bodies.collect::<Vec<usize>>()
        };
        match term.single().map(|(_, place)| place.site) {
            Some(Site::Body(body)) => vec![body],
            Some(Site::Spring(spring)) => ends([rig.springs[spring].from, rig.springs[spring].to]),
            Some(Site::Tendon(tendon)) => {
                let path = rig.tendons[tendon].path.iter();
                path.map(|(body, _)| *body).collect()
            }
            _ => Vec::new(),
        }
    };
    let (of_a, of_b) = (bodies(a), bodies(b));
    a.has_place_of(b) || of_a.iter().any(|body| of_b.contains(body))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::term;

    fn term(kind: &str, component: &str) -> Term {
        term::term(&rig(), kind, &[component])
    }

    fn rig() -> Rig {
        let file = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../rigs/two-mass-drive.toml"
        );
        Rig::load(file).expect("the rig ships with the project")
    }

    #[test]
    fn what_was_found_in_a_spring_may_be_at_a_body_that_it_touches() {
        let (rig, shaft) = (rig(), term("viscous_damping", "shaft"));
        for body in ["motor", "load"] {
            let there = term("viscous_damping", body);
            assert!(near(&rig, &shaft, &there), "{body}");
            assert!(!near(&rig, &there, &shaft), "{body}");
        }
        assert!(!near(&rig, &shaft, &term("input_delay", "drive")));
    }

    /// Friction that yields before it slips is looked for where a friction or a hysteresis was
    /// found, and only there.
    #[test]
    fn a_refinement_is_tried_in_the_place_of_its_relatives_alone() {
        let rig = rig();
        let refined = term("presliding_friction", "load");
        assert!(refined.is_refinement());
        for (kind, component) in [
            ("coulomb_friction", "load"),
            ("stribeck_friction", "load"),
            ("hysteresis", "shaft"),
        ] {
            let found = term(kind, component);
            assert!(!found.is_refinement());
            assert!(near(&rig, &found, &refined), "{kind}");
        }
        for (kind, component) in [("coulomb_friction", "motor"), ("viscous_damping", "load")] {
            assert!(!near(&rig, &term(kind, component), &refined), "{kind}");
        }
    }

    #[test]
    fn neighbours_are_confusable_and_touch() {
        let rig = rig();
        let are = |a: &Term, b: &Term| {
            let both = (
                confusable(a, b) && touch(&rig, a, b),
                confusable(b, a) && touch(&rig, b, a),
            );
            assert_eq!(both.0, both.1);
            both.0
        };
        let friction = term("direction_dependent_friction", "load");
        assert!(are(&friction, &term("viscous_damping", "load")));
        assert!(!are(&friction, &term("viscous_damping", "motor")));
        assert!(!are(&friction, &term("end_stop", "load")));
        let creep = term("viscoelastic_creep", "shaft");
        assert!(are(&creep, &term("viscous_damping", "load")));
        assert!(are(&creep, &term("viscous_damping", "motor")));
    }
}
