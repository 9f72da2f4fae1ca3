//! A diagnosis of recordings whose sensor has a zero of its own in each.

use super::*;
use sinew_sim::effects::Kind;

/// A shipped recording whose positions read this much more.
fn shifted(name: &str, zero: f64) -> Recording {
    let read = Recording::read(shipped(name)).expect("the recording ships with the project");
    let columns = ["u_N", "q_m"].map(|column| {
        let values = read.column(column).expect("the recording has the column");
        let more = if column == "q_m" { zero } else { 0.0 };
        Column {
            name: column.into(),
            values: values.iter().map(|value| value + more).collect(),
        }
    });
    Recording::new(
        name.trim_start_matches('.'),
        read.t().to_vec(),
        columns.into(),
    )
    .expect("the text is a recording")
}

#[test]
fn a_friction_is_named_beside_zeros_that_differ_by_recording() {
    let text = rig().to_toml().to_owned();
    let zero = "offset = { value = 0.0, per = \"recording\" }\nsignal = \"q_m\"";
    let text = text.replace("signal = \"q_m\"", zero);
    let rig = Rig::parse(&text, "zeros.toml").expect("the rig is sound");
    let recordings = Recordings {
        fit: vec![shifted(".fit.csv", 0.004)],
        check: vec![shifted(".test.csv", -0.006)],
        test: vec![shifted(".test.csv", 0.002)],
    };
    let found = diagnose(
        &rig,
        &recordings,
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    )
    .expect("the rig can be diagnosed");
    assert_eq!(found.verdict, Verdict::MissingPhysics, "{}", found.sentence);
    let kinds: Vec<&str> = found.effects.iter().map(|e| e.kind.as_str()).collect();
    assert_eq!(kinds, ["coulomb_friction"]);
    // tests/foreign/mass_spring_damper.truth.json
    let level = &found.effects[0].parameters["level"];
    assert!((level.value / 0.58 - 1.0).abs() < 0.02, "{level:?}");
    let sensor = &rig.sensors[0].name;
    let own = &found.parameters[&format!("{sensor}.offset")].recordings;
    let values: Vec<f64> = own.iter().map(|own| own.value).collect();
    for (value, truth) in values.iter().zip([0.004, -0.006, 0.002]) {
        assert!((value - truth).abs() < 2e-4, "{values:?}");
    }
    assert_eq!(values.len(), 3);
    assert!(found.mended.to_toml().contains("per = \"recording\""));
    let json = crate::diagnose::output::json(&found).expect("the folder is writable");
    assert!(json.contains("\"recordings\": ["), "{json}");
}

/// The same recordings under a rig that knows nothing of zeros.
#[test]
fn zeros_that_differ_by_recording_are_noted_with_the_key_to_write() {
    let recordings = Recordings {
        fit: vec![shifted(".fit.csv", 0.004), shifted(".fit.csv", -0.012)],
        check: vec![shifted(".test.csv", -0.016), shifted(".test.csv", 0.012)],
        test: Vec::new(),
    };
    let options = DiagnoseOptions {
        effects: vec![Kind::Coulomb],
        ..DiagnoseOptions::default()
    };
    let found =
        diagnose(&rig(), &recordings, &options, &|_, _, _| {}).expect("the rig can be diagnosed");
    let notes = &found.notes;
    let note = notes
        .iter()
        .find(|note| note.contains("differ by a constant at encoder"));
    let key = "`offset = { value = 0.0, per = \"recording\" }`";
    assert!(note.is_some_and(|note| note.contains(key)), "{notes:?}");
}
