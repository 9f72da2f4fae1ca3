//! Components that are alike are fitted as one before each has its own numbers.

use super::compiled;
use super::finger::{Finger, RUBS, subset};
use crate::diagnose::search::halving::tied;
use crate::diagnose::search::start::begin;
use crate::diagnose::term::term;

#[test]
fn what_is_alike_is_fitted_as_one_before_each_has_its_own_number() {
    let finger = Finger::rubbing([0.17, 0.22]);
    let case = finger.case(200);
    let subset = subset(&case);
    let values = compiled(case.written).values();
    let parent = subset
        .first(case.written, &values, 15)
        .expect("the rig is sound");
    let parent = parent.expect("the rig can be simulated");
    let begin = |at: &[&str], level: f64| {
        let begun = begin(
            &subset,
            &parent,
            &term(case.written, RUBS, at),
            &vec![level; at.len()],
        );
        begun.expect("the component bears this effect")
    };

    let starts = [0.001, 0.1].map(|level| begin(&["east", "west"], level));
    let mut ends = tied(&subset, starts.into());
    assert_eq!(ends.len(), 1);
    let end = ends.remove(0);
    let plant = end.model.plant.clone();
    let of = |values: &[f64], tendon: &str| {
        let name = format!("{tendon}.{RUBS}.coefficient");
        values[plant.slot(&name).expect("the plant has this parameter")]
    };
    let [east, west] = ["east", "west"].map(|tendon| of(&end.from.values, tendon));
    assert_eq!(east, west);
    assert!(0.17 < east && east < 0.22, "{east}");
    let trial = subset.improved(end.terms, end.model, end.from, 10);
    let own = trial.expect("the rig can be simulated").point.values;
    assert!((of(&own, "east") / 0.17 - 1.0).abs() < 0.1);
    assert!((of(&own, "west") / 0.22 - 1.0).abs() < 0.1);

    let starts = [0.001, 0.1].map(|level| begin(&["west"], level));
    let values = starts.each_ref().map(|begun| begun.from.values.clone());
    let same = tied(&subset, starts.into());
    assert!(same.iter().map(|begun| &begun.from.values).eq(&values));
}
