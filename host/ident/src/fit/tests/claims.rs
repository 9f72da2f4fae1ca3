//! Claims that a fit must not make, and warnings that it must give.

use super::*;
use crate::report::{unexplained, warnings};

#[test]
fn friction_that_the_rig_lacks_is_seen_in_the_error() {
    let (recording, _) = foreign();
    let fit = run(&parse(&oscillator(1.0, 40.0, 1.2, "")), &[recording]);
    let sensor = &fit.sensors[0];
    assert!(
        sensor.rms < 0.7 * sensor.as_written_rms,
        "refitting does not help: {sensor:?}"
    );
    assert!(sensor.rms > 20.0 * 4.8e-4, "{sensor:?}");
}

/// Dry friction leaves a tenth of the motion, which a controller lives with; without its spring the
/// mass is anywhere.
#[test]
fn a_person_is_warned_of_a_rig_that_explains_nothing() {
    let (recording, _) = foreign();
    let warned = |text: &str| {
        let fit = run(&parse(text), std::slice::from_ref(&recording));
        unexplained(&fit.sensors[0])
    };
    let whole = oscillator(1.0, 40.0, 1.2, "");
    assert_eq!(warned(&whole), None);
    let coil = whole.find("[[spring]]").unwrap()..whole.find("[[damper]]").unwrap();
    let mut bare = whole.clone();
    bare.replace_range(coil, "");
    assert!(warned(&bare).unwrap().contains("misses q_m by"));
    // From three tenths of the spread on.
    let sensor = |rms| SensorFit {
        signal: "q_m".into(),
        unit: "m".into(),
        as_written_rms: 0.1,
        rms,
        spread: 0.1,
        noise: 1e-3,
        samples: 100,
    };
    assert!(sensor(0.0299).is_explained());
    assert!(!sensor(0.0301).is_explained());
    assert!(
        !sensor(f64::INFINITY).is_explained(),
        "it cannot be simulated"
    );
}

/// Whoever draws the fit needs no second simulation.
#[test]
fn the_free_runs_of_a_fit_are_those_of_its_rigs() {
    let (recording, test) = foreign();
    let rig = parse(&oscillator(1.0, 40.0, 1.2, ""));
    let recordings = [recording, test];
    let fit = run(&rig, &recordings);
    for (runs, rig) in [(&fit.as_written_runs, &rig), (&fit.runs, &fit.rig)] {
        assert_eq!(runs.len(), recordings.len());
        for (run, recording) in runs.iter().zip(&recordings) {
            let own = free_run(rig, recording).unwrap();
            assert_eq!(run.recording, own.recording);
            assert_eq!(run.sensors[0].simulated, own.sensors[0].simulated);
        }
    }
    assert_ne!(
        fit.as_written_runs[0].sensors[0].simulated,
        fit.runs[0].sensors[0].simulated
    );
    assert_eq!(pool(&fit.runs)[0].rms, fit.sensors[0].rms);
}

#[test]
fn what_the_data_do_not_determine_stays_near_the_rig_and_claims_nothing() {
    let truth = parse(&oscillator(1.0, 40.0, 1.0, ""));
    let recording = recorded(&truth, 1500, 0.01, 10.0, 1e-3, 3);
    // Gain, inertia, stiffness and damping only show as ratios.
    let text = oscillator(3.0, 100.0, 2.0, "").replace("gain = 1.0", "gain = { value = 2.0 }");
    let fit = run(&parse(&text), &[recording]);
    let value = |name: &str| parameter(&fit, name).value;
    assert!((value("coil.stiffness") / value("mass.inertia") / 40.0 - 1.0).abs() < 0.01);
    assert!((value("push.gain") / value("mass.inertia") - 1.0).abs() < 0.01);
    assert!(
        fit.parameters
            .iter()
            .all(|parameter| parameter.ci95.is_none()),
        "{:?}",
        fit.parameters
    );
    for parameter in &fit.parameters {
        let ratio = parameter.value / parameter.as_written;
        assert!(
            (0.3..3.0).contains(&ratio),
            "{parameter:?} went far from the rig"
        );
    }
}

#[test]
fn a_parameter_that_is_lost_in_noise_claims_nothing() {
    let text = |load: f64| {
        let effect = "[[effect]]\nkind = \"constant_load\"\ncomponent = \"mass\"\n";
        oscillator(
            1.0,
            40.0,
            1.0,
            &format!("{effect}level = {{ value = {load:?} }}\n"),
        )
    };
    let recording = recorded(&parse(&text(1e-4)), 400, 0.02, 10.0, 0.05, 11);
    let fit = run(&parse(&text(2e-4)), &[recording]);
    let load = parameter(&fit, "mass.constant_load.level");
    assert_eq!((load.ci95, load.at_bound), (None, false));
    assert!(load.value.abs() < 1e-2, "{load:?} went far from the rig");
    assert!(
        parameter(&fit, "coil.stiffness").ci95.is_some(),
        "{:?}",
        fit.parameters
    );
}

