use super::rest;
use crate::mechanisms::{RAMP, SPRING, effect, slide, times};
use sinew_sim::{InputTrajectory, Plant, RestInterval};

fn intervals(plant: &Plant, input: f64) -> Vec<RestInterval> {
    let found = rest(plant, &[input]);
    plant
        .rest_intervals(&plant.values(), &[input], &found.state)
        .unwrap()
}

fn ends(interval: &RestInterval) -> [f64; 2] {
    let end = |end: usize| interval.ends[end].as_ref().expect("an end").signals[0];
    [end(0), end(1)]
}

#[test]
fn dry_friction_leaves_level_over_stiffness_on_both_sides() {
    let friction = effect(
        "direction_dependent_friction",
        "mass",
        &[
            ("level_pos", 2.0),
            ("level_neg", 3.0),
            ("damping_pos", 0.0),
            ("damping_neg", 0.0),
        ],
    );
    let found = intervals(&slide(0.0, 0.0, &format!("{SPRING}{RAMP}{friction}")), 8.0);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].component, "mass.direction_dependent_friction");
    assert_eq!(found[0].hold, [2.0, 3.0]);
    let [low, high] = ends(&found[0]);
    assert!((low - 0.15).abs() < 1e-14 && (high - 0.275).abs() < 1e-14);
}

/// A mass that is released just inside an end stays, and just outside it moves.
#[test]
fn the_simulator_rests_inside_the_interval_and_not_outside() {
    let friction = effect("coulomb_friction", "mass", &[("level", 2.0)]);
    let weight = "[[gravity]]\nname = \"weight\"\nbody = \"mass\"\namplitude = 5.0\n";
    let plant = slide(0.0, 0.0, &format!("{SPRING}{RAMP}{friction}{weight}"));
    let [low, high] = ends(&intervals(&plant, 8.0)[0]);
    let inward = 1e-9;
    for (start, stays) in [
        (low + inward, true),
        (high - inward, true),
        (low - inward, false),
        (high + inward, false),
    ] {
        let times = times(3, 0.01);
        let input = [8.0; 3];
        let drive = InputTrajectory::new(&plant, 3, &[&input]).unwrap();
        let run = plant.simulate(&plant.values(), &[start, 0.0], &drive, &times);
        assert_eq!(run.unwrap().signal(2, 0) == start, stays, "{start}");
    }
}

#[test]
fn presliding_friction_leaves_an_interval_of_its_whole_level() {
    let law = effect(
        "presliding_friction",
        "mass",
        &[("level", 2.0), ("distance", 0.01)],
    );
    let found = intervals(&slide(0.0, 0.0, &format!("{SPRING}{RAMP}{law}")), 4.0);
    assert_eq!(found[0].component, "mass.presliding_friction");
    assert_eq!(found[0].hold, [2.0; 2]);
    let [low, high] = ends(&found[0]);
    assert!((low - 2.0 / 40.0).abs() < 1e-14 && (high - 6.0 / 40.0).abs() < 1e-14);
}

#[test]
fn a_plastic_branch_leaves_an_interval_of_its_largest_force() {
    let law = effect(
        "plastic_set",
        "coil",
        &[("stiffness", 100.0), ("yield_extension", 0.02)],
    );
    let found = intervals(&slide(0.0, 0.0, &format!("{SPRING}{RAMP}{law}")), 4.0);
    assert_eq!(found[0].component, "coil.plastic_set");
    assert_eq!(found[0].hold, [2.0; 2]);
    let [low, high] = ends(&found[0]);
    assert!((low - 2.0 / 40.0).abs() < 1e-14 && (high - 6.0 / 40.0).abs() < 1e-14);
}

#[test]
fn hysteresis_and_play_leave_intervals_too() {
    let loop_ = effect(
        "hysteresis",
        "coil",
        &[
            ("alpha", 8.0),
            ("beta", 3.0),
            ("gamma", 1.0),
            ("exponent", 2.0),
        ],
    );
    let play = effect("backlash", "push", &[("gap", 0.4)]);
    let found = intervals(
        &slide(0.0, 0.0, &format!("{SPRING}{RAMP}{loop_}{play}")),
        4.0,
    );
    let names: Vec<&str> = found.iter().map(|found| found.component.as_str()).collect();
    assert_eq!(names, ["coil.hysteresis", "push.backlash"]);
    // (1 / (beta + gamma))^(1/2) = 1/2 of the state, 4 N; the play comes from zero: 3.8 N.
    let [low, high] = ends(&found[0]);
    assert!((low + 0.2 / 40.0).abs() < 1e-14 && (high - 7.8 / 40.0).abs() < 1e-14);
    let [low, high] = ends(&found[1]);
    assert!((low - 3.8 / 40.0).abs() < 1e-14 && (high - 4.2 / 40.0).abs() < 1e-14);
}
