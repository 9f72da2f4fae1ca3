//! Parameters that a fit must find.

use super::*;

#[test]
fn the_truth_of_a_foreign_recording_is_found_from_anywhere() {
    let (recording, test) = foreign();
    let truth = [1.147, 43.6, 1.08, 0.58];
    for [inertia, stiffness, damping] in [[1.0, 40.0, 1.2], [0.2, 300.0, 0.05], [8.0, 5.0, 15.0]] {
        let fit = run(
            &parse(&oscillator(inertia, stiffness, damping, FRICTION)),
            std::slice::from_ref(&recording),
        );
        for (found, truth) in fit.parameters.iter().zip(truth) {
            let [low, high] = found.ci95.unwrap();
            assert!(
                (found.value / truth - 1.0).abs() < 1e-3,
                "{}: {}",
                found.name,
                found.value
            );
            assert!(high - low < 0.01 * truth, "{}: {low} to {high}", found.name);
            // Two intervals wide: one in twenty may miss by design, none by this much.
            assert!(
                (found.value - truth).abs() < high - low,
                "{}: {low} to {high}",
                found.name
            );
        }
        // The noise is 0.48 mm; a perfect model leaves it and no more.
        let unseen = &score(&fit.rig, std::slice::from_ref(&test)).unwrap()[0];
        assert!((4.7e-4..5.0e-4).contains(&unseen.rms), "{}", unseen.rms);
        assert!(fit.sensors[0].as_written_rms > 10.0 * fit.sensors[0].rms);
        assert_eq!(fit.stop, Stop::Converged);
    }
}

#[test]
fn a_free_slide_that_drifts_away_is_fitted() {
    let text = |inertia: f64, load: f64| {
        format!(
            "[[body]]\nname = \"cart\"\nmotion = \"slide\"\ninertia = {{ value = {inertia:?} }}\n\
             [[gravity]]\nname = \"tilt\"\nbody = \"cart\"\namplitude = {{ value = {load:?} }}\n\
             [[actuator]]\nname = \"push\"\ndrives = \"cart\"\ninput = \"u_N\"\ngain = 1.0\n\
             [[sensor]]\nname = \"encoder\"\nreads = \"cart.position\"\nsignal = \"q_m\"\n"
        )
    };
    let truth = parse(&text(2.0, 0.7));
    // Two recordings of different lengths, so that they are cut differently.
    let recordings = [
        recorded(&truth, 3000, 0.01, 5.0, 1e-4, 1),
        recorded(&truth, 700, 0.01, 5.0, 1e-4, 2),
    ];
    for inertia in [0.1, 60.0] {
        let fit = run(&parse(&text(inertia, 0.0)), &recordings);
        assert!(
            (parameter(&fit, "cart.inertia").value - 2.0).abs() < 0.02,
            "{:?}",
            fit.parameters
        );
        assert!(
            (parameter(&fit, "tilt.amplitude").value - 0.7).abs() < 0.02,
            "{:?}",
            fit.parameters
        );
    }
}

#[test]
fn missing_samples_cost_nothing_and_held_inputs_are_told() {
    let truth = parse(&oscillator(1.0, 40.0, 1.0, ""));
    let whole = recorded(&truth, 1500, 0.01, 10.0, 1e-3, 6);
    let with_gaps = |column: &Column| {
        let hit = |row: usize| match column.name.as_str() {
            // An input that repeats its last value loses nothing when it is missing.
            "u_N" => row % 37 == 5,
            _ => row.is_multiple_of(3) || (700..760).contains(&row),
        };
        let values = column
            .values
            .iter()
            .enumerate()
            .map(|(row, value)| if hit(row) { f64::NAN } else { *value });
        Column {
            name: column.name.clone(),
            values: values.collect(),
        }
    };
    let gaps = Recording::new(
        "gaps.csv",
        whole.t().to_vec(),
        whole.columns().iter().map(with_gaps).collect(),
    )
    .unwrap();
    let fit = run(&parse(&oscillator(2.0, 60.0, 3.0, "")), &[gaps]);
    for (found, truth) in fit.parameters.iter().zip([1.0, 40.0, 1.0]) {
        assert!((found.value / truth - 1.0).abs() < 0.01, "{found:?}");
    }
    assert_eq!(
        fit.held,
        [HeldInput {
            recording: "gaps.csv".into(),
            column: "u_N".into(),
            missing: 41
        }]
    );
    assert!(fit.sensors[0].samples < 1000);
}