#[test]
fn intervals_hold_the_truth_nineteen_times_in_twenty() {
    let truth = parse(&oscillator(1.0, 40.0, 1.0, ""));
    let (mut inside, mut all) = (0, 0);
    for seed in 0..60 {
        let recording = recorded(&truth, 600, 0.02, 10.0, 0.05, 100 + seed);
        let fit = run(&parse(&oscillator(1.3, 50.0, 0.8, "")), &[recording]);
        for (found, truth) in fit.parameters.iter().zip([1.0, 40.0, 1.0]) {
            let [low, high] = found.ci95.unwrap();
            inside += usize::from((low..high).contains(&truth));
            all += 1;
        }
    }
    let part = f64::from(inside as u32) / f64::from(all);
    // 180 intervals: 95 % +- 3.2 % for two standard deviations if all were independent.
    assert!((0.90..0.99).contains(&part), "{inside} of {all}");
}

#[test]
fn what_cannot_be_fitted_is_said() {
    let rig = parse(&oscillator(1.0, 40.0, 1.0, ""));
    let refusal = |recordings: &[Recording]| {
        fit(&rig, recordings, &FitOptions::default(), &mut |_| {})
            .unwrap_err()
            .to_string()
    };
    assert!(refusal(&[]).contains("at least one recording"));
    let csv = |text: &str| Recording::parse(text.as_bytes(), "a.csv").unwrap();
    assert!(refusal(&[csv("t,u_N,q_mm\n0,1,2\n1,2,3\n")]).contains("did you mean `q_mm`?"));
    assert!(refusal(&[csv("t,u_N,q_m\n0,1,2\n1,2,3\n")]).contains("too few"));
    let rows: String = (0..50).map(|k| format!("{k},1,\n")).collect();
    assert!(refusal(&[csv(&format!("t,u_N,q_m\n{rows}"))]).contains("a single sample"));
    let rows: String = (0..50).map(|k| format!("{k},{},0.01\n", k % 7)).collect();
    let dead = refusal(&[csv(&format!("t,u_N,q_m\n{rows}"))]);
    assert!(
        dead.contains("no sensor ever changes: `q_m` (10.0 mm)"),
        "{dead}"
    );
    let stiff = parse(&oscillator(1e-9, 1e12, 0.0, ""));
    let error = fit(
        &stiff,
        &[recorded(&rig, 100, 0.1, 1.0, 0.0, 9)],
        &FitOptions::default(),
        &mut |_| {},
    );
    let error = error.unwrap_err();
    assert!(error.to_string().contains("cannot be simulated"), "{error}");
    assert_eq!(error.exit_code(), 1);
}

/// A column that is missing first, then a length, whatever the order of the files.
#[test]
fn recordings_that_cannot_be_judged_are_found_without_a_fit() {
    let rig = parse(&oscillator(1.0, 40.0, 1.0, ""));
    let few = recorded(&rig, 20, 0.01, 10.0, 0.01, 10);
    let enough = recorded(&rig, 21, 0.01, 10.0, 0.01, 10);
    let column = Recording::parse("t,u_N,q_mm\n0,1,2\n1,2,3\n".as_bytes(), "a.csv").unwrap();
    assert!(require(&rig, [&enough]).is_ok());
    let refused = |them: &[&Recording]| {
        let refused = require(&rig, them.iter().copied());
        refused.unwrap_err().to_string()
    };
    assert!(refused(&[&enough, &few]).contains("20 rows are too few to judge a rig by"));
    assert!(refused(&[&few, &column]).contains("did you mean `q_mm`?"));
}

#[test]
fn a_rig_without_free_parameters_is_only_scored() {
    let truth = parse(&oscillator(1.0, 40.0, 1.0, ""));
    let recording = recorded(&truth, 500, 0.01, 10.0, 0.01, 10);
    let known = parse(
        &oscillator(1.0, 40.0, 1.0, "")
            .replace("{ value = ", "")
            .replace(" }", ""),
    );
    let fit = run(&known, &[recording]);
    assert!(fit.parameters.is_empty());
    assert_eq!(fit.sensors[0].rms, fit.sensors[0].as_written_rms);
}

