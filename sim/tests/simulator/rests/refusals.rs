use super::rest;
use crate::mechanisms::{RAMP, SPRING, plant, slide};
use sinew_sim::{NoRest, Plant, SimulationError};

fn reason(plant: &Plant, inputs: &[f64]) -> (String, NoRest) {
    let start = vec![0.0; plant.state_len()];
    match plant.rest(&plant.values(), inputs, &start) {
        Err(SimulationError::NoRest { at, reason }) => (at.body, reason),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_free_mass_is_refused_with_and_without_a_force() {
    let free = slide(0.0, 0.0, RAMP);
    assert_eq!(reason(&free, &[0.0]), ("mass".into(), NoRest::Free));
    assert_eq!(reason(&free, &[1.0]), ("mass".into(), NoRest::Free));
}

#[test]
fn the_one_body_of_two_that_nothing_holds_is_named() {
    let two = slide(
        0.0,
        0.0,
        &format!("{SPRING}[[body]]\nname = \"loose\"\nmotion = \"slide\"\ninertia = 1.0\n"),
    );
    assert_eq!(reason(&two, &[]), ("loose".into(), NoRest::Free));
}

#[test]
fn a_pendulum_that_stands_is_refused_as_unstable() {
    let standing = plant(
        "[[body]]\nname = \"rod\"\nmotion = \"hinge\"\ninertia = 0.2\n\
         [[gravity]]\nname = \"weight\"\nbody = \"rod\"\namplitude = -2.0\n",
    );
    assert_eq!(reason(&standing, &[]), ("rod".into(), NoRest::Unstable));
    // A hair beside it, it falls and hangs.
    let found = standing
        .rest(&standing.values(), &[], &[1e-6, 0.0])
        .unwrap();
    assert!((found.state[0].abs() - std::f64::consts::PI).abs() < 1e-12);
}

#[test]
fn numbers_and_shapes_are_checked_before_the_search() {
    let plant = slide(0.0, 0.0, &format!("{SPRING}{RAMP}"));
    let values = plant.values();
    let error = plant.rest(&values, &[f64::NAN], &[0.0; 2]).unwrap_err();
    assert_eq!(error.to_string(), "`u_N` is not a finite number");
    let error = plant.rest(&values, &[], &[0.0; 2]).unwrap_err();
    assert_eq!(error.to_string(), "inputs: expected 1 numbers, found 0");
    let found = rest(&plant, &[1.0]);
    assert_eq!(found.state.len(), 2);
}
