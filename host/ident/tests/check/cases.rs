//! Recordings that went wrong, beside the truth that wrote them (tests/cases, `expected.json`).

use std::path::PathBuf;

use sinew_ident::check::{Check, check};
use sinew_ident::diagnose::{DiagnoseOptions, Recordings, Verdict, diagnose};
use sinew_ident::fit::{Fit, FitOptions, fit, score};
use sinew_ident::recording::Recording;
use sinew_ident::recording::repair::{Repair, TimeUnit};
use sinew_ident::report::warnings;
use sinew_sim::Rig;

fn file(case: &str, name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    folder.join(case).join(name)
}

fn rig(case: &str) -> Rig {
    Rig::load(file(case, "rig.toml")).unwrap()
}

fn recording(case: &str, name: &str) -> Recording {
    Recording::read(file(case, name)).unwrap()
}

/// Checks of a recording beside the rig of its case.
fn checks(case: &str, name: &str) -> Vec<Check> {
    check(&[recording(case, name)], Some(&rig(case)))
}

fn only(found: &[Check], kind: &str) -> Check {
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].kind, kind, "{found:?}");
    assert!(found[0].certain, "{found:?}");
    found[0].clone()
}

fn fitted(rig: &Rig, recording: Recording) -> Fit {
    fit(rig, &[recording], &FitOptions::default(), &mut |_| {}).unwrap()
}

/// Each fitted value is within a part of the truth.
fn assert_near(fit: &Fit, truth: &[f64], part: f64) {
    for (found, truth) in fit.parameters.iter().zip(truth) {
        let relative = (found.value / truth - 1.0).abs();
        assert!(relative < part, "{} {}", found.name, found.value);
    }
}

#[test]
fn an_encoder_that_counts_backwards_is_named_with_its_gain() {
    for name in ["A.csv", "B.csv"] {
        let found = only(&checks("23-encoder-sign", name), "wrong_sign");
        assert!(found.remedy.contains("encoder"), "{}", found.remedy);
    }
    let right = Rig::load(file("23-encoder-sign", "right.toml")).unwrap();
    let a = recording("23-encoder-sign", "A.csv");
    assert_eq!(check(std::slice::from_ref(&a), Some(&right)), []);
    assert_near(&fitted(&right, a), &[2.0, 50.0, 1.5], 0.01);
}

#[test]
fn a_damping_that_starts_at_its_bound_leaves_it() {
    let case = "27-start-at-bound";
    for name in ["rig.toml", "zero.toml"] {
        let rig = Rig::load(file(case, name)).unwrap();
        let fit = fitted(&rig, recording(case, "A.csv"));
        assert_near(&fit, &[2.0, 50.0, 1.5], 0.01);
        let unseen = score(&fit.rig, &[recording(case, "B.csv")]).unwrap();
        assert!(unseen[0].rms < 1.2e-4, "{name}: {}", unseen[0].rms);
    }
}

/// An inverted pendulum of 0.02 kg m^2, 0.01 N m s/rad and 0.8 N m, held upright for 8 s. Its
/// unstable pole is the positive root of `inertia s^2 + damping s - amplitude`.
#[test]
fn an_unstable_plant_is_fitted_in_intervals_and_is_said_to_run_away() {
    let case = "32-unstable-under-feedback";
    let pole = (-0.01 + f64::sqrt(0.01 * 0.01 + 4.0 * 0.02 * 0.8)) / (2.0 * 0.02);
    for name in ["rig.toml", "true.toml"] {
        let rig = Rig::load(file(case, name)).unwrap();
        let fit = fitted(&rig, recording(case, "A.csv"));
        assert_near(&fit, &[0.02, 0.01, 0.8], 0.01);
        let runaway = fit
            .runaway
            .expect("the pendulum falls over without its controller");
        assert!((runaway.rate / pole - 1.0).abs() < 0.05, "{runaway:?}");
        assert!((1.0..3.0).contains(&runaway.interval), "{runaway:?}");
        assert!(!runaway.whole);
        assert!(warnings(&fit)[0].contains("runs away by itself"));
    }
    let recordings = Recordings {
        fit: vec![recording(case, "A.csv")],
        ..Recordings::default()
    };
    let options = DiagnoseOptions::default();
    let found = diagnose(&rig(case), &recordings, &options, &|_, _, _| {}).unwrap();
    assert_eq!(found.verdict, Verdict::Unexplained);
    assert!(
        found.sentence.contains("Cut the recordings to"),
        "{}",
        found.sentence
    );
}

/// Cut to no length would the recording judge a rig whose gravity is bare and wrong.
#[test]
fn a_wrong_bare_number_of_an_unstable_plant_is_asked_for() {
    let case = "32-unstable-under-feedback";
    let text = std::fs::read_to_string(file(case, "rig.toml")).unwrap();
    let at = text.find("amplitude").unwrap();
    let end = at + text[at..].find('\n').unwrap();
    let text = format!("{}amplitude = 0.4{}", &text[..at], &text[end..]);
    let rig = Rig::parse(&text, "rig.toml").unwrap();
    let fit = fitted(&rig, recording(case, "A.csv"));
    let said = &warnings(&fit)[0];
    assert!(said.contains("runs away by itself"), "{said}");
    assert!(said.contains("write those that you trust least"), "{said}");
    assert!(!said.contains("Cut the recordings"), "{said}");
}

