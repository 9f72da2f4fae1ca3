//! From a designed experiment to a recording, and what is drawn of it.

use crate::desk::{Desk, columns};

/// Every rig that ships and has limits: an experiment drives it, and the simulation stays finite.
#[test]
fn every_shipped_rig_runs_its_own_experiment() {
    let rigs = [
        "mass-spring-damper",
        "two-mass-drive",
        "three-mass",
        "tendon",
        "hasel",
    ];
    for rig in rigs {
        let desk = Desk::new();
        desk.bring(&format!("rigs/{rig}.toml"));
        desk.succeed(&format!(
            "excite {rig}.toml --out exc.csv --seconds 4 --no-table --quiet"
        ));
        desk.succeed(&format!(
            "simulate {rig}.toml --input exc.csv --out rec.csv --with-inputs --quiet"
        ));
        let (driven, out) = (
            columns(&desk.read("exc.csv")),
            columns(&desk.read("rec.csv")),
        );
        // Times and inputs go through as they were; every signal moves.
        assert_eq!(out[..driven.len()], driven[..], "{rig}");
        assert!(out.len() > driven.len(), "{rig} has no signals");
        for (name, values) in &out[driven.len()..] {
            let moves = values.iter().any(|v| (v - values[0]).abs() > 1e-6);
            assert!(
                moves && values.iter().all(|v| v.is_finite()),
                "{rig}: {name}"
            );
        }
    }
}

#[test]
fn noise_is_the_fraction_that_was_asked_and_follows_its_seed() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml");
    desk.succeed("excite mass-spring-damper.toml --out exc.csv --no-table --quiet");
    let simulate = |out: &str, more: &str| {
        desk.succeed(&format!(
            "simulate mass-spring-damper.toml --input exc.csv --out {out} --quiet {more}"
        ));
        columns(&desk.read(out)).swap_remove(1).1
    };
    let clean = simulate("clean.csv", "");
    let noisy = simulate("noisy.csv", "--noise 0.01 --seed 3");
    assert_eq!(noisy, simulate("again.csv", "--noise 0.01 --seed 3"));
    assert_ne!(noisy, simulate("other.csv", "--noise 0.01 --seed 4"));
    let low = clean.iter().copied().fold(f64::INFINITY, f64::min);
    let high = clean.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let squares: f64 = clean.iter().zip(&noisy).map(|(a, b)| (a - b).powi(2)).sum();
    let deviation = (squares / clean.len() as f64).sqrt();
    assert!((deviation / (0.01 * (high - low)) - 1.0).abs() < 0.1);
}

#[test]
fn the_table_says_what_shows_and_what_is_confused() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml");
    let said = desk.succeed("excite mass-spring-damper.toml --out exc.csv --seconds 10");
    let line = |kind: &str| said.lines().find(|line| line.trim().starts_with(kind));
    let friction = line("coulomb_friction").expect("every kind has its line");
    assert!(friction.contains("revealed      mass "), "{friction}");
    // What the rig fits already is not missing, however strong.
    let damping = line("viscous_damping").expect("every kind has its line");
    assert!(damping.contains("not revealed"), "{damping}");
    assert!(
        said.contains("constant_load at mass, gravity_load at mass")
            || said.contains("gravity_load at mass, constant_load at mass"),
        "{said}"
    );
}

#[test]
fn drawings_are_written_beside_the_simulation() {
    let desk = Desk::new();
    desk.bring("rigs/tendon.toml");
    desk.succeed("excite tendon.toml --out exc.csv --seconds 2 --no-table --quiet");
    desk.succeed(
        "simulate tendon.toml --input exc.csv --out rec.csv --plot rec.svg --report rec.html",
    );
    let (svg, html) = (desk.read("rec.svg"), desk.read("rec.html"));
    assert!(svg.starts_with("<svg xmlns=") && svg.contains("<title>u_x_rad</title>"));
    assert!(html.contains("Shape over time") && html.contains("\"waveguide\""));
    // A rig without a shape has its plots alone.
    desk.bring("rigs/mass-spring-damper.toml");
    desk.succeed("excite mass-spring-damper.toml --out msd.csv --seconds 2 --no-table --quiet");
    desk.succeed(
        "simulate mass-spring-damper.toml --input msd.csv --out sim.csv --report sim.html",
    );
    let html = desk.read("sim.html");
    assert!(html.contains("<title>q_m</title>") && !html.contains("Shape over time"));
}
