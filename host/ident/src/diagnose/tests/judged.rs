//! Judgement of what is made alike: full refits of a finger between two tendons, put together by
//! hand.

use crate::diagnose::acceptance::{best_acceptable, is_determined, leaves_something, simplest};
use crate::diagnose::baseline::fit_baseline;
use crate::diagnose::candidate::Candidate;
use crate::diagnose::case::Case;
use crate::diagnose::model::Model;
use crate::diagnose::search::all_rows::select;
use crate::diagnose::search::refit::{refit, with_values};
use crate::diagnose::search::start::begin;
use crate::diagnose::term::term;
use std::slice::from_ref;

use super::compiled;
use super::finger::{Finger, RUBS, effect, subset};

/// The baseline rig, and its final with a friction at each of these tendons that follows their
/// load.
pub fn finals(case: &Case, tendons: &[&str]) -> (Candidate, Candidate) {
    let begun = vec![0.1; tendons.len()];
    finals_of(case, RUBS, tendons, &begun)
}

/// The baseline rig, and its final with an effect at each of these components that begins like
/// this.
pub fn finals_of(case: &Case, kind: &str, at: &[&str], start: &[f64]) -> (Candidate, Candidate) {
    let term = term(case.written, kind, at);
    let subset = subset(case);
    let values = compiled(case.written).values();
    let parent = subset
        .first(case.written, &values, 15)
        .expect("the rig is sound");
    let parent = parent.expect("the rig can be simulated");
    let begun = begin(&subset, &parent, &term, start);
    let begun = begun.expect("the component bears this effect");
    let trial = subset.improved(begun.terms, begun.model, begun.from, 10);
    let trial = trial.expect("the rig can be simulated");
    let base = fit_baseline(case, &parent)
        .expect("the rig is sound")
        .expect("the fit stays finite");
    let last = refit(case, &subset, &trial, 12).expect("the rig is sound");
    (base, last.expect("the fit stays finite"))
}

/// Place at which its plant has the friction's coefficient.
fn slot(of: &Candidate, tendon: &str) -> usize {
    let name = format!("{tendon}.load_dependent_friction.coefficient");
    of.trial
        .model
        .plant
        .slot(&name)
        .expect("the plant has this parameter")
}

/// As if the rows that it was fitted to had said a quarter too little.
fn a_quarter_off(case: &Case, last: &Candidate) -> Candidate {
    let mut values = last.trial.point.values.clone();
    for tendon in ["east", "west"] {
        values[slot(last, tendon)] *= 0.75;
    }
    let off = with_values(case, &last.trial, values).expect("the rig is sound");
    off.expect("the fit stays finite")
}

#[test]
fn what_a_few_rows_say_of_what_is_alike_is_judged_by_all_rows() {
    let finger = Finger::rubbing([0.17, 0.22]);
    let case = finger.case(100);
    let (base, last) = finals(&case, &["east", "west"]);
    let few = a_quarter_off(&case, &last);
    assert!(leaves_something(&case, &few));
    let mut finalists = vec![few.clone()];
    let chosen = select(&case, &mut finalists, |all| {
        best_acceptable(&case, &base, all)
    });
    assert_eq!(chosen.expect("the rig is sound"), Some(0));
    let all = &finalists[0];
    assert!(all.all_rows && !leaves_something(&case, all));
    for (tendon, truth) in [("east", 0.17), ("west", 0.22)] {
        let found = all.trial.point.values[slot(all, tendon)];
        assert!((found / truth - 1.0).abs() < 0.03, "{tendon}: {found}");
    }
}

#[test]
fn many_numbers_that_bend_the_rig_and_leave_something_are_not_believed() {
    let finger = Finger::rubbing([0.17, 0.22]);
    let case = finger.case(200);
    let (base, group) = finals(&case, &["east", "west"]);
    assert_eq!(best_acceptable(&case, &base, from_ref(&group)), Some(0));
    // As if its owner had written a sixth of the stiffness.
    let soft = finger.own.with_values(&[("spine.stiffness", 0.4 / 6.0)]);
    let soft = soft.expect("a rig file can hold it");
    let implausible = |group: &Candidate| {
        let mut implausible = group.clone();
        let (rig, terms) = (&group.trial.model.rig, &group.trial.terms);
        let model = Model::new(rig, &soft, terms, case.settings);
        implausible.trial.model = model.expect("the rig is sound");
        assert!(implausible.trial.implausible());
        implausible
    };
    let leaves = |group: &Candidate| {
        let mut leaves = group.clone();
        for residual in leaves.check.series.iter_mut().flatten().flatten() {
            *residual += 0.5 * case.check.noise[0];
        }
        leaves
    };
    assert_eq!(
        best_acceptable(&case, &base, &[implausible(&group)]),
        Some(0)
    );
    assert_eq!(best_acceptable(&case, &base, &[leaves(&group)]), Some(0));
    assert_eq!(
        best_acceptable(&case, &base, &[leaves(&implausible(&group))]),
        None
    );
}

#[test]
fn of_one_tendon_and_all_of_them_the_one_is_named_where_it_is_as_good() {
    let finger = Finger::rubbing([0.0, 0.2]);
    let case = finger.case(200);
    let (base, all) = finals(&case, &["east", "west"]);
    assert!(!is_determined(&case, &all).expect("the rig is sound"));
    let (_, right) = finals(&case, &["west"]);
    let (_, wrong) = finals(&case, &["east"]);
    assert_eq!(simplest(&case, &base, 0, &[all.clone(), right]), 1);
    assert_eq!(simplest(&case, &base, 0, &[all, wrong]), 0);
}

#[test]
fn what_leaves_nothing_or_saw_all_rows_is_not_fitted_again() {
    let finger = Finger::rubbing([0.17, 0.22]);
    let part = finger.case(100);
    let (_, last) = finals(&part, &["east", "west"]);
    let mut finalists = [last.clone()];
    let chosen = select(&part, &mut finalists, |_| Some(0));
    assert_eq!(chosen.expect("the rig is sound"), Some(0));
    assert!(!finalists[0].all_rows);
    let whole = finger.case(finger.fit.rows());
    let mut finalists = [a_quarter_off(&whole, &last)];
    assert!(leaves_something(&whole, &finalists[0]));
    let chosen = select(&whole, &mut finalists, |_| Some(0));
    assert_eq!(chosen.expect("the rig is sound"), Some(0));
    assert!(!finalists[0].all_rows);
}

#[test]
fn what_two_winches_of_one_joint_have_together_is_there_though_neither_is_known() {
    let winches = ["pull", "pay_out"];
    let zones = winches.map(|winch| effect("input_dead_zone", winch, "width = 0.02"));
    let finger = Finger::with(&zones.concat());
    let case = finger.case(200);
    let (_, both) = finals_of(&case, "input_dead_zone", &winches, &[0.015, 0.015]);
    assert!(!leaves_something(&case, &both));
    assert!(is_determined(&case, &both).expect("the rig is sound"));
}
