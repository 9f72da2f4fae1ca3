//! How what is made alike is judged: finals of a finger between two tendons, put together by hand.

use std::slice::from_ref;

use super::super::evidence::Contender;
use super::super::model::Model;
use super::super::search::Bench;
use super::compiled;
use super::finger::{Finger, RUBS, effect, suspect, track};

/// The believed rig, and its final with a friction at each of these tendons that follows their load.
fn finals(bench: &Bench, tendons: &[&str]) -> (Contender, Contender) {
    let begun = vec![0.1; tendons.len()];
    finals_of(bench, RUBS, tendons, &begun)
}

/// The believed rig, and its final with an effect at each of these components that begins like this.
fn finals_of(bench: &Bench, kind: &str, at: &[&str], start: &[f64]) -> (Contender, Contender) {
    let suspect = suspect(kind, at);
    let track = track(bench);
    let values = compiled(bench.written).values();
    let parent = track.first(bench.written, &values, 15).expect("a rig");
    let parent = parent.expect("it can be simulated");
    let begun = track.begin(&parent, &suspect, start);
    let begun = begun.expect("it can sit there");
    let tried = track.improved(begun.suspects, begun.model, begun.from, 10);
    let tried = tried.expect("it can be simulated");
    let base = bench.base(&parent).expect("a rig").expect("it is finite");
    let last = bench.contender(&track, &tried, 12).expect("a rig");
    (base, last.expect("it is finite"))
}

/// Where its plant has the friction's coefficient.
fn slot(of: &Contender, tendon: &str) -> usize {
    let name = format!("{tendon}.load_dependent_friction.coefficient");
    of.tried.model.plant.slot(&name).expect("it is there")
}

/// As if the rows that it was fitted to had said a quarter too little.
fn a_quarter_off(bench: &Bench, last: &Contender) -> Contender {
    let mut values = last.tried.point.values.clone();
    for tendon in ["east", "west"] {
        values[slot(last, tendon)] *= 0.75;
    }
    let off = bench.with_values(&last.tried, values).expect("a rig");
    off.expect("it is finite")
}

#[test]
fn what_a_few_rows_say_of_what_is_alike_is_judged_by_all_rows() {
    let finger = Finger::rubbing([0.17, 0.22]);
    let bench = finger.bench(100);
    let (base, last) = finals(&bench, &["east", "west"]);
    let few = a_quarter_off(&bench, &last);
    assert!(bench.leaves_something(&few));
    let mut finalists = vec![few.clone()];
    let chosen = bench.choose(&mut finalists, |all| bench.best(&base, all));
    assert_eq!(chosen.expect("a rig"), Some(0));
    let all = &finalists[0];
    assert!(all.all_rows && !bench.leaves_something(all));
    for (tendon, truth) in [("east", 0.17), ("west", 0.22)] {
        let found = all.tried.point.values[slot(all, tendon)];
        assert!((found / truth - 1.0).abs() < 0.03, "{tendon}: {found}");
    }
}

#[test]
fn many_numbers_that_bend_the_rig_and_leave_something_are_not_believed() {
    let finger = Finger::rubbing([0.17, 0.22]);
    let bench = finger.bench(200);
    let (base, group) = finals(&bench, &["east", "west"]);
    assert_eq!(bench.best(&base, from_ref(&group)), Some(0));
    // As if its owner had written a sixth of the stiffness.
    let soft = finger
        .believed
        .with_values(&[("spine.stiffness", 0.4 / 6.0)]);
    let soft = soft.expect("a rig file can hold it");
    let bent = |group: &Contender| {
        let mut bent = group.clone();
        let (rig, trial) = (&group.tried.model.rig, group.tried.suspects[0].trial());
        let model = Model::new(rig, &soft, &trial, bench.settings);
        bent.tried.model = model.expect("it is sound");
        assert!(bent.tried.bent());
        bent
    };
    let leaves = |group: &Contender| {
        let mut leaves = group.clone();
        for residual in leaves.check.series.iter_mut().flatten().flatten() {
            *residual += 0.5 * bench.check.noise[0];
        }
        leaves
    };
    assert_eq!(bench.best(&base, &[bent(&group)]), Some(0));
    assert_eq!(bench.best(&base, &[leaves(&group)]), Some(0));
    assert_eq!(bench.best(&base, &[leaves(&bent(&group))]), None);
}

#[test]
fn of_one_tendon_and_all_of_them_the_one_is_named_where_it_is_as_good() {
    let finger = Finger::rubbing([0.0, 0.2]);
    let bench = finger.bench(200);
    let (base, all) = finals(&bench, &["east", "west"]);
    assert!(!bench.has_size(&all).expect("a rig"));
    let (_, right) = finals(&bench, &["west"]);
    let (_, wrong) = finals(&bench, &["east"]);
    assert_eq!(bench.simplest(&base, 0, &[all.clone(), right]), 1);
    assert_eq!(bench.simplest(&base, 0, &[all, wrong]), 0);
}

#[test]
fn what_leaves_nothing_or_saw_all_rows_is_not_fitted_again() {
    let finger = Finger::rubbing([0.17, 0.22]);
    let part = finger.bench(100);
    let (_, last) = finals(&part, &["east", "west"]);
    let mut finalists = [last.clone()];
    let chosen = part.choose(&mut finalists, |_| Some(0));
    assert_eq!(chosen.expect("a rig"), Some(0));
    assert!(!finalists[0].all_rows);
    let whole = finger.bench(finger.fit.rows());
    let mut finalists = [a_quarter_off(&whole, &last)];
    assert!(whole.leaves_something(&finalists[0]));
    let chosen = whole.choose(&mut finalists, |_| Some(0));
    assert_eq!(chosen.expect("a rig"), Some(0));
    assert!(!finalists[0].all_rows);
}

#[test]
fn what_two_winches_of_one_joint_have_together_is_there_though_neither_is_known() {
    let winches = ["pull", "pay_out"];
    let zones = winches.map(|winch| effect("input_dead_zone", winch, "width = 0.02"));
    let finger = Finger::with(&zones.concat());
    let bench = finger.bench(200);
    let (_, both) = finals_of(&bench, "input_dead_zone", &winches, &[0.015, 0.015]);
    assert!(!bench.leaves_something(&both));
    assert!(bench.has_size(&both).expect("a rig"));
}
