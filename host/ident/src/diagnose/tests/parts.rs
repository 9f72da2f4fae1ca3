//! Recordings of what nothing holds are judged in fewer and longer intervals where eight leave
//! nothing.

use crate::diagnose::acceptance::holds_over_whole_recordings;
use crate::diagnose::case::Case;
use crate::diagnose::corrected::falls;
use crate::diagnose::data::Data;
use crate::diagnose::finding::{Diagnosis, Verdict};
use crate::diagnose::split::Roles;
use crate::diagnose::{DiagnoseOptions, Recordings, diagnose};
use rand::SeedableRng;
use sinew_sim::Rig;

use super::finger::case;
use super::{compiled, finger, pushed};
use crate::noise::gaussian;
use crate::recording::Recording;

const CART: &str = r#"
format = "sinew-rig/1"
name = "cart"
[[body]]
name = "cart"
motion = "slide"
inertia = { value = 1.8 }
[[actuator]]
name = "motor"
drives = "cart"
input = "u_N"
gain = 1.0
[[sensor]]
name = "encoder"
reads = "cart.position"
signal = "q_m"
"#;

/// A cart of 2 kg under a load that nobody told, 20 s with noise of 1 mm: in small steps of
/// symplectic Euler.
fn recorded(load: f64, seed: u64) -> Recording {
    let parts = 16;
    let h = 0.01 / f64::from(parts);
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let (mut q, mut v) = (0.0, 0.0);
    let (mut inputs, mut seen) = (Vec::new(), Vec::new());
    for k in 0..2000 {
        let at = 0.012 * k as f64 + seed as f64;
        let u = at.sin() + 0.5 * (2.7 * at).cos();
        inputs.push(u);
        seen.push(q + 1e-3 * gaussian(&mut random));
        for _ in 0..parts {
            v += h * (u + load) / 2.0;
            q += h * v;
        }
    }
    pushed([inputs, seen])
}

fn judged(load: f64) -> Diagnosis {
    let rig = Rig::parse(CART, "cart.toml").expect("the text is a rig");
    let recordings = Recordings {
        fit: vec![recorded(load, 1)],
        check: vec![recorded(load, 2)],
        test: Vec::new(),
    };
    let found = diagnose(
        &rig,
        &recordings,
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    );
    found.expect("the rig can be diagnosed")
}

/// Less than a tenth of the noise in each of eight intervals, six times the noise over the whole.
#[test]
fn a_load_that_no_short_stretch_shows_is_named() {
    let found = judged(8e-4);
    assert_eq!(found.verdict, Verdict::MissingPhysics, "{}", found.sentence);
    let effect = &found.effects[0];
    assert_eq!(
        (effect.kind.as_str(), effect.component.as_str()),
        ("constant_load", "cart")
    );
    let level = &effect.parameters["level"];
    assert!((level.value / 8e-4 - 1.0).abs() < 0.05, "{level:?}");
}

#[test]
fn without_it_nothing_is_missing_over_the_whole_either() {
    let found = judged(0.0);
    assert_eq!(found.verdict, Verdict::Parameters, "{}", found.sentence);
}

/// A two-mass drive that lacks nothing (`tests/foreign/cases/case-54`), and a description that is
/// up to a half off.
#[test]
fn a_refit_that_short_stretches_led_astray_names_nothing() {
    let file = |name: &str| super::alike::foreign(&format!("cases/case-54/{name}"));
    let right = Rig::load(file("rig.toml")).expect("the rig is committed");
    let off = [
        ("motor.inertia", 3.99294e-6),
        ("load.inertia", 9.98729e-6),
        ("shaft.stiffness", 1.42621e-3),
        ("shaft_loss.damping", 4.66134e-6),
        ("bearing.damping", 9.53219e-6),
    ];
    let read = |name| Recording::read(file(name)).expect("the recording is committed");
    let recordings = Recordings {
        fit: vec![read("fit-a.csv"), read("fit-b.csv")],
        check: vec![read("check.csv")],
        test: Vec::new(),
    };
    for (rig, verdict) in [
        (right.clone(), Verdict::Consistent),
        (
            right
                .with_values(&off)
                .expect("the rig has these parameters"),
            Verdict::Parameters,
        ),
    ] {
        let found = diagnose(
            &rig,
            &recordings,
            &DiagnoseOptions::default(),
            &|_, _, _| {},
        );
        let found = found.expect("the rig can be diagnosed");
        assert_eq!(found.verdict, verdict, "{}", found.sentence);
    }
}

/// The cart with its right inertia under a load that somebody told.
fn progress(load: f64) -> Rig {
    let right = CART.replace("1.8", "2.0");
    let effect = finger::effect("constant_load", "cart", &format!("level = {load}"));
    Rig::parse(&(right + &effect), "cart.toml").expect("the text is a rig")
}

/// An encoder that is fifty times as noisy in the first second: so bad a start carries any rig
/// away.
fn recorded_badly_at_first(load: f64) -> Recording {
    let recorded = recorded(load, 2);
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
    let mut columns = recorded.columns().to_vec();
    for q in &mut columns[1].values[..100] {
        *q -= 5e-2 * gaussian(&mut random);
    }
    Recording::new("bad.csv", recorded.t().to_vec(), columns).expect("the text is a recording")
}

#[test]
fn what_only_its_start_carries_away_runs_through_and_what_is_wrong_does_not() {
    let load = 8e-4;
    let (before, right, twice) = (progress(0.0), progress(load), progress(2.0 * load));
    let roles = Roles::new(&[recorded(load, 1)], &[recorded_badly_at_first(load)], &[]);
    let roles = roles.expect("both recordings have rows");
    let plant = compiled(&before);
    let data = |recordings: &[Recording]| {
        Data::new(&before, &plant, recordings).expect("the recordings have the columns of the rig")
    };
    let both = [roles.fit.clone(), roles.check.clone()].concat();
    let (fit, check, both) = (data(&roles.fit), data(&roles.check), data(&both));
    let case = Case {
        in_parts: true,
        check_intervals: check.cut(8),
        ..case(&before, [&fit, &check, &both], fit.cut(8))
    };
    let through =
        |after: &Rig| holds_over_whole_recordings(&case, &before, after).expect("the rig is sound");
    assert!(
        !falls(&before, &right, &roles.check, 1.25),
        "its start is no bad one"
    );
    assert!(through(&right));
    assert!(!through(&before) && !through(&twice));
}

#[test]
fn a_rig_whose_free_run_leaves_the_recording_has_run_away() {
    use crate::diagnose::case::runs_away;
    let recordings = super::recordings();
    let refitted = crate::fit::fit(
        &super::rig(),
        &recordings.fit,
        &crate::fit::FitOptions::default(),
        &mut |_| {},
    );
    let mut refitted = refitted.expect("the rig can be fitted");
    assert!(!runs_away(&refitted, &recordings.check));
    let text =
        std::fs::read_to_string(super::shipped(".toml")).expect("the file ships with the project");
    let text = text.replace("gain = 1.0", "gain = 10.0");
    refitted.rig = Rig::parse(&text, "loud.toml").expect("the text is a rig");
    assert!(runs_away(&refitted, &recordings.check));
}
