//! Whole diagnoses of the shipped recordings, which a program that shares no code with the simulator wrote.

use sinew_sim::Rig;

use super::{Diagnosis, Options, Recordings, Verdict, diagnose};
use crate::recording::Recording;

fn shipped(name: &str) -> String {
    format!(
        "{}/../rigs/mass-spring-damper{name}",
        env!("CARGO_MANIFEST_DIR")
    )
}

fn rig() -> Rig {
    Rig::load(shipped(".toml")).expect("the demo's rig ships with the project")
}

fn recordings() -> Recordings {
    let read = |name| Recording::read(shipped(name)).expect("it ships with the project");
    Recordings {
        fit: vec![read(".fit.csv")],
        check: vec![read(".test.csv")],
        test: Vec::new(),
    }
}

fn found(rig: &Rig) -> Diagnosis {
    diagnose(rig, &recordings(), &Options::default(), &|_, _, _| {}).expect("it can be diagnosed")
}

#[test]
fn the_demos_hidden_friction_is_named_and_mends_what_chose_nothing() {
    let found = found(&rig());
    assert_eq!(found.verdict, Verdict::MissingPhysics);
    assert_eq!(found.effects.len(), 1, "{}", found.sentence);
    let effect = &found.effects[0];
    assert_eq!(
        (effect.kind.as_str(), effect.component.as_str()),
        ("coulomb_friction", "mass")
    );
    assert!(effect.confidence > 0.8, "{}", effect.confidence);
    // tests/foreign/mass_spring_damper.truth.json
    let level = &effect.parameters["level"];
    assert!((level.value / 0.58 - 1.0).abs() < 0.01, "{level:?}");
    let check = found.fit["q_m"].check;
    assert!(check.before_rms > 20.0 * check.after_rms, "{check:?}");
    let location = found.location.expect("something is missing");
    assert_eq!(location.component, "mass");
    assert_eq!(location.follows, "sign of velocity");
    assert!(!location.intervals.is_empty());
    let sum: f64 = effect.rivals.iter().map(|rival| rival.confidence).sum();
    assert!(sum + effect.confidence <= 1.0);
}

#[test]
fn nothing_is_missing_from_the_mended_rig_and_no_effect_is_invented() {
    let mended = found(&rig()).mended;
    let again = found(&mended);
    assert_eq!(again.verdict, Verdict::Consistent, "{}", again.sentence);
    assert!(again.effects.is_empty() && again.location.is_none());
    let check = again.fit["q_m"].check;
    assert_eq!(check.before_rms, check.after_rms);
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let text = |mut diagnosis: Diagnosis| {
        diagnosis.seconds = 0.0;
        serde_json::to_string(&diagnosis).expect("it can be written")
    };
    assert_eq!(text(found(&rig())), text(found(&rig())));
}
