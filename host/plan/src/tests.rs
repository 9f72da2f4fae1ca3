//! Derivatives, limits and errors; whole plans are in `tests/`.

use std::path::Path;

use proptest::prelude::*;
use sinew_sim::{Plant, Rig};

use crate::derivatives::Direction;
use crate::{Goal, Options, PlanProblem};

/// A sled with dry friction, and a second mass beyond a gap of 50 mm.
const SLED: &str = include_str!("../tests/sled.toml");

fn plant(text: &str) -> Plant {
    let rig = Rig::parse(text, "sled.toml").unwrap_or_else(|error| panic!("{error}"));
    Plant::new(&rig).expect("the rig is sound")
}

fn problem(goals: &[&str], options: &Options) -> PlanProblem {
    let goals: Vec<Goal> = goals
        .iter()
        .map(|goal| Goal::parse(goal).expect("a goal"))
        .collect();
    PlanProblem::new(&plant(SLED), Path::new("sled.toml"), &goals, None, options)
        .expect("a problem")
}

fn pushing(problem: &PlanProblem) -> Vec<f64> {
    let mut x: Vec<f64> = (0..problem.variables())
        .map(|k| 0.6 - 0.05 * (k as f64) + 0.1 * (k as f64).sin())
        .collect();
    problem.project(&mut x);
    x
}

/// Forwards, backwards and by differences, on the path and under the hard laws.
#[test]
fn derivatives_agree_in_both_directions() {
    let options = Options {
        knots: 10,
        ..Options::default()
    };
    let problem = problem(
        &["second_ruler = 0.12 at 1.0 s", "sled_ruler = 0.1 at 0.5 s"],
        &options,
    );
    let x = pushing(&problem);
    for smoothing in [0.05, 0.0] {
        let forward = problem
            .jacobian(smoothing, &x, Direction::Forward)
            .expect("the plan is simulated");
        let backward = problem
            .jacobian(smoothing, &x, Direction::Backward)
            .expect("the plan is simulated");
        let largest = forward.amax();
        assert!(largest > 1e-3, "nothing moves at {smoothing}");
        let difference = (&forward - &backward).amax();
        assert!(difference < 1e-9 * largest, "{smoothing}: {difference}");
        for variable in 0..problem.variables() {
            let by = |h: f64| {
                let mut moved = x.clone();
                moved[variable] += h;
                problem
                    .readings(smoothing, &moved)
                    .expect("the plan is simulated")
            };
            let (above, below) = (by(3e-4), by(-3e-4));
            for target in 0..2 {
                let slope = (above[target] - below[target]) / 6e-4;
                let error = (slope - forward[(target, variable)]).abs();
                let most = if smoothing > 0.0 { 1e-2 } else { 2e-2 };
                assert!(
                    error < most * largest,
                    "{smoothing} {target} {variable}: {slope} {} {largest}",
                    forward[(target, variable)]
                );
            }
        }
    }
}

/// From rest the hard laws have no slope, and the path has one: why there is a path.
#[test]
fn only_the_path_has_a_slope_from_rest() {
    let problem = problem(&["second.position = 0.12 at 1.5 s"], &Options::default());
    let slope = |smoothing: f64| {
        let jacobian = problem.jacobian(smoothing, &problem.rest(), Direction::Forward);
        jacobian.expect("the plan is simulated").amax()
    };
    assert_eq!(slope(0.0), 0.0);
    assert!(slope(0.1) > 1e-4, "{}", slope(0.1));
}

proptest! {
    /// Whatever is wanted, as the file's rows give it.
    #[test]
    fn commands_keep_limits_and_rate_limits(
        wanted in proptest::collection::vec(-3.0..3.0f64, 24), low in -9.0..0.0f64,
        span in 0.01..20.0f64, rate in 0.5..500.0f64, rate_hz in 20.0..500.0f64,
    ) {
        let high = low + span;
        let limits = format!("limit = [{low:?}, {high:?}]\nrate_limit = {rate:?}");
        let text = SLED.replace("limit = [-20.0, 20.0]\nrate_limit = 200.0", &limits);
        let plant = plant(&text);
        let options = Options { rate_hz, ..Options::default() };
        let goal = Goal::parse("sled.position = 0.1 at 1.5 s").expect("a goal");
        let problem = PlanProblem::new(&plant, Path::new("x.toml"), &[goal], None, &options)
            .expect("a problem");
        let mut x = wanted;
        problem.project(&mut x);
        let t = &problem.layout.t;
        let u = &problem.layout.commands(&x)[0];
        for row in 0..u.len() {
            prop_assert!(u[row] >= low && u[row] <= high, "row {row}: {}", u[row]);
            if row > 0 {
                let (change, seconds) = (u[row] - u[row - 1], t[row] - t[row - 1]);
                prop_assert!(change.abs() <= rate * seconds, "row {row}: {change}");
            }
        }
    }
}

/// Plain simulations that a pass with derivatives stands for, measured; prints them.
#[test]
#[ignore = "a measurement: run it alone"]
fn a_pass_costs_what_it_counts_for() {
    let options = Options {
        knots: 8,
        ..Options::default()
    };
    let problem = problem(&["second_ruler = 0.12 at 1.5 s"], &options);
    let x = pushing(&problem);
    let seconds = |work: &dyn Fn()| {
        let begun = std::time::Instant::now();
        (0..20).for_each(|_| work());
        begun.elapsed().as_secs_f64()
    };
    let plain = seconds(&|| drop(problem.readings(0.0, &x)));
    for (direction, counted) in [(Direction::Forward, 4.0), (Direction::Backward, 10.0)] {
        let ratio = seconds(&|| drop(problem.jacobian(0.0, &x, direction))) / plain;
        println!("{direction:?}: {ratio:.1} plain simulations, counted as {counted}");
        assert!(ratio < 2.0 * counted, "{direction:?}: {ratio}");
    }
}
