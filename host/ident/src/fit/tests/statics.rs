//! Tables of rests: MuJoCo's (`tests/foreign/mujoco_rests.py`), closed forms, and refusals.

use super::*;
use crate::fit::{fit_rests, require_rests, rests};

fn foreign_table(name: &str) -> Recording {
    Recording::read_table(root().join("tests/foreign/rests").join(name)).unwrap()
}

/// The rig of a device of MuJoCo's, with these lines written otherwise.
fn foreign_rig(device: &str, changes: &[(&str, &str)]) -> Rig {
    let path = root().join(format!("tests/foreign/trajectories/{device}.toml"));
    let mut text = std::fs::read_to_string(path).unwrap();
    for (old, new) in changes {
        assert!(text.contains(old), "{device} lacks {old}");
        text = text.replacen(old, new, 1);
    }
    Rig::parse(&text, "believed.toml").unwrap()
}

fn fitted(rig: &Rig, tables: &[Recording]) -> Fit {
    fit_rests(rig, tables, &FitOptions::default(), &mut |_| {}).unwrap()
}

fn table(text: &str) -> Recording {
    Recording::parse_table(text.as_bytes(), "table.csv").unwrap()
}

/// Parameters, each with the value that MuJoCo was given, to a part of 10^-6; and errors at rests
/// that the fit never saw, of the size of the digits in the file.
fn judge(device: &str, changes: &[(&str, &str)], truth: &[(&str, f64)]) -> Fit {
    let rig = foreign_rig(device, changes);
    let fit = fitted(&rig, &[foreign_table(&format!("{device}.fit.csv"))]);
    for &(name, exact) in truth {
        let found = parameter(&fit, name);
        assert!(
            (found.as_written / exact - 1.0).abs() > 0.1,
            "{name} was known"
        );
        let [low, high] = found.ci95.unwrap_or_else(|| panic!("{name} is open"));
        assert!((found.value / exact - 1.0).abs() < 1e-6, "{found:?}");
        assert!(high - low < 1e-5 * exact, "{found:?}");
    }
    let unseen = [foreign_table(&format!("{device}.test.csv"))];
    let errors = |rig: &Rig| pool(&rests(rig, &unseen).unwrap());
    for (before, after) in errors(&rig).iter().zip(errors(&fit.rig)) {
        assert!(before.rms > 0.1 * before.spread, "{before:?}");
        assert!(after.rms < 1e-8 * after.spread, "{after:?}");
    }
    fit
}

#[test]
fn stiffnesses_and_pretension_are_those_of_mujoco() {
    let changes = [
        ("stiffness = 0.12", "stiffness = { value = 0.2 }"),
        ("stiffness = 0.06", "stiffness = { value = 0.04 }"),
        ("pretension = 1.0", "pretension = { value = 0.6 }"),
        ("inertia = 8e-05", "inertia = { value = 7e-05 }"),
        ("damping = 0.0012", "damping = { value = 0.003 }"),
    ];
    let truth = [
        ("root.stiffness", 0.12),
        ("joint.stiffness", 0.06),
        ("flexor.pretension", 1.0),
    ];
    let fit = judge("tendon_finger", &changes, &truth);
    // No rest depends on these.
    for (name, digits) in [("tip.inertia", "7e-05"), ("root_loss.damping", "0.003")] {
        let silent = parameter(&fit, name);
        assert_eq!((silent.ci95, silent.at_bound), (None, false), "{silent:?}");
        assert_eq!(silent.value, silent.as_written);
        let text = fit.rig.to_toml();
        assert!(text.contains(&format!("{{ value = {digits} }}")), "{text}");
    }
}

/// A pose of the finger is one tension: slope, intercept and quotient of the angles are three
/// numbers, too few for four parameters.
#[test]
fn parameters_that_poses_cannot_tell_apart_stay_open() {
    let changes = [
        ("stiffness = 0.12", "stiffness = { value = 0.2 }"),
        ("stiffness = 0.06", "stiffness = { value = 0.04 }"),
        ("stiffness = 0.05", "stiffness = { value = 0.03 }"),
        ("pretension = 1.0", "pretension = { value = 0.6 }"),
    ];
    let rig = foreign_rig("tendon_finger", &changes);
    let fit = fitted(&rig, &[foreign_table("tendon_finger.fit.csv")]);
    let root = parameter(&fit, "root.stiffness");
    assert_eq!(root.ci95, None, "{root:?}");
    let missed = fit.sensors.iter().map(|it| it.rms / it.spread);
    assert!(missed.fold(0.0, f64::max) < 1e-3, "{:?}", fit.sensors);
}

#[test]
fn the_shafts_of_a_drive_are_those_of_mujoco() {
    // The load carries nothing: the shaft stays straight, and no rest depends on it.
    let changes = [
        ("stiffness = 30.0", "stiffness = { value = 20.0 }"),
        ("stiffness = 3.0", "stiffness = { value = 5.0 }"),
    ];
    let fit = judge("two_mass_drive", &changes, &[("centring.stiffness", 3.0)]);
    let shaft = parameter(&fit, "shaft.stiffness");
    assert_eq!((shaft.value, shaft.ci95), (20.0, None));
}

#[test]
fn the_weight_of_a_pendulum_is_that_of_mujoco() {
    let changes = [("amplitude = ", "amplitude = { value = 2.5 } # ")];
    let weight = 0.8 * 9.81 * 0.25;
    judge("pendulum", &changes, &[("weight.amplitude", weight)]);
}