#[test]
fn sensors_of_different_size_and_a_body_that_none_shows() {
    let text = |inertia: f64, stiffness: f64| {
        format!(
            "[[body]]\nname = \"motor\"\nmotion = \"hinge\"\ninertia = {{ value = {inertia:?} }}\n\
             [[body]]\nname = \"load\"\nmotion = \"hinge\"\ninertia = 0.1\n\
             [[spring]]\nname = \"shaft\"\nfrom = \"motor\"\nto = \"load\"\nstiffness = {{ value = {stiffness:?} }}\n\
             [[spring]]\nname = \"return\"\nfrom = \"ground\"\nto = \"load\"\nstiffness = 5.0\n\
             [[damper]]\nname = \"bearing\"\nfrom = \"ground\"\nto = \"load\"\ndamping = {{ value = 0.05 }}\n\
             [[damper]]\nname = \"brushes\"\nfrom = \"ground\"\nto = \"motor\"\ndamping = 0.02\n\
             [[actuator]]\nname = \"drive\"\ndrives = \"motor\"\ninput = \"u_V\"\ngain = 0.4\n\
             [[sensor]]\nname = \"encoder\"\nreads = \"load.position\"\nsignal = \"q_mrad\"\ngain = 1000.0\n\
             [[sensor]]\nname = \"gyro\"\nreads = \"load.velocity\"\nsignal = \"w_rad_s\"\n"
        )
    };
    let recording = recorded(&parse(&text(0.02, 30.0)), 3000, 0.005, 10.0, 0.01, 7);
    let fit = run(&parse(&text(0.05, 60.0)), &[recording]);
    assert!(
        (parameter(&fit, "motor.inertia").value / 0.02 - 1.0).abs() < 0.05,
        "{:?}",
        fit.parameters
    );
    assert!(
        (parameter(&fit, "shaft.stiffness").value / 30.0 - 1.0).abs() < 0.05,
        "{:?}",
        fit.parameters
    );
    for sensor in &fit.sensors {
        let ratio = sensor.rms / sensor.spread;
        assert!(
            (0.009..0.012).contains(&ratio),
            "noise is a hundredth of each signal: {sensor:?}"
        );
    }
}

/// Says why a test cannot run here; `cargo xtask test` counts these.
fn skip(reason: &str) {
    use std::io::Write;
    // Written, not printed: the test harness would swallow the output of a test that "passes".
    let _ = writeln!(std::io::stderr(), "SKIPPED: {reason}");
}

/// The real positioning axis, where its recordings are at hand (`SINEW_DATA`).
#[test]
fn the_emps_axis() {
    let folder = std::env::var_os("SINEW_DATA")
        .map_or_else(|| root().join("../shared/data"), PathBuf::from)
        .join("emps");
    if !folder.join("train.csv").exists() {
        return skip("no EMPS recordings (set SINEW_DATA)");
    }
    let rig = Rig::load(root().join("rigs/emps.toml")).unwrap();
    let train = Recording::read(folder.join("train.csv")).unwrap();
    let test = Recording::read(folder.join("test_pulses.csv")).unwrap();
    for [inertia, damping] in [[95.0, 203.0], [50.0, 800.0], [200.0, 50.0]] {
        let rig = rig
            .with_values(&[("carriage.inertia", inertia), ("screw.damping", damping)])
            .unwrap();
        let fit = run(&rig, std::slice::from_ref(&train));
        let near = |name: &str, value: f64, part: f64| {
            let found = parameter(&fit, name).value;
            assert!(
                (found / value - 1.0).abs() < part,
                "{name}: {found} from {inertia}, {damping}"
            );
        };
        // Published: M 95.1, Fv 203.5, Fc 20.4; the free run over this record alone: 93.1, 204.8,
        // 20.7.
        near("carriage.inertia", 93.1, 0.05);
        near("screw.damping", 204.8, 0.08);
        near("carriage.coulomb_friction.level", 20.7, 0.08);
        assert!(fit.sensors[0].rms < 3.0e-3, "{:?}", fit.sensors);
        let unseen = &score(&fit.rig, std::slice::from_ref(&test)).unwrap()[0];
        assert!(unseen.rms < 5.5e-3, "{unseen:?}");
    }
}
