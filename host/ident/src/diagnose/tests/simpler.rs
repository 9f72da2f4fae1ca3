//! Of laws that say the same, the simplest is named.

use crate::diagnose::{DiagnoseOptions, Diagnosis, Recordings, Verdict, diagnose};
use crate::noise::gaussian;
use crate::recording::{Column, Recording};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_sim::Rig;

fn named(found: &Diagnosis) -> Vec<&str> {
    found.effects.iter().map(|e| e.kind.as_str()).collect()
}

fn shipped(name: &str) -> String {
    format!("{}/../../rigs/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// Its recordings were written with a dry friction of 23 N. Around a reversal the velocity that is
/// smoothed out of the motion is wrong, and a Stribeck law with a peak there leaves a little less.
#[test]
fn a_damper_stand_has_dry_friction_and_no_peak_of_it_that_nothing_shows() {
    let rig = Rig::load(shipped("damper-stand.toml")).expect("the rig ships with the project");
    let read = |name| Recording::read(shipped(name)).expect("the recording ships with the project");
    for check in [vec![], vec![read("damper-stand.test.csv")]] {
        let recordings = Recordings {
            fit: vec![read("damper-stand.fit.csv")],
            check,
            test: vec![],
        };
        let found = diagnose(
            &rig,
            &recordings,
            &DiagnoseOptions::default(),
            &|_, _, _| {},
        );
        let found = found.expect("the rig can be diagnosed");
        assert_eq!(named(&found), ["coulomb_friction"], "{}", found.sentence);
        assert!((found.effects[0].parameters["level"].value / 23.0 - 1.0).abs() < 0.03);
        assert!(found.effects[0].confidence > 0.9);
    }
}

const FALL: &str = r#"
format = "sinew-rig/1"
name = "fall"

[[body]]
name = "ball"
motion = "slide"
inertia = 1.0

[[gravity]]
name = "weight"
body = "ball"
amplitude = 9.81

[[sensor]]
name = "camera"
reads = "ball.position"
signal = "height_m"
"#;

/// A fall of 3 s from rest with a drag of `rate` times the speed, in closed form, at 30 Hz.
fn fall(rate: f64, seed: u64) -> Recording {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let t: Vec<f64> = (0..90).map(|k| f64::from(k) / 30.0).collect();
    let height = |t: &f64| {
        let fallen = 9.81 / rate * (t - (1.0 - (-rate * t).exp()) / rate);
        47.0 - fallen + 0.03 * gaussian(&mut random)
    };
    let values = t.iter().map(height).collect();
    let name = "height_m".into();
    Recording::new("fall.csv", t.clone(), vec![Column { name, values }])
        .expect("the text is a recording")
}

/// A load, another weight or a bent camera would be one motion with it.
#[test]
fn a_fall_has_drag_and_nothing_that_needs_a_way_back_to_be_told_from_it() {
    let rig = Rig::parse(FALL, "fall.toml").expect("the text is a rig");
    let recordings = Recordings {
        fit: vec![fall(0.2, 1)],
        check: vec![fall(0.2, 2)],
        test: vec![],
    };
    let found = diagnose(
        &rig,
        &recordings,
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    );
    let found = found.expect("the rig can be diagnosed");
    assert_eq!(found.verdict, Verdict::MissingPhysics, "{}", found.sentence);
    assert_eq!(named(&found), ["viscous_damping"]);
    let damping = &found.effects[0].parameters["damping"];
    assert!((damping.value / 0.2 - 1.0).abs() < 0.05, "{damping:?}");
    assert!(found.candidates.iter().all(|one| {
        let alike = ["wrong_number", "constant_load", "friction", "sensor"];
        !alike.iter().any(|kind| one.name.contains(kind))
    }));
    let note = |note: &String| note.starts_with("less sure: nothing drives the device");
    assert!(found.notes.iter().any(note), "{:?}", found.notes);
    assert!(found.effects[0].confidence < 0.75);
}

/// Without drag, under another weight: what the rig cannot know is no sure drag.
#[test]
fn a_fall_under_another_weight_is_no_sure_drag() {
    let rig = Rig::parse(FALL, "fall.toml").expect("the text is a rig");
    let lighter = |seed| {
        let recording = fall(1e-6, seed);
        let [column] = recording.columns() else {
            panic!("it has one column");
        };
        let t = recording.t().to_vec();
        let slower = |(h, t): (&f64, &f64)| h + 0.5 * 1.3 * t * t;
        let values = column.values.iter().zip(&t).map(slower).collect();
        let column = Column {
            name: column.name.clone(),
            values,
        };
        Recording::new("light.csv", t, vec![column]).expect("the text is a recording")
    };
    let recordings = Recordings {
        fit: vec![lighter(3)],
        check: vec![lighter(4)],
        test: vec![],
    };
    let found = diagnose(
        &rig,
        &recordings,
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    );
    let found = found.expect("the rig can be diagnosed");
    let sure = found.effects.iter().any(|effect| effect.confidence > 0.75);
    assert!(!sure, "{}", found.sentence);
    let note = |note: &String| note.contains("another weight or load");
    assert!(found.notes.iter().any(note));
}
