//! Moves of the search on a pool of three.

use super::compiled;
use super::finger::{Finger, RUBS, subset};
use super::judged::finals_of;
use crate::diagnose::case::Case;
use crate::diagnose::pool::{Pool, Proposal, Selection};
use crate::diagnose::search::context::{Context, Move};
use crate::diagnose::search::moves::MOVES;
use crate::diagnose::term::{Term, term};

/// Both tendons rub; the pool knows either one alone and both as a group.
fn pool(case: &Case) -> Pool {
    let fitted = |at: &[&str]| finals_of(case, RUBS, at, &vec![0.1; at.len()]);
    let (baseline, group) = fitted(&["east", "west"]);
    let mut pool = Pool::new(baseline);
    pool.take(Proposal {
        candidates: vec![fitted(&["east"]).1, fitted(&["west"]).1, group],
        ..Proposal::default()
    });
    pool
}

pub fn context<'a>(case: &'a Case<'a>, terms: Vec<Term>) -> Context<'a> {
    let subset = subset(case);
    let start = subset.first(case.written, &compiled(case.written).values(), 15);
    let start = start.expect("a rig").expect("the rig can be simulated");
    Context {
        case,
        subset,
        start,
        rig: case.written,
        terms,
        refinements: Vec::new(),
    }
}

fn named(name: &str) -> &'static dyn Move {
    let mut moves = MOVES.iter();
    *moves
        .find(|step| step.name() == name)
        .expect("the move is listed")
}

/// The moves that apply, by name.
fn applying(context: &Context, pool: &Pool) -> Vec<&'static str> {
    let moves = MOVES.iter().filter(|step| step.applies(context, pool));
    moves.map(|step| step.name()).collect()
}

#[test]
fn moves_apply_where_the_pool_leaves_them_something_to_do() {
    let finger = Finger::rubbing([0.17, 0.22]);
    let case = finger.case(200);
    let context = context(&case, Vec::new());
    let mut pool = pool(&case);
    let few = ["from nominal", "short horizon", "pair"];
    assert_eq!(applying(&context, &pool), few);
    pool.choose(&case, Selection::Best).expect("a rig");
    assert_eq!(pool.chosen, Some(2), "the group explains the recordings");
    assert_eq!(applying(&context, &pool), ["swap", "restart"]);
    let pairs = Proposal {
        undivided: true,
        ..Proposal::default()
    };
    pool.take(pairs);
    assert!(applying(&context, &pool).contains(&"drop one"));
    pool.take(Proposal::default());
    assert!(!applying(&context, &pool).contains(&"drop one"));
    let mut names: Vec<&str> = MOVES.iter().map(|step| step.name()).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), MOVES.len());
}

#[test]
fn a_pool_keeps_each_set_of_terms_once_as_it_was_fitted_best() {
    let finger = Finger::rubbing([0.17, 0.22]);
    let case = finger.case(200);
    let mut pool = pool(&case);
    let cost = |pool: &Pool| pool.candidates[1].trial.point.cost;
    let known = cost(&pool);
    for (factor, wanted) in [(2.0, known), (0.5, 0.5 * known)] {
        let mut again = pool.candidates[1].clone();
        again.trial.point.cost = factor * known;
        pool.take(Proposal {
            candidates: vec![again],
            ..Proposal::default()
        });
        assert_eq!((pool.candidates.len(), cost(&pool)), (3, wanted));
    }
}

#[test]
fn a_swap_tries_what_is_confusable_and_not_what_the_pool_holds() {
    let finger = Finger::rubbing([0.17, 0.22]);
    let case = finger.case(200);
    let at = |kind: &str| term(case.written, kind, &["west"]);
    let context = context(&case, vec![at(RUBS), at("backlash")]);
    let mut pool = pool(&case);
    pool.chosen = Some(1);
    let swap = named("swap");
    assert_eq!(swap.selection(), Selection::BestBySize);
    let found = swap.propose(&context, &pool).expect("a rig");
    let found = found.expect("something is chosen").candidates;
    assert!(found.iter().all(|one| one.terms() != [at(RUBS)]));
}

#[test]
fn a_restart_refits_alternatives_and_never_the_best_itself() {
    let finger = Finger::rubbing([0.17, 0.22]);
    let case = finger.case(200);
    let context = context(&case, Vec::new());
    let mut pool = pool(&case);
    let restart = named("restart");
    assert!(restart.propose(&context, &pool).expect("a rig").is_none());
    pool.chosen = Some(2);
    let found = restart.propose(&context, &pool).expect("a rig");
    let found = found.expect("something is chosen").candidates;
    assert_eq!(found.len(), 2);
    let best = pool.best().expect("a candidate is chosen");
    assert!(found.iter().all(|one| !one.has_terms_of(best)));
}