#[test]
fn milliseconds_are_named_and_mended() {
    for name in ["A.csv", "short.csv"] {
        let found = only(&checks("28-milliseconds", name), "time_in_milliseconds");
        assert_eq!(found.remedy, "--time-unit ms");
    }
    let repair = Repair {
        time_unit: TimeUnit::Milliseconds,
        ..Repair::default()
    };
    let rig = rig("28-milliseconds");
    let a = repair.apply(recording("28-milliseconds", "A.csv")).unwrap();
    assert_eq!(check(std::slice::from_ref(&a), Some(&rig)), []);
    assert_near(&fitted(&rig, a), &[2.0, 50.0, 1.5], 0.02);
}

/// A damper that `sinew new` guessed is no evidence of a unit.
#[test]
fn guessed_numbers_make_no_unit_of_time_certain() {
    let case = "28-milliseconds";
    let text = std::fs::read_to_string(file(case, "rig.toml")).unwrap();
    let text = text.replace(
        "stiffness = { value = 40.0 }",
        "stiffness = { value = 4e7 }",
    );
    for (comment, certain) in [("# N s/m, a guess", false), ("# N s/m, weighed", true)] {
        let damping = "damping = { value = 1.0 }";
        let text = text.replace(damping, &format!("{damping}   {comment}"));
        let rig = Rig::parse(&text, "rig.toml").unwrap();
        let found = check(&[recording(case, "A.csv")], Some(&rig));
        let time = found.iter().find(|check| check.kind.starts_with("time_in"));
        assert_eq!(time.unwrap().certain, certain, "{found:?}");
    }
}

#[test]
fn a_counter_that_wraps_is_named_and_mended() {
    let case = "29-encoder-wrap";
    let turn = std::f64::consts::TAU;
    for name in ["A.csv", "B.csv"] {
        let found = only(&checks(case, name), "wrapped_counter");
        assert!(found.sentence.contains("q_rad jumps by 6.28"), "{found:?}");
        assert_eq!(found.remedy, format!("--unwrap q_rad={turn}"));
    }
    assert_eq!(checks(case, "A_unwrapped.csv"), []);
    let repair = Repair {
        unwrap: vec![("q_rad".into(), turn)],
        ..Repair::default()
    };
    let mended = repair.apply(recording(case, "A.csv")).unwrap();
    assert_near(&fitted(&rig(case), mended), &[0.02, 0.05], 0.02);
}

#[test]
fn parameters_that_nothing_determines_stay_to_the_digit() {
    let case = "30-no-excitation";
    for name in ["A.csv", "B.csv"] {
        let found = checks(case, name);
        assert_eq!(found[0].kind, "no_excitation", "{found:?}");
    }
    let fit = fitted(&rig(case), recording(case, "A.csv"));
    let found: Vec<f64> = fit.parameters.iter().map(|p| p.value).collect();
    assert_eq!(found, [1.5, 40.0, 1.0]);
    assert!(
        fit.parameters
            .iter()
            .all(|p| p.ci95.is_none() && !p.at_bound)
    );
    assert_eq!(fit.rig.to_toml(), rig(case).to_toml());
}

#[test]
fn a_command_that_was_written_late_is_named_and_mended() {
    let case = "31-command-a-row-late";
    for name in ["A.csv", "B.csv"] {
        let found = only(&checks(case, name), "input_lags");
        assert_eq!(found.remedy, "--late u_N=1");
    }
    let repair = Repair {
        late: vec![("u_N".into(), 1)],
        ..Repair::default()
    };
    let mended = repair.apply(recording(case, "A.csv")).unwrap();
    assert_near(&fitted(&rig(case), mended), &[2.0, 50.0, 1.5], 0.01);
}

#[test]
fn a_sentinel_is_named_by_its_line_and_mended() {
    let case = "34-sentinel";
    let found = only(&checks(case, "A.csv"), "sentinel");
    let text = std::fs::read_to_string(file(case, "A.csv")).unwrap();
    let line = text.lines().position(|line| line.contains("-9999"));
    assert_eq!(found.line, line.unwrap() + 1);
    assert!(found.sentence.starts_with("-9999 stands in 2 rows of q_m"));
    let repair = Repair {
        missing: vec![-9999.0],
        ..Repair::default()
    };
    let rig = rig(case);
    let mended = repair.apply(recording(case, "A.csv")).unwrap();
    assert_eq!(check(std::slice::from_ref(&mended), Some(&rig)), []);
    assert_near(&fitted(&rig, mended), &[2.0, 50.0, 1.5], 0.02);
}

#[test]
fn uneven_rows_lose_neither_the_noise_nor_the_friction() {
    let case = "38-irregular-sampling";
    for [a, b] in [["A.csv", "B.csv"], ["A_even.csv", "B_even.csv"]] {
        let recordings = [a, b].map(|name| recording(case, name));
        for recording in &recordings {
            let q = recording.column("q_m").unwrap();
            let noise = sinew_ident::noise::noise_level(recording.t(), q);
            assert!((noise / 1e-4 - 1.0).abs() < 0.2, "{a}: {noise}");
        }
        let [a, b] = recordings;
        let recordings = Recordings {
            fit: vec![a],
            check: vec![b],
            test: vec![],
        };
        let options = DiagnoseOptions::default();
        let found = diagnose(&rig(case), &recordings, &options, &|_, _, _| {}).unwrap();
        assert_eq!(found.verdict, Verdict::MissingPhysics, "{}", found.sentence);
        assert_eq!(found.effects[0].kind, "coulomb_friction");
        assert_eq!(found.effects[0].component, "mass");
    }
}
