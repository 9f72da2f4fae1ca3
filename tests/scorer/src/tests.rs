//! The scorer, on answers and truths written by hand.

use crate::{Answer, Outcome, Truth, calibration, score, table};

fn truth(category: &str, effects: &str) -> Truth {
    let strength = if effects.is_empty() {
        "null"
    } else {
        "\"strong\""
    };
    serde_json::from_str(&format!(
        r#"{{"category": "{category}", "rig": "r", "strength": {strength}, "noise": 0.01, "visible": [2.0],
            "effects": [{effects}], "parameters": {{}}, "true_model_test_rms": {{"q_m": 2.0}}}}"#
    ))
    .expect("a truth")
}

fn concealed(kind: &str, component: &str, family: &str, parameters: &str) -> String {
    format!(
        r#"{{"kind": "{kind}", "component": "{component}", "family": "{family}", "parameters": {{{parameters}}}, "same_as": []}}"#
    )
}

fn answer(effects: &[String]) -> Answer {
    let verdict = if effects.is_empty() {
        "parameters"
    } else {
        "missing_physics"
    };
    serde_json::from_str(&format!(
        r#"{{"verdict": "{verdict}", "effects": [{}], "seconds": 1.0,
            "fit": {{"q_m": {{"test": {{"after_rms": 2.1}}}}}}}}"#,
        effects.join(",")
    ))
    .expect("an answer")
}

fn named(kind: &str, component: &str, confidence: f64, parameters: &str, also: &str) -> String {
    format!(
        r#"{{"kind": "{kind}", "component": "{component}", "confidence": {confidence}, "parameters": {{{parameters}}},
            "indistinguishable_from": [{also}]}}"#
    )
}

fn coulomb() -> String {
    concealed("coulomb_friction", "mass", "friction", r#""level": 2.0"#)
}

fn outcome(effects: &[String], truth: &Truth) -> Outcome {
    score::outcome(Some(&answer(effects)), truth)
}

#[test]
fn only_the_kind_at_its_place_is_right() {
    let truth = truth("one", &coulomb());
    let say = |kind, component| outcome(&[named(kind, component, 0.9, "", "")], &truth);
    assert_eq!(say("coulomb_friction", "mass"), Outcome::Right);
    assert_eq!(say("coulomb_friction", "other"), Outcome::Family);
    assert_eq!(say("stribeck_friction", "mass"), Outcome::Family);
    assert_eq!(say("backlash", "mass"), Outcome::Wrong);
    assert_eq!(outcome(&[], &truth), Outcome::Missed);
    assert_eq!(score::outcome(None, &truth), Outcome::Failed);
}

#[test]
fn a_hedge_is_not_right_and_neither_is_what_is_not_told_apart() {
    let truth = truth("one", &coulomb());
    let first = named("coulomb_friction", "mass", 0.5, "", "");
    let second = named("stribeck_friction", "mass", 0.5, "", "");
    assert_eq!(outcome(&[first, second], &truth), Outcome::Hedged);
    let also = r#"{"kind": "coulomb_friction", "component": "mass", "confidence": 0.4}"#;
    let unsure = named("hysteresis", "spring", 0.5, "", also);
    assert_eq!(outcome(&[unsure], &truth), Outcome::NotToldApart);
}

#[test]
fn the_same_thing_by_another_name_is_right() {
    let load = r#"{"kind": "gravity_load", "component": "mass", "family": "load", "parameters": {"amplitude": 2.0},
        "same_as": [["constant_load", "mass"]]}"#;
    let truth = truth("one", load);
    assert_eq!(
        outcome(&[named("constant_load", "mass", 0.9, "", "")], &truth),
        Outcome::Right
    );
    assert_eq!(
        outcome(&[named("constant_load", "other", 0.9, "", "")], &truth),
        Outcome::Family
    );
}

#[test]
fn a_pair_of_bodies_has_no_order() {
    let truth = truth("one", &concealed("cross_coupling", "a+b", "stiffness", ""));
    assert_eq!(
        outcome(&[named("cross_coupling", "b+a", 0.9, "", "")], &truth),
        Outcome::Right
    );
}

#[test]
fn only_a_weak_effect_may_be_missed() {
    let missed = |strength: &str, effects: &[String]| {
        let mut truth = truth("one", &coulomb());
        truth.strength = Some(serde_json::from_str(strength).expect("a strength"));
        let answer = answer(effects);
        table::Scored {
            case: "case-00".into(),
            outcome: score::outcome(Some(&answer), &truth),
            truth,
            answer: Some(answer),
        }
    };
    assert!(missed("\"weak\"", &[]).allowed());
    assert!(!missed("\"strong\"", &[]).allowed());
    let wrong = [named("backlash", "mass", 0.9, "", "")];
    assert!(!missed("\"weak\"", &wrong).allowed());
}

