//! The order of the integrator, measured: away from events, across them, and across the kink of a
//! tendon that goes slack.

use crate::mechanisms::{RAMP, SPRING, distance, effect, run, slide, times};
use sinew_sim::Plant;

/// Error of the position at `end` against `exact`, with `steps` steps. The step must be the sample
/// interval itself, or the automatic choice of sub-steps would be what is measured.
fn error(plant: &Plant, steps: usize, end: f64, force: impl Fn(f64) -> f64, exact: f64) -> f64 {
    let times = times(steps + 1, end / steps as f64);
    let force: Vec<f64> = times.iter().map(|&t| force(t)).collect();
    let columns: Vec<&[f64]> = plant.inputs().iter().map(|_| force.as_slice()).collect();
    let run = run(plant, &times, &columns);
    assert_eq!(
        run.report.most_substeps, 1,
        "steps are not what was asked for"
    );
    (run.signal(steps, 0) - exact).abs()
}

/// Slope of log error over log step between the coarsest and the finest.
fn order(errors: &[f64]) -> f64 {
    let (first, last) = (errors[0], errors[errors.len() - 1]);
    assert!(first > 1e-13, "nothing to measure: {errors:?}");
    (first / last).log2() / (errors.len() - 1) as f64
}

/// A smooth nonlinear motion with a linear ramp: fourth order, in the largest error over all times
/// (against a run 32 times finer than the finest; the error at one time may cross zero).
#[test]
fn fourth_order_where_the_motion_is_smooth() {
    let cubic = effect("cubic_stiffness", "coil", &[("coefficient", 900.0)]);
    let drag = effect("quadratic_drag", "mass", &[("coefficient", 0.5)]);
    let plant = slide(0.2, 1.0, &format!("{SPRING}{RAMP}{cubic}{drag}"));
    let column = |steps: usize| {
        let times = times(steps + 1, 0.7 / steps as f64);
        let push: Vec<f64> = times.iter().map(|t| 30.0 * t).collect();
        let run = run(&plant, &times, &[&push]);
        assert_eq!(run.report.most_substeps, 1);
        run.column(0)
    };
    let fine = column(32 * 600);
    let largest = |steps: usize| {
        let every = 32 * 600 / steps;
        distance(&column(steps), fine.iter().step_by(every).copied())
    };
    let errors: Vec<f64> = [150, 300, 600].map(largest).to_vec();
    let order = order(&errors);
    println!("smooth: order {order:.2}, errors {errors:?}");
    assert!((3.8..4.4).contains(&order), "{order}: {errors:?}");
}

/// Three reversals of a dry oscillator inside the time, none on a sample: still fourth order, since
/// each is stepped to.
#[test]
fn fourth_order_across_reversals() {
    let friction = effect("coulomb_friction", "mass", &[("level", 0.5)]);
    let plant = slide(0.1, 0.0, &format!("{SPRING}{friction}"));
    let omega = 40f64.sqrt();
    let half = std::f64::consts::PI / omega;
    let end: f64 = 1.7;
    let cycle = (end / half).floor();
    assert_eq!(cycle, 3.0);
    let exact = -(0.0125 + (0.025 - 0.0125) * (omega * (end - 3.0 * half)).cos());
    let errors: Vec<f64> = [117, 234, 468]
        .iter()
        .map(|&steps| error(&plant, steps, end, |_| 0.0, exact))
        .collect();
    let order = order(&errors);
    println!("events: order {order:.2}, errors {errors:?}");
    assert!((3.5..4.6).contains(&order), "{order}: {errors:?}");
}

/// A tendon's tension has a kink where it goes slack, and that is not stepped to: a step across it
/// is taken in parts. Nearly fourth order at these steps, and never below second. The kink falls
/// anywhere in a step, so that one error says little: many starts are pooled.
#[test]
fn nearly_fourth_order_across_a_slack_tendon() {
    let pooled = |steps: usize| {
        let squares = (0..40).map(|k| {
            let line = "[[tendon]]\nname = \"line\"\npath = [{ body = \"mass\", arm = 1.0 }]\n\
                        stiffness = 40.0\n[[tendon]]\nname = \"back\"\n\
                        path = [{ body = \"mass\", arm = -1.0 }]\nstiffness = 160.0\n";
            let plant = slide(0.1 + 0.01 * f64::from(k), 0.0, line);
            // Half a period of each spring in turn brings it back to where it began.
            let quarter = std::f64::consts::FRAC_PI_2;
            let period = 2.0 * quarter * (1.0 / 40f64.sqrt() + 1.0 / 160f64.sqrt());
            let start = 0.1 + 0.01 * f64::from(k);
            // An end between two turning points, where an error in phase is seen.
            let end = 1.25 * period;
            let turn = quarter / 40f64.sqrt();
            let phase = 0.25 * period;
            let exact = if phase < turn {
                start * (40f64.sqrt() * phase).cos()
            } else {
                -start * 0.5 * (160f64.sqrt() * (phase - turn)).sin()
            };
            (error(&plant, steps, end, |_| 0.0, exact) / start).powi(2)
        });
        (squares.sum::<f64>() / 40.0).sqrt()
    };
    let errors: Vec<f64> = [190, 380, 760, 1520].map(pooled).to_vec();
    let order = order(&errors);
    println!("slack tendon: order {order:.2}, errors {errors:?}");
    assert!(order > 3.5, "{order}: {errors:?}");
}