#[test]
fn a_person_is_asked_for_the_unit_where_every_parameter_changed_by_powers_of_ten() {
    let (recording, _) = foreign();
    let text = oscillator(1.0, 40.0, 1.2, FRICTION);
    let asked = |text: &str, recording: &Recording| {
        let warnings = warnings(&run(&parse(text), std::slice::from_ref(recording)));
        warnings
            .iter()
            .any(|warning| warning.contains("in another unit"))
    };
    assert!(!asked(&text, &recording));
    let minutes = recording.t().iter().map(|t| t / 60.0).collect();
    let columns = recording.columns().to_vec();
    let in_minutes = Recording::new("minutes.csv", minutes, columns).unwrap();
    assert!(asked(&text, &in_minutes));
    // "None yet" is no unit.
    let none_yet = text.replace("damping = { value = 1.2 }", "damping = { value = 1e-8 }");
    assert!(!asked(&none_yet, &recording));
}

/// Three readings fit three parameters and a start exactly, whatever the truth; five do nearly.
#[test]
fn no_interval_comes_of_fewer_readings_than_unknowns() {
    let truth = parse(&oscillator(1.0, 50.0, 2.0, ""));
    let whole = recorded(&truth, 600, 0.01, 10.0, 0.0, 5);
    let believed = parse(&oscillator(1.5, 30.0, 1.0, ""));
    for rows in [vec![120, 300, 480], vec![60, 150, 260, 390, 520]] {
        let columns = whole.columns().iter().map(|column| {
            let kept = |(row, value): (usize, &f64)| {
                if column.name != "q_m" || rows.contains(&row) {
                    *value
                } else {
                    f64::NAN
                }
            };
            Column {
                name: column.name.clone(),
                values: column.values.iter().enumerate().map(kept).collect(),
            }
        });
        let sparse = Recording::new("sparse.csv", whole.t().to_vec(), columns.collect()).unwrap();
        let fitted = run(&believed, &[sparse]);
        assert_eq!(fitted.parameters.len(), 3);
        assert!(
            fitted.parameters.iter().all(|p| p.ci95.is_none()),
            "{rows:?}: {:?}",
            fitted.parameters
        );
    }
}

/// Readings every second row of a slow sensor, from a few to many: the interval of a claim holds
/// the truth as often as it says.
#[test]
fn intervals_of_few_readings_hold_the_truth_as_often_as_they_say() {
    let truth = parse(&oscillator(1.0, 40.0, 1.0, ""));
    let believed = parse(&oscillator(1.3, 50.0, 0.8, ""));
    for readings in [12, 18, 24, 40] {
        let (mut inside, mut all) = (0, 0);
        for seed in 0..40 {
            let whole = recorded(&truth, 360, 0.02, 10.0, 0.05, 300 + seed);
            let columns = whole.columns().iter().map(|column| Column {
                name: column.name.clone(),
                values: if column.name == "q_m" {
                    (0..)
                        .zip(&column.values)
                        .map(|(row, value)| match row % (360 / readings) {
                            0 => *value,
                            _ => f64::NAN,
                        })
                        .collect()
                } else {
                    column.values.clone()
                },
            });
            let few = Recording::new("few.csv", whole.t().to_vec(), columns.collect()).unwrap();
            let fit = run(&believed, &[few]);
            for (found, truth) in fit.parameters.iter().zip([1.0, 40.0, 1.0]) {
                if let Some([low, high]) = found.ci95 {
                    inside += usize::from((low..high).contains(&truth));
                    all += 1;
                }
            }
        }
        println!("{readings} readings: {inside} of {all}");
        assert!(
            inside * 100 >= all * 88,
            "{readings} readings: {inside} of {all}"
        );
    }
}

#[test]
fn intervals_of_short_recordings_hold_the_truth_as_often_as_they_say() {
    let truth = parse(&oscillator(1.3, 55.0, 1.4, ""));
    let believed = parse(&oscillator(1.0, 40.0, 1.0, ""));
    for rows in [30, 40, 80] {
        let (mut inside, mut all) = (0, 0);
        for seed in 0..40 {
            let short = recorded(&truth, rows, 0.01, 8.0, 0.02, 700 + seed);
            let fit = run(&believed, &[short]);
            for (found, truth) in fit.parameters.iter().zip([1.3, 55.0, 1.4]) {
                if let Some([low, high]) = found.ci95 {
                    inside += usize::from((low..high).contains(&truth));
                    all += 1;
                }
            }
        }
        println!("{rows} rows: {inside} of {all}");
        assert!(
            inside * 100 >= all * 88 && all >= 50,
            "{rows} rows: {inside} of {all}"
        );
    }
}