#[test]
fn of_two_effects_both_are_wanted() {
    let both = format!(
        "{},{}",
        coulomb(),
        concealed("input_delay", "motor", "actuator", r#""delay": 0.01"#)
    );
    let truth = truth("two", &both);
    let friction = named("coulomb_friction", "mass", 0.9, "", "");
    let delay = named("input_delay", "motor", 0.9, "", "");
    let lag = named("actuator_lag", "motor", 0.9, "", "");
    let gap = named("backlash", "motor", 0.9, "", "");
    assert_eq!(
        outcome(&[delay.clone(), friction.clone()], &truth),
        Outcome::Right
    );
    assert_eq!(outcome(&[delay], &truth), Outcome::Missed);
    assert_eq!(outcome(&[friction.clone(), lag], &truth), Outcome::Family);
    assert_eq!(outcome(&[friction.clone(), gap], &truth), Outcome::Wrong);
    assert_eq!(
        outcome(&[friction.clone(), friction], &truth),
        Outcome::Wrong
    );
}

#[test]
fn nothing_may_be_named_where_nothing_is() {
    for category in ["exact", "wrong parameters", "disturbance", "noise"] {
        let truth = truth(category, "");
        assert_eq!(outcome(&[], &truth), Outcome::Right);
        assert_eq!(
            outcome(&[named("backlash", "motor", 0.1, "", "")], &truth),
            Outcome::FalseAlarm
        );
    }
}

#[test]
fn outside_the_vocabulary_only_a_sure_name_is_wrong() {
    let truth = truth("outside", &concealed("van_der_pol", "mass", "outside", ""));
    assert_eq!(
        outcome(&[named("backlash", "motor", 0.89, "", "")], &truth),
        Outcome::Right
    );
    assert_eq!(
        outcome(&[named("backlash", "motor", 0.9, "", "")], &truth),
        Outcome::Wrong
    );
}

#[test]
fn parameter_errors_leave_zeros_out_and_wrap_phases() {
    let parameters =
        r#""amplitude": 2.0, "wave_number": 5.0, "phase": 3.0, "side": 1.0, "level": 0.0"#;
    let truth = truth(
        "one",
        &concealed("position_ripple", "mass", "load", parameters),
    );
    // The same wave with the amplitude's sign turned and half a turn less, 2 % and 0.1 rad off.
    let value = |v: f64| format!(r#"{{"value": {v}}}"#);
    let found = format!(
        r#""amplitude": {}, "wave_number": {}, "phase": {}, "side": {}, "level": {}"#,
        value(-2.04),
        value(5.0),
        value(3.1 - std::f64::consts::PI),
        value(1.0),
        value(7.0)
    );
    let answer = answer(&[named("position_ripple", "mass", 0.9, &found, "")]);
    let concealed =
        score::meant(&answer.effects[0], &truth).expect("the answer is the concealed effect");
    let errors = score::parameter_errors(&answer.effects[0], concealed);
    let expected = [("amplitude", 0.02), ("phase", 0.1), ("wave_number", 0.0)];
    assert_eq!(errors.len(), expected.len(), "{errors:?}");
    for ((name, error), (wanted, size)) in errors.iter().zip(expected) {
        assert_eq!(name, wanted);
        assert!((error - size).abs() < 1e-9, "{name}: {error}");
    }
}

#[test]
fn free_run_errors_are_taken_over_those_of_the_true_model() {
    let ratio =
        score::free_run_ratio(&answer(&[]), &truth("one", &coulomb())).expect("both are known");
    assert!((ratio - 1.05).abs() < 1e-12, "{ratio}");
}

#[test]
fn every_failure_is_listed_and_confidence_is_held_against_truth() {
    let cases: Vec<table::Scored> = [("coulomb_friction", 0.95), ("backlash", 0.6)]
        .into_iter()
        .enumerate()
        .map(|(number, (kind, confidence))| {
            let truth = truth("one", &coulomb());
            let answer = answer(&[named(kind, "mass", confidence, "", "")]);
            table::Scored {
                case: format!("case-{number}"),
                outcome: score::outcome(Some(&answer), &truth),
                truth,
                answer: Some(answer),
            }
        })
        .collect();
    let page = table::page(&cases);
    assert!(page.contains("1 of 2, 50.0 %"), "{page}");
    assert!(
        page.contains("| case-1 | r | coulomb\\_friction at mass |"),
        "{page}"
    );
    assert!(!page.contains("| case-0 |"), "{page}");
    let bins = calibration::bins(&cases);
    assert_eq!(
        bins.iter()
            .map(|bin| (bin.stated, bin.right))
            .collect::<Vec<_>>(),
        [(0.6, 0.0), (0.95, 1.0)]
    );
}
