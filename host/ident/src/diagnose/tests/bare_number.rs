//! Bare numbers of a rig that are wrong.

use crate::diagnose::{Options, Recordings, Verdict, diagnose};
use crate::recording::Recording;
use sinew_sim::Rig;

/// A bare mass of 1.6 kg for 2.0 kg. The recordings are of another writer. With the other numbers
/// free, the drive's gain is as good a suspect.
#[test]
fn a_bare_number_that_is_wrong_is_suspected_and_no_refit_hides_it() {
    let folder = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/cases/24-wrong-bare-mass"
    );
    let read = |name: &str| Recording::read(format!("{folder}/{name}.csv")).expect("it is there");
    let recordings = Recordings {
        fit: vec![read("A")],
        check: vec![read("B")],
        test: Vec::new(),
    };
    let rig = Rig::load(format!("{folder}/mass.toml")).expect("it is a rig");
    let found = diagnose(&rig, &recordings, &Options::default(), &|_, _, _| {});
    let found = found.expect("it can be diagnosed");
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.sentence);
    assert!(
        found.sentence.contains("is suspected"),
        "{}",
        found.sentence
    );
}
