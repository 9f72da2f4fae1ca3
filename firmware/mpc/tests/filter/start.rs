//! Starts at rest and after a gap: each has a prior of its own.

use super::rules::{Bench, Mass, PRIOR, SETTINGS};
use sinew_mpc::filter::{Filter, Prior, Reading};

/// Model units a second: a plant that may move.
const WIDE: f32 = 10.0;
const STILL: Prior<2, 1, 2> = Prior {
    rest_deviation: [1.0, 0.01],
    state_deviation: [1.0, WIDE],
    ..PRIOR
};
const MOVING: Prior<2, 1, 2> = Prior {
    rest_deviation: STILL.state_deviation,
    ..STILL
};

/// Model units a second.
fn deviation_of_speed(bench: &Bench) -> f32 {
    f64::from(bench.filter.covariance().variance(1)).sqrt() as f32
}

fn bench(prior: Prior<2, 1, 2>, speed: f32) -> Bench {
    let mut bench = Bench::new(PRIOR.theta);
    bench.filter = Filter::new(prior, SETTINGS);
    bench.x[1] = speed;
    bench
}

/// Root mean square error of the speed over the first tenth of a second, with the command that
/// holds the spring.
fn error_of_the_first_readings(prior: Prior<2, 1, 2>) -> f32 {
    let mut sum = 0.0;
    for seed in 1..=20 {
        let mut bench = bench(prior, 0.0);
        bench.random.0 = seed;
        let hold = PRIOR.theta[1] * bench.x[0];
        for _ in 0..10 {
            bench.period(hold, |m| m);
            let error = bench.filter.x()[1] - bench.x[1];
            sum += error * error / 200.0;
        }
    }
    f64::from(sum).sqrt() as f32
}

#[test]
fn noise_of_the_first_readings_is_not_taken_for_motion_at_rest() {
    let (still, wide) = (
        error_of_the_first_readings(STILL),
        error_of_the_first_readings(MOVING),
    );
    assert!(5.0 * still < wide, "{still} {wide}");
}

#[test]
fn a_plant_that_moves_at_a_start_at_rest_is_followed_after_one_refused_period() {
    let mut bench = bench(STILL, WIDE);
    let uses: Vec<Reading> = (0..8).map(|_| bench.period(0.0, |m| m)).collect();
    let refused = uses.iter().filter(|use_| **use_ == Reading::Rejected);
    assert_eq!(refused.count(), 1, "{uses:?}");
    let error = (bench.filter.x()[1] - bench.x[1]).abs();
    assert!(error < 0.1 * bench.x[1].abs(), "{error} of {}", bench.x[1]);
}

#[test]
fn an_outlier_widens_the_state_at_the_start_alone() {
    for (periods, widens) in [(3, true), (200, false)] {
        let mut bench = bench(STILL, 0.0);
        for _ in 0..periods {
            bench.period(0.0, |m| m);
        }
        let before = deviation_of_speed(&bench);
        assert_eq!(bench.period(0.0, |m| m + 5.0), Reading::Rejected);
        let after = deviation_of_speed(&bench);
        assert_eq!(after > 10.0 * before, widens, "{before} {after}");
    }
}

#[test]
fn rest_is_believed_after_rest_and_not_after_a_gap() {
    let mut bench = bench(STILL, 0.0);
    assert!(deviation_of_speed(&bench) < 0.02);
    bench.excite(50);
    for _ in 0..=SETTINGS.max_missing_samples {
        bench.period(0.0, |_| f32::NAN);
    }
    assert!(bench.filter.is_lost());
    assert_eq!(deviation_of_speed(&bench), WIDE);
    bench.filter.rest();
    assert!(bench.filter.is_lost());
    assert!(deviation_of_speed(&bench) < 0.02);
    let known = bench.filter.covariance().variance(3);
    assert!(known < 0.09, "parameters are kept: {known}");
}

#[test]
fn an_estimate_that_breaks_down_does_not_believe_in_rest() {
    let mut bench = bench(STILL, 0.0);
    bench.excite(20);
    bench.filter.predict(&Mass, &[f32::NAN]);
    assert!(bench.filter.is_lost());
    assert_eq!(deviation_of_speed(&bench), WIDE);
}
