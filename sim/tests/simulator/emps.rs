//! The free run of the EMPS rig on the real recordings, with the authors' parameters, against the
//! figures that come with the data (another program computed them): 6.8 mm and 9.2 mm RMS with
//! Coulomb friction, 179 mm and 181 mm without.
//!
//! The recordings are not shipped: the folder is `SINEW_DATA`, or `../shared/data` beside the
//! project. Where there is none the test says so and has nothing to hold.

use sinew_sim::{Plant, Rig};
use std::io::Write;
use std::path::PathBuf;

fn recording(file: &str) -> Option<[Vec<f64>; 3]> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let data = std::env::var_os("SINEW_DATA").map(PathBuf::from);
    let data = data.unwrap_or_else(|| root.join("../../shared/data"));
    let text = std::fs::read_to_string(data.join("emps").join(file)).ok()?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next()?.split(',').collect();
    let at = ["t", "u_V", "q_m"].map(|name| header.iter().position(|h| *h == name).unwrap());
    let rows = lines.map(|line| {
        let fields: Vec<f64> = line.split(',').map(|f| f.parse().unwrap()).collect();
        at.map(|at| fields[at])
    });
    let rows: Vec<[f64; 3]> = rows.collect();
    Some([0, 1, 2].map(|column| rows.iter().map(|row| row[column]).collect()))
}

/// RMS of the free run, mm.
fn free_run(level: f64, [times, input, position]: &[Vec<f64>; 3]) -> f64 {
    let rig = Rig::parse(include_str!("../../../rigs/emps.toml"), "emps.toml").unwrap();
    let authors = rig.with_values(&[
        ("carriage.inertia", 95.1089),
        ("screw.damping", 203.5034),
        ("carriage.constant_load.level", 3.1648),
        ("carriage.coulomb_friction.level", level),
    ]);
    let plant = Plant::new(&authors.unwrap()).unwrap();
    let run = plant
        .simulate_recording(times, &[input], &[position])
        .unwrap();
    assert_eq!(run.trajectory.report.fallbacks, 0);
    let squares = run.trajectory.signals.iter().zip(position);
    let sum: f64 = squares.map(|(a, b)| (a - b).powi(2)).sum();
    1e3 * (sum / times.len() as f64).sqrt()
}

#[test]
fn the_authors_parameters_give_the_published_free_run() {
    for (file, with, without) in [("train.csv", 6.8, 179.0), ("test_pulses.csv", 9.2, 181.0)] {
        let Some(recording) = recording(file) else {
            // Written, not printed: the test harness would swallow the output of a test that
            // "passes".
            let _ = writeln!(
                std::io::stderr(),
                "SKIPPED: no EMPS recordings (set SINEW_DATA)"
            );
            return;
        };
        let (found, found_without) = (free_run(20.39, &recording), free_run(0.0, &recording));
        println!("{file}: {found:.2} mm with Coulomb friction, {found_without:.1} mm without");
        // A drifting axis adds up the third digit of every parameter: 2 %.
        assert!((found / with - 1.0).abs() < 0.02, "{file}: {found} mm");
        assert!(
            (found_without - without).abs() < 0.6,
            "{file}: {found_without} mm"
        );
    }
}
