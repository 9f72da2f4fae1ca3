//! Effects of all components that are alike, as of one: judged on recordings by closed formulas
//! (`tests/foreign`).

use crate::diagnose::finding::{Diagnosis, FoundEffect, Verdict};
use crate::diagnose::{DiagnoseOptions, Recordings, diagnose};
use sinew_sim::Rig;

use super::recorded;
use crate::recording::Recording;

/// A file of `tests/foreign/finger`, whose two tendons rub in their guides, or of `foam`, which
/// creeps along three axes.
pub fn foreign(name: &str) -> String {
    format!("{}/../../tests/foreign/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// Answer to the first rows of a folder's recordings.
fn found(folder: &str, rows: usize) -> Diagnosis {
    let read = |name: &str| {
        let recording = Recording::read(foreign(&format!("{folder}/{name}")));
        let recording = recording.expect("the file is committed");
        recording.rows(0..rows).expect("the recording is longer")
    };
    let recordings = Recordings {
        fit: vec![read("fit.csv")],
        check: vec![read("check.csv")],
        test: Vec::new(),
    };
    let own = Rig::load(foreign(&format!("{folder}/believed.toml")));
    let own = own.expect("the file is committed");
    let found = diagnose(
        &own,
        &recordings,
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    );
    found.expect("the rig can be diagnosed")
}

/// Components and a parameter of the effects, which are all of one kind.
fn named<'a>(found: &'a Diagnosis, kind: &str, parameter: &str) -> Vec<(&'a str, f64)> {
    let value = |effect: &'a FoundEffect| {
        assert_eq!(effect.kind, kind, "{}", found.sentence);
        (
            effect.component.as_str(),
            effect.parameters[parameter].value,
        )
    };
    let mut named: Vec<_> = found.effects.iter().map(value).collect();
    named.sort_by_key(|(component, _)| *component);
    named
}

/// Each component with its truth, within a part of it.
fn agree(named: &[(&str, f64)], truth: &[(&str, f64)], within: f64) {
    assert_eq!(named.len(), truth.len(), "{named:?}");
    for ((name, found), (component, truth)) in named.iter().zip(truth) {
        assert_eq!(name, component);
        assert!((found / truth - 1.0).abs() < within, "{component}: {found}");
    }
}

#[test]
fn tendons_that_rub_as_closed_formulas_say_are_both_named() {
    let found = found("finger", 80);
    let named = named(&found, "load_dependent_friction", "coefficient");
    // tests/foreign/finger/truth.json
    agree(&named, &[("east", 0.17), ("west", 0.22)], 0.05);
}

#[test]
fn foam_that_creeps_along_all_its_axes_is_named_along_each() {
    let found = found("foam", 300);
    assert_eq!(found.verdict, Verdict::MissingPhysics);
    // tests/foreign/foam/truth.json
    let axes = ["column_pitch", "column_rise", "column_roll"];
    let truth = |of: [f64; 3]| -> Vec<_> { axes.into_iter().zip(of).collect() };
    let stiffness = named(&found, "viscoelastic_creep", "stiffness");
    agree(&stiffness, &truth([0.007, 30.0, 0.006]), 0.03);
    let times = named(&found, "viscoelastic_creep", "time_constant");
    agree(&times, &truth([0.20, 0.25, 0.30]), 0.03);
    assert!(found.effects[0].confidence > 0.8);
}

#[test]
fn one_tendon_of_two_that_rubs_is_named_alone() {
    let own = Rig::load(foreign("finger/believed.toml")).expect("the rig is committed");
    let rubbing = "\n[[effect]]\nkind = \"load_dependent_friction\"\ncomponent = \"west\"\ncoefficient = 0.2\n";
    let real = Rig::parse(&format!("{}{rubbing}", own.to_toml()), "real.toml");
    let real = real.expect("the rig is sound");
    let answer = |seed| recorded([&own, &real], (2.0, 100.0), 1e-4, seed);
    let recordings = Recordings {
        fit: vec![answer(1)],
        check: vec![answer(2)],
        test: Vec::new(),
    };
    let found = diagnose(
        &own,
        &recordings,
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    );
    let found = found.expect("the rig can be diagnosed");
    let named = named(&found, "load_dependent_friction", "coefficient");
    agree(&named, &[("west", 0.2)], 0.05);
}
