//! A search that ends before its end.

use std::time::Duration;

use super::finger::case;
use super::judged::finals_of;
use super::moves::context;
use super::{compiled, recordings, rig};
use crate::diagnose::data::Data;
use crate::diagnose::pool::{Pool, Selection};
use crate::diagnose::search::simpler::add_simpler;
use crate::diagnose::term::{Term, term};
use crate::diagnose::{DiagnoseOptions, Stop, Verdict, diagnose};

#[test]
fn a_search_without_time_claims_nothing_and_says_why() {
    let options = DiagnoseOptions {
        time_limit: Some(Duration::ZERO),
        ..DiagnoseOptions::default()
    };
    let found = diagnose(&rig(), &recordings(), &options, &|_, _, _| {});
    let found = found.expect("the recordings can be diagnosed");
    assert_eq!(found.verdict, Verdict::Unexplained);
    assert!(
        found
            .sentence
            .starts_with("The search was stopped before it had fitted any effect"),
        "{}",
        found.sentence
    );
    assert!(found.effects.is_empty() && found.candidates.is_empty());
    let note = |note: &String| note.contains("not tried, or in part: single, ");
    assert!(found.notes.iter().any(note), "{:?}", found.notes);
}

#[test]
fn a_search_that_is_stopped_answers_with_the_best_so_far_and_is_less_sure() {
    let stop = Stop::default();
    let options = DiagnoseOptions {
        stop: stop.clone(),
        ..DiagnoseOptions::default()
    };
    let whole = diagnose(
        &rig(),
        &recordings(),
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    );
    let whole = whole.expect("the recordings can be diagnosed");
    let found = diagnose(&rig(), &recordings(), &options, &|what, _, _| {
        if what == "one effect: fitted to everything" {
            stop.ask();
        }
    });
    let found = found.expect("the recordings can be diagnosed");
    assert_eq!(
        found.effects[0].kind, "coulomb_friction",
        "{}",
        found.sentence
    );
    assert!(found.effects[0].confidence < whole.effects[0].confidence);
    let note = |note: &String| note.starts_with("less sure: the search was stopped");
    assert!(found.notes.iter().any(note), "{:?}", found.notes);
}

/// The richer law alone was fitted when the time was over. Both of its levels are alike, and its
/// dampings are nothing.
#[test]
fn a_stopped_search_names_the_simple_law_that_a_richer_one_contains() {
    let (rig, recordings) = (rig(), recordings());
    let plant = compiled(&rig);
    let both = [recordings.fit.clone(), recordings.check.clone()].concat();
    let [fit, check, both] = [recordings.fit, recordings.check, both]
        .map(|them| Data::new(&rig, &plant, &them).expect("the recordings have all columns"));
    let case = case(&rig, [&fit, &check, &both], vec![(0, 0..fit.rows())]);
    let start = [0.5, 0.5, 0.01, 0.01];
    let (baseline, richer) = finals_of(&case, "direction_dependent_friction", &["mass"], &start);
    let mut pool = Pool::new(baseline);
    pool.candidates.push(richer);
    pool.choose(&case, Selection::Best).expect("a rig");
    assert_eq!(pool.chosen, Some(0), "it explains the recordings");
    let kinds = [
        "coulomb_friction",
        "direction_dependent_friction",
        "viscous_damping",
    ];
    let terms: Vec<Term> = kinds.map(|kind| term(case.written, kind, &["mass"])).into();
    let context = context(&case, terms);
    add_simpler(&context, &mut pool).expect("a rig");
    pool.conclude(&case);
    let best = pool.best().expect("something explains the recordings");
    assert_eq!(best.terms()[0].kind(), "coulomb_friction");
    assert_eq!(pool.candidates.len(), 2, "no other family is tried");
}