/// A line through loads: its slope, and the interval that textbooks give it (Student's t).
#[test]
fn a_noisy_line_has_the_interval_of_a_textbook() {
    let (mut covered, mut widths) = (0, 0.0);
    const TRIALS: u64 = 40;
    for seed in 1..=TRIALS {
        let mut random = Noise(seed);
        let rows: Vec<(f64, f64)> = (0..30)
            .map(|k| (f64::from(k) - 15.0, 1e-3 * random.normal()))
            .collect();
        let lines = rows.iter().map(|(u, e)| format!("{u},{}\n", u / 40.0 + e));
        let data = table(&format!("u_N,q_m\n{}", lines.collect::<String>()));
        let fit = fitted(&parse(&oscillator(1.0, 60.0, 1.0, "")), &[data]);
        let stiffness = parameter(&fit, "coil.stiffness");
        let [low, high] = stiffness.ci95.expect("30 loads determine it");
        covered += u64::from(low <= 40.0 && 40.0 <= high);
        // Of the slope 1 / k: s / sqrt(sum of u^2), t = 2.045.
        let squares: f64 = rows.iter().map(|(u, _)| u * u).sum();
        let exact = 2.0 * 2.045 * 40.0 * 40.0 * 1e-3 / squares.sqrt();
        widths += (high - low) / exact / TRIALS as f64;
    }
    assert!((0.85..1.35).contains(&widths), "{widths}");
    assert!(covered >= 34, "{covered} of {TRIALS}");
}

/// Four loads are few for three parameters; two of them no rest depends on.
#[test]
fn few_loads_determine_what_depends_on_them() {
    let data = table("u_N,q_m,t\n0,0,7\n1,0.025,7\n-2,-0.05,\n3,0.075,1\n");
    let fit = fitted(&parse(&oscillator(1.5, 60.0, 2.5, "")), &[data]);
    let stiffness = parameter(&fit, "coil.stiffness");
    assert!((stiffness.value / 40.0 - 1.0).abs() < 1e-6, "{stiffness:?}");
    assert!(stiffness.ci95.is_some());
    for (name, written) in [("mass.inertia", 1.5), ("dashpot.damping", 2.5)] {
        let silent = parameter(&fit, name);
        assert_eq!((silent.value, silent.ci95), (written, None), "{name}");
    }
}

/// Only their quotient moves the mass.
#[test]
fn a_gain_and_a_stiffness_together_stay_open() {
    let text = oscillator(1.0, 60.0, 1.0, "").replace("gain = 1.0", "gain = { value = 1.0 }");
    let data = table("u_N,q_m\n0,0\n1,0.025\n-2,-0.0501\n3,0.0749\n4,0.1\n5,0.125\n");
    let fit = fitted(&parse(&text), &[data]);
    let open = ["coil.stiffness", "push.gain"].map(|name| parameter(&fit, name).ci95);
    assert_eq!(open, [None, None]);
    let ratio = parameter(&fit, "coil.stiffness").value / parameter(&fit, "push.gain").value;
    assert!((ratio / 40.0 - 1.0).abs() < 0.01, "{ratio}");
}

#[test]
fn rows_without_one_rest_are_refused_with_their_line() {
    let refused = |text: &str, rows: &str| {
        let data = table(rows);
        let error = require_rests(&parse(text), [&data]).unwrap_err();
        let first = error.to_string();
        let fit = fit_rests(&parse(text), &[data], &FitOptions::default(), &mut |_| {});
        assert_eq!(first, fit.unwrap_err().to_string());
        first
    };
    let rows = "# loads\nu_N,q_m\n0,0\n1,0.1\n";
    let level = FRICTION.replace("value = 0.0", "value = 0.5");
    let dry = refused(&oscillator(1.0, 40.0, 1.0, &level), rows);
    assert!(
        dry.starts_with("table.csv:3:1: the rest here is not"),
        "{dry}"
    );
    assert!(dry.contains("`mass.coulomb_friction`"), "{dry}");
    let text = oscillator(1.0, 40.0, 1.0, "");
    let spring = text.find("[[spring]]").unwrap()..text.find("[[damper]]").unwrap();
    let mut free = text.clone();
    free.replace_range(spring, "");
    let drifts = refused(&free, "u_N,q_m\n0.5,0\n1,0.1\n");
    assert!(
        drifts.starts_with("table.csv:2:1: the rig as written has no rest here"),
        "{drifts}"
    );
    let gap = refused(&text, "u_N,q_m\n0,0\n,0.1\n");
    assert!(
        gap.starts_with("table.csv:3:1: `u_N` has no value here"),
        "{gap}"
    );
    let lacks = refused(&text, "q_m\n0\n0.1\n");
    assert!(lacks.contains("no column `u_N`"), "{lacks}");
    let own = text.replace(
        "signal = \"q_m\"",
        "signal = \"q_m\"\noffset = { value = 0.0, per = \"recording\" }",
    );
    let own = refused(&own, "u_N,q_m\n0,0\n1,0.1\n");
    assert!(
        own.contains("`encoder.offset` has a value of its own"),
        "{own}"
    );
    let still = table("u_N,q_m\n0,0.1\n1,0.1\n");
    let still = fit_rests(&parse(&text), &[still], &FitOptions::default(), &mut |_| {});
    assert!(
        still
            .unwrap_err()
            .to_string()
            .contains("no sensor ever changes")
    );
}
