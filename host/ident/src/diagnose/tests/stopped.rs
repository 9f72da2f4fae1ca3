//! A search that ends before its end.

use std::time::Duration;

use super::{recordings, rig};
use crate::diagnose::{Options, Stop, Verdict, diagnose};

#[test]
fn a_search_without_time_claims_nothing_and_says_why() {
    let options = Options {
        time_limit: Some(Duration::ZERO),
        ..Options::default()
    };
    let found = diagnose(&rig(), &recordings(), &options, &|_, _, _| {});
    let found = found.expect("it can be diagnosed");
    assert_eq!(found.verdict, Verdict::Unexplained);
    assert!(
        found.sentence.contains("stopped before it ended"),
        "{}",
        found.sentence
    );
    let note = |note: &String| note.contains("not tried, or in part: single, ");
    assert!(
        found.details.notes.iter().any(note),
        "{:?}",
        found.details.notes
    );
}

#[test]
fn a_search_that_is_stopped_answers_with_the_best_so_far_and_is_less_sure() {
    let stop = Stop::default();
    let options = Options {
        stop: stop.clone(),
        ..Options::default()
    };
    let whole = diagnose(&rig(), &recordings(), &Options::default(), &|_, _, _| {});
    let whole = whole.expect("it can be diagnosed");
    let found = diagnose(&rig(), &recordings(), &options, &|what, _, _| {
        if what == "one effect: fitted to everything" {
            stop.ask();
        }
    });
    let found = found.expect("it can be diagnosed");
    assert_eq!(
        found.effects[0].kind, "coulomb_friction",
        "{}",
        found.sentence
    );
    assert!(found.effects[0].confidence < whole.effects[0].confidence);
    let note = |note: &String| note.starts_with("less sure: the search was stopped");
    assert!(
        found.details.notes.iter().any(note),
        "{:?}",
        found.details.notes
    );
}
