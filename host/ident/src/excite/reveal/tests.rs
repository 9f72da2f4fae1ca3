use sinew_sim::{Plant, Rig};

use super::{REVEALED, Revelation, WEAKLY, reveal};
use crate::excite::{Kind, Options, design};

/// A pushed slide on a spring, its damping free or not.
fn rig(damping: &str) -> Rig {
    let text = format!(
        "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"mass\"\nmotion = \"slide\"\n\
         inertia = {{ value = 1.0 }}\n\
         [[spring]]\nname = \"coil\"\nfrom = \"ground\"\nto = \"mass\"\nstiffness = {{ value = 40.0 }}\n\
         [[damper]]\nname = \"oil\"\nfrom = \"ground\"\nto = \"mass\"\ndamping = {damping}\n\
         [[actuator]]\nname = \"push\"\ndrives = \"mass\"\ninput = \"u_N\"\ngain = 1.0\nlimit = [-20.0, 20.0]\n\
         [[sensor]]\nname = \"encoder\"\nreads = \"mass.position\"\nsignal = \"q_m\"\n"
    );
    Rig::parse(&text, "x.toml").unwrap_or_else(|error| panic!("{error}"))
}

fn found(rig: &Rig, kind: Kind, noise: f64) -> Revelation {
    let plant = Plant::new(rig).expect("the rig is sound");
    let options = Options {
        kind,
        seconds: 10.0,
        rate_hz: 100.0,
        ..Options::default()
    };
    let experiment = design(&plant, "x.toml", &options).expect("the experiment can be designed");
    reveal(rig, &experiment, noise, &|_, _| {}).expect("the design runs")
}

fn distance(found: &Revelation, kind: &str, component: &str) -> f64 {
    let seen = found
        .effects
        .iter()
        .find(|seen| seen.kind.description().kind == kind && seen.component == component);
    seen.and_then(|seen| seen.distance)
        .unwrap_or_else(|| panic!("no {kind} at {component}"))
}

/// A damping that the rig fits already cannot be missing; where the rig holds it, it can.
#[test]
fn what_a_free_parameter_imitates_is_not_revealed() {
    let fitted = found(&rig("{ value = 1.2 }"), Kind::Mixed, 0.005);
    let held = found(&rig("1.2"), Kind::Mixed, 0.005);
    let [fitted, held] = [fitted, held].map(|f| distance(&f, "viscous_damping", "mass"));
    assert!(held > REVEALED, "{held}");
    assert!(fitted < WEAKLY, "{fitted} of {held}");
}

#[test]
fn the_same_experiment_is_measured_the_same() {
    let of = || {
        let found = found(&rig("{ value = 1.2 }"), Kind::Mixed, 0.005);
        found
            .effects
            .iter()
            .map(|seen| seen.distance)
            .collect::<Vec<_>>()
    };
    assert_eq!(of(), of());
}

#[test]
fn dry_friction_shows_and_less_so_in_more_noise() {
    let quiet = distance(
        &found(&rig("1.2"), Kind::Mixed, 0.005),
        "coulomb_friction",
        "mass",
    );
    let loud = distance(
        &found(&rig("1.2"), Kind::Mixed, 0.05),
        "coulomb_friction",
        "mass",
    );
    assert!(quiet > REVEALED, "{quiet}");
    assert!(
        (loud / quiet - 0.1).abs() < 1e-6,
        "noise weighs linearly: {loud} {quiet}"
    );
}

/// On a slide a constant force and gravity are one and the same.
#[test]
fn effects_that_are_the_same_are_confused() {
    let found = found(&rig("1.2"), Kind::Mixed, 0.005);
    let name = |index: usize| found.effects[index].kind.description().kind;
    let same = found.confusions.iter().find(|confusion| {
        let mut pair = confusion.pair.map(name);
        pair.sort_unstable();
        pair == ["constant_load", "gravity_load"]
    });
    assert!(same.is_some_and(|confusion| confusion.cosine > 0.999_999));
}

/// Drag grows with speed: a chirp tells it better from damping than slow triangles do.
#[test]
fn a_chirp_shows_more_of_a_drag_than_triangles() {
    let of = |kind| found(&rig("{ value = 1.2 }"), kind, 0.005);
    let (slow, fast) = (of(Kind::Triangle), of(Kind::Chirp));
    let kind = "quadratic_drag";
    let (slow, fast) = (distance(&slow, kind, "mass"), distance(&fast, kind, "mass"));
    assert!(fast > REVEALED, "{fast}");
    assert!(slow < 0.7 * fast, "{slow} {fast}");
}
