//! Properties that hold for every rig and recording: over shipped rigs, and over rigs and
//! recordings with wrong numbers and faults.

use std::path::PathBuf;

use sinew_ident::diagnose::{Diagnosis, Recordings, Verdict};
use sinew_ident::fit::{FitOptions, fit};
use sinew_ident::recording::{Column, Recording};
use sinew_sim::Rig;

use crate::beside::diagnosed;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The stage of case 24 (2 kg, 50 N/m, 1.5 N s/m) as a rig with parts of its text replaced.
fn stage(replaced: &[(&str, &str)]) -> Rig {
    let file = folder().join("tests/cases/24-wrong-bare-mass/mass.toml");
    let text = std::fs::read_to_string(file).unwrap();
    let text = replaced.iter().fold(text, |text, (old, new)| {
        assert!(text.contains(old), "{old}");
        text.replace(old, new)
    });
    Rig::parse(&text, "stage.toml").unwrap()
}

/// The recordings of case 24 with another reading of the encoder: time (s), value and row.
fn recordings(reading: impl Fn(f64, f64, &[f64], usize) -> f64) -> Recordings {
    let read = |name: &str| {
        let file = folder().join("tests/cases/24-wrong-bare-mass").join(name);
        let recording = Recording::read(file).unwrap();
        let columns = recording.columns().iter().map(|column| {
            let mut values = column.values.clone();
            if column.name == "q_m" {
                for (row, t) in recording.t().iter().enumerate() {
                    values[row] = reading(*t, column.values[row], &column.values, row);
                }
            }
            Column {
                name: column.name.clone(),
                values,
            }
        });
        Recording::new(name, recording.t().to_vec(), columns.collect()).unwrap()
    };
    let (fit, check) = (read("A.csv"), read("B.csv"));
    let test = check.rows(0..check.len() / 2).unwrap();
    let test = Recording::new("C.csv", test.t().to_vec(), test.columns().to_vec()).unwrap();
    Recordings {
        fit: vec![fit],
        check: vec![check],
        test: vec![test],
    }
}

/// The recordings of a shipped rig.
fn shipped(name: &str) -> (Rig, Recordings) {
    let at = |end: &str| folder().join("../../rigs").join(format!("{name}.{end}"));
    let read = |role: &str| vec![Recording::read(at(&format!("{role}.csv"))).unwrap()];
    let recordings = Recordings {
        fit: read("fit"),
        check: Vec::new(),
        test: read("test"),
    };
    (Rig::load(at("toml")).unwrap(), recordings)
}

const MASS: (&str, &str) = ("inertia = 1.6", "inertia = { value = 1.6 }");

/// Two shipped rigs, and eight with a wrong number, a wrong bound or a fault.
fn altered() -> Vec<(&'static str, Rig, Recordings)> {
    let plain = || recordings(|_, q, _, _| q);
    let stiff = ("stiffness = { value = 40.0 }", "stiffness = 40.0");
    let damped = ("damping = { value = 1.0 }", "damping = 3.0");
    let bound = (
        "inertia = 1.6",
        "inertia = { value = 1.5, min = 0.1, max = 1.8 }",
    );
    let mut all = vec![
        ("wrong mass", stage(&[]), plain()),
        ("wrong stiffness", stage(&[MASS, stiff]), plain()),
        ("wrong mass and damping", stage(&[damped]), plain()),
        ("wrong bound", stage(&[bound]), plain()),
        ("offset", stage(&[MASS]), recordings(|_, q, _, _| q + 0.02)),
        (
            "late sensor",
            stage(&[MASS]),
            recordings(|_, _, q, row| q[row.saturating_sub(2)]),
        ),
        (
            "drift",
            stage(&[MASS]),
            recordings(|t, q, _, _| q + 2e-3 * t),
        ),
        (
            "curved sensor",
            stage(&[MASS]),
            recordings(|_, q, _, _| q + q * q),
        ),
    ];
    for name in ["mass-spring-damper", "damper-stand"] {
        let (rig, recordings) = shipped(name);
        all.push((name, rig, recordings));
    }
    all
}

/// Error of each recording, by signal and role: as JSON has it.
fn errors(found: &Diagnosis) -> Vec<(String, [f64; 2])> {
    let json = serde_json::to_value(found).unwrap();
    let mut all = Vec::new();
    for (signal, fit) in json["fit"].as_object().unwrap() {
        for role in ["fit", "check", "test"] {
            if fit[role].is_null() {
                continue;
            }
            let before = fit[role]["before_rms"].as_f64().unwrap();
            // Null where free runs mean nothing: then windows say whether it is worse.
            if let Some(after) = fit[role]["after_rms"].as_f64() {
                all.push((format!("{signal} {role}"), [before, after]));
            }
        }
    }
    all
}

#[test]
fn a_corrected_rig_is_nowhere_worse_and_a_mismatch_is_never_called_none() {
    let mut broken = Vec::new();
    for (name, rig, recordings) in altered() {
        let found = diagnosed(&rig, &recordings);
        for (at, [before, after]) in errors(&found) {
            let said = found.notes.iter();
            let mut said = said.filter(|note| note.contains("the corrected rig is worse"));
            if after > 1.001 * before && said.next().is_none() {
                broken.push(format!("{name}: {at} from {before} to {after}"));
            }
        }
        let json = serde_json::to_value(&found).unwrap();
        let explained = matches!(found.verdict, Verdict::Parameters | Verdict::Consistent);
        for (signal, fit) in json["fit"].as_object().unwrap() {
            let noise = fit["noise_rms"].as_f64().unwrap();
            let of = |role: &str| fit[role]["before_rms"].as_f64().unwrap();
            let above = of("fit").max(of("check")) / noise;
            if above > 1.5 && explained {
                let said = &found.sentence;
                broken.push(format!(
                    "{name}: {signal} {above} times the noise, but: {said}"
                ));
            }
            let [fit, check] = ["fit", "check"].map(|role| fit[role]["after_rms"].as_f64());
            let (Some(fit), Some(check)) = (fit, check) else {
                continue;
            };
            let said = found.notes.iter();
            let said = said
                .filter(|note| note.contains("times the error of the check"))
                .count();
            if fit > 5.5 * check && said == 0 {
                broken.push(format!(
                    "{name}: {signal} fit {fit}, check {check}, not said"
                ));
            }
        }
        // Each undetermined parameter is said to be where it is, and to have moved where it has.
        let notes = found.notes.join("\n");
        let list = |begin: &str| -> Vec<String> {
            let line = notes.lines().find_map(|line| line.strip_prefix(begin));
            let names = line.map(|line| line.split(", ").map(str::to_owned).collect());
            names.unwrap_or_default()
        };
        let left = list("not determined by these recordings, and left as the rig says: ");
        let plant = sinew_sim::Plant::new(&rig).unwrap();
        let refitted = sinew_sim::Plant::new(&found.refitted).unwrap();
        for said in &left {
            let value = |plant: &sinew_sim::Plant| plant.values()[plant.slot(said).unwrap()];
            if value(&plant) != value(&refitted) {
                broken.push(format!("{name}: {said} moved and is said to be left"));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// Rigs of which the recordings leave some numbers open: an idle second body, and more numbers than
/// ratios.
#[test]
fn undetermined_parameters_stay_to_the_digit_or_are_said_to_have_moved() {
    let idle = "[[body]]\nname = 'idle'\nmotion = 'slide'\ninertia = { value = 3.25 }\n\
                [[spring]]\nname = 'far'\nfrom = 'ground'\nto = 'idle'\n\
                stiffness = { value = 12.5 }\n[[actuator]]";
    let free_gain = ("gain = 1.0", "gain = { value = 1.0 }");
    let plain = |_: f64, q: f64, _: &[f64], _: usize| q;
    let cases = [
        (
            "idle body",
            stage(&[MASS, ("[[actuator]]", idle)]),
            recordings(plain),
        ),
        ("free gain", stage(&[MASS, free_gain]), recordings(plain)),
    ];
    for (name, rig, recordings) in cases {
        let found = fit(&rig, &recordings.fit, &FitOptions::default(), &mut |_| {}).unwrap();
        let open: Vec<_> = found
            .parameters
            .iter()
            .filter(|p| p.ci95.is_none())
            .collect();
        match name {
            "idle body" => {
                let stayed: Vec<f64> = open.iter().map(|p| p.value).collect();
                assert_eq!(stayed, [3.25, 12.5], "{:?}", found.parameters);
            }
            _ => assert!(!open.is_empty(), "{name}: {:?}", found.parameters),
        }
        // One of the parameters that bind each other stays.
        assert!(
            open.iter().any(|p| p.value == p.as_written),
            "{name}: {open:?}"
        );
        let text = found.rig.to_toml();
        for parameter in open.iter().filter(|p| p.value == p.as_written) {
            let digits = format!("value = {:?}", parameter.as_written);
            assert!(
                text.contains(&digits),
                "{name}: {} in\n{text}",
                parameter.name
            );
        }
    }
}

/// An error of a few times the noise is little beside the motion, and the intervals are narrow all
/// the same: with a mass of 1.6 kg in the place of 2 they exclude the true stiffness.
#[test]
fn a_fit_that_leaves_more_than_noise_says_so_and_a_sound_one_does_not() {
    let sound = recordings(|_, q, _, _| q);
    let warned = |rig: &Rig| {
        let found = fit(rig, &sound.fit, &FitOptions::default(), &mut |_| {}).unwrap();
        sinew_ident::report::warnings(&found)
    };
    assert_eq!(warned(&stage(&[MASS])), [""; 0]);
    let nearly = stage(&[("inertia = 1.6", "inertia = 1.99")]);
    let said = warned(&nearly);
    assert!(
        said.iter().any(|it| it.contains("times its noise")),
        "{said:?}"
    );
}
