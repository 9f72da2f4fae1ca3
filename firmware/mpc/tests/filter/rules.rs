//! Gate, gaps, bounds, freeze and forgetting, on a mass of which only the position is read.

use sinew_mpc::estimator::Sample;
use sinew_mpc::filter::{
    Filter, FilterSettings, InvalidFilterSetting, MeasurementJacobian, Prior, Reading, StateSpace,
    TransitionJacobian,
};

use crate::common::Random;
use crate::linear::Linear;

pub const PERIOD_S: f32 = 0.01;

/// Mass on a spring: x = (position, speed), theta = (1/mass, stiffness over mass).
pub struct Mass;

impl StateSpace<2, 1, 1, 2> for Mass {
    type Trace = [f32; 4];
    const TRACE: Self::Trace = [0.0; 4];

    fn transition(
        &self,
        x: &[f32; 2],
        u: &[f32; 1],
        theta: &[f32; 2],
        trace: &mut Self::Trace,
    ) -> [f32; 2] {
        *trace = [x[0], u[0], theta[0], theta[1]];
        let speed = x[1] + PERIOD_S * (theta[0] * u[0] - theta[1] * x[0] - 0.5 * x[1]);
        [x[0] + PERIOD_S * speed, speed]
    }

    fn transition_jacobian(
        &self,
        &[x, u, push, spring]: &Self::Trace,
        jacobian: &mut TransitionJacobian<2, 1, 2>,
    ) {
        let speed = [-PERIOD_S * spring, 1.0 - 0.5 * PERIOD_S];
        jacobian.x = [[1.0 + PERIOD_S * speed[0], PERIOD_S * speed[1]], speed];
        jacobian.u = [[PERIOD_S * PERIOD_S * push], [PERIOD_S * push]];
        jacobian.theta[1] = [PERIOD_S * u, -PERIOD_S * x];
        jacobian.theta[0] = jacobian.theta[1].map(|value| PERIOD_S * value);
    }

    fn measure(&self, x: &[f32; 2], _: &[f32; 2]) -> [f32; 1] {
        [x[0]]
    }

    fn measurement_jacobian(
        &self,
        _: &[f32; 2],
        _: &[f32; 2],
        jacobian: &mut MeasurementJacobian<2, 1, 2>,
    ) {
        jacobian.x = [[1.0, 0.0]];
    }
}

pub type MassFilter = Filter<2, 1, 1, 2, 5>;

pub const PRIOR: Prior<2, 1, 2> = Prior {
    x: [0.0; 2],
    rest_deviation: [1.0, 1.0],
    state_deviation: [1.0, 1.0],
    disturbance_deviation: [0.0],
    theta: [1.0, 10.0],
    parameter_deviation: [0.3, 3.0],
    lower: [0.5, 5.0],
    upper: [2.0, 20.0],
};

pub const SETTINGS: FilterSettings<2, 1, 1, 2> = FilterSettings {
    state_noise: [0.0, 1e-4],
    disturbance_noise: [0.0],
    parameter_noise: [1e-3, 1e-2],
    measurement_noise: [0.01],
    gate: 5.0,
    adapt: true,
    max_missing_samples: 8,
};

/// The plant, its filter and the noise of the sensor.
pub struct Bench {
    pub filter: MassFilter,
    pub x: [f32; 2],
    pub theta: [f32; 2],
    pub random: Random,
}

impl Bench {
    pub fn new(theta: [f32; 2]) -> Self {
        Self {
            filter: Filter::new(PRIOR, SETTINGS),
            x: [0.3, 0.0],
            theta,
            random: Random(5),
        }
    }

    /// Reads with noise.
    pub fn reading(&mut self) -> f32 {
        // A sum of four has nearly the shape of a Gaussian; its deviation is 2/sqrt(3).
        let noise: f32 = (0..4).map(|_| self.random.signed()).sum();
        self.x[0] + 0.01 * noise / 1.1547
    }

    /// A period: reading, update, command.
    pub fn period(&mut self, u: f32, change: impl Fn(f32) -> f32) -> Reading {
        let reading = self.reading();
        let update = self.filter.update(&Mass, &[change(reading)]);
        self.filter.predict(&Mass, &[u]);
        self.x = Mass.transition(&self.x, &[u], &self.theta, &mut [0.0; 4]);
        update.readings[0]
    }

    /// Periods with an exciting command.
    pub fn excite(&mut self, periods: usize) {
        for k in 0..periods {
            self.period(if k / 37 % 2 == 0 { 4.0 } else { -4.0 }, |m| m);
        }
    }
}

const TRUE: [f32; 2] = [1.25, 8.0];

fn is_near(theta: &[f32; 2], share: f32) -> bool {
    theta
        .iter()
        .zip(&TRUE)
        .all(|(a, b)| (a - b).abs() < share * b)
}

#[test]
fn parameters_and_the_hidden_speed_are_found() {
    let mut bench = Bench::new(TRUE);
    assert!(!is_near(bench.filter.theta(), 0.1), "nothing to find");
    bench.excite(1000);
    assert!(
        is_near(bench.filter.theta(), 0.03),
        "{:?}",
        bench.filter.theta()
    );
    let error = bench.filter.x()[1] - bench.x[1];
    assert!(error.abs() < 0.03, "{error}");
}

#[test]
fn parameters_follow_a_step_of_the_plant() {
    let mut bench = Bench::new(PRIOR.theta);
    bench.excite(3000);
    bench.theta = TRUE;
    bench.excite(1000);
    assert!(
        is_near(bench.filter.theta(), 0.05),
        "{:?}",
        bench.filter.theta()
    );
}

#[test]
fn an_outlying_reading_changes_nothing() {
    let mut bench = Bench::new(TRUE);
    bench.excite(300);
    let mut with = bench.filter;
    let mut without = bench.filter;
    let update = with.update(&Mass, &[bench.x[0] + 1.0]);
    assert_eq!(update.readings, [Reading::Rejected]);
    assert_eq!(update.sample, Sample::Predicted);
    let _ = without.update(&Mass, &[f32::NAN]);
    assert_eq!((with.x(), with.theta()), (without.x(), without.theta()));
    assert_eq!(with.covariance(), without.covariance());
    // The same reading moves a filter without a gate.
    let mut open = bench.filter;
    open.settings_mut().gate = f32::INFINITY;
    let _ = open.update(&Mass, &[bench.x[0] + 1.0]);
    assert!((open.x()[0] - bench.x[0]).abs() > 0.02);
}

#[test]
fn a_wrong_estimate_behind_its_gate_starts_anew() {
    let mut bench = Bench::new(TRUE);
    bench.excite(300);
    // The plant is moved by hand, far beyond what the gate believes.
    bench.x = [-2.0, 0.0];
    let mut rejected = 0;
    while bench.period(0.0, |m| m) == Reading::Rejected {
        rejected += 1;
        assert!(rejected < 100);
    }
    assert_eq!(rejected, usize::from(SETTINGS.max_missing_samples) + 1);
    bench.excite(50);
    assert!((bench.filter.x()[0] - bench.x[0]).abs() < 0.02);
}

#[test]
fn a_short_gap_is_predicted_and_a_long_one_starts_anew() {
    let mut bench = Bench::new(TRUE);
    bench.excite(1000);
    let known = bench.filter.covariance().variance(3);
    let before = bench.filter.covariance().variance(0);
    for _ in 0..SETTINGS.max_missing_samples {
        bench.period(1.0, |_| f32::NAN);
        assert!(!bench.filter.is_lost());
    }
    assert!((bench.filter.x()[0] - bench.x[0]).abs() < 0.02);
    assert!(bench.filter.covariance().variance(0) > before);
    bench.period(1.0, |_| f32::NAN);
    assert!(bench.filter.is_lost());
    // The state is unknown again, the parameters are kept.
    assert_eq!(bench.filter.covariance().variance(0), 1.0);
    // What readings took may still be given back, a period's noise at a time.
    assert!(bench.filter.covariance().variance(3) <= known + 10.0 * 1e-6);
    assert!(is_near(bench.filter.theta(), 0.05));
    bench.x = [-1.0, 0.5];
    assert_eq!(bench.period(0.0, |m| m), Reading::Accepted);
    assert!((bench.filter.x()[0] - bench.x[0]).abs() < 0.05);
}

#[test]
fn parameters_stay_within_their_bounds() {
    // Stiffer and lighter than any device is believed to be.
    let mut bench = Bench::new([3.0, 30.0]);
    for k in 0..2000 {
        bench.period(if k / 37 % 2 == 0 { 4.0 } else { -4.0 }, |m| m);
        for i in 0..2 {
            let theta = bench.filter.theta()[i];
            assert!(
                (PRIOR.lower[i]..=PRIOR.upper[i]).contains(&theta),
                "{theta}"
            );
        }
    }
    assert!(bench.filter.theta()[1] > 19.9, "{:?}", bench.filter.theta());
}

#[test]
fn frozen_parameters_keep_their_value_and_variance() {
    let mut bench = Bench::new(TRUE);
    bench.excite(60);
    let (theta, variance) = (*bench.filter.theta(), bench.filter.covariance().variance(3));
    bench.filter.settings_mut().adapt = false;
    bench.excite(500);
    assert_eq!(*bench.filter.theta(), theta);
    let difference = bench.filter.covariance().variance(3) - variance;
    assert!(difference.abs() < 1e-3 * variance, "{difference}");
    assert_eq!(bench.filter.covariance().element(0, 3), 0.0);
    bench.filter.settings_mut().adapt = true;
    bench.excite(1000);
    assert!(
        is_near(bench.filter.theta(), 0.03),
        "{:?}",
        bench.filter.theta()
    );
}

#[test]
fn a_parameter_at_rest_neither_drifts_nor_becomes_uncertain() {
    let mut bench = Bench::new(TRUE);
    bench.excite(1000);
    for _ in 0..1000 {
        bench.period(0.0, |m| m);
    }
    let (theta, variance) = (*bench.filter.theta(), bench.filter.covariance().variance(3));
    for _ in 0..100_000 {
        bench.period(0.0, |m| m);
    }
    assert!(
        is_near(bench.filter.theta(), 0.05),
        "{:?}",
        bench.filter.theta()
    );
    let moved = (bench.filter.theta()[0] - theta[0]).abs();
    assert!(moved < 0.02, "{moved}");
    // The noise of so many periods would be 0.1 in sum.
    let grown = bench.filter.covariance().variance(3);
    assert!(grown < variance + 101.0 * 1e-6, "{variance} to {grown}");
}

#[test]
fn a_variance_never_exceeds_its_prior() {
    let mut bench = Bench::new(TRUE);
    bench.filter.settings_mut().parameter_noise = [0.1, 1.0];
    for k in 0..5000 {
        bench.period(if k / 500 % 2 == 0 { 0.0 } else { 3.0 }, |m| m);
        for i in 0..2 {
            let prior = PRIOR.parameter_deviation[i] * PRIOR.parameter_deviation[i];
            let variance = bench.filter.covariance().variance(3 + i);
            assert!(variance <= 1.001 * prior, "period {k}: {variance}");
        }
    }
}

#[test]
fn a_load_is_found_as_a_disturbance_of_the_input() {
    let mut bench = Bench::new(PRIOR.theta);
    let prior = Prior {
        disturbance_deviation: [1.0],
        parameter_deviation: [0.0; 2],
        ..PRIOR
    };
    bench.filter = Filter::new(
        prior,
        FilterSettings {
            disturbance_noise: [0.01],
            ..SETTINGS
        },
    );
    for _ in 0..1000 {
        let reading = bench.reading();
        let _ = bench.filter.update(&Mass, &[reading]);
        bench.filter.predict(&Mass, &[1.0]);
        bench.x = Mass.transition(&bench.x, &[1.7], &bench.theta, &mut [0.0; 4]);
    }
    let d = bench.filter.disturbance()[0];
    assert!((d - 0.7).abs() < 0.1, "{d}");
}

#[test]
fn the_first_reading_is_believed_however_narrow_the_prior() {
    let narrow = Prior {
        rest_deviation: [1e-3; 2],
        state_deviation: [1e-3; 2],
        ..PRIOR
    };
    let mut filter = MassFilter::new(narrow, SETTINGS);
    let update = filter.update(&Mass, &[1.5]);
    assert_eq!(update.readings, [Reading::Accepted]);
    filter.predict(&Mass, &[0.0]);
    let update = filter.update(&Mass, &[1.5]);
    assert_eq!(update.readings, [Reading::Rejected]);
}

#[test]
fn an_estimate_that_runs_away_starts_anew_at_once() {
    // A sensor that hardly answers, read at its end: the state would be a thousand times that.
    let mut model = Linear::<2, 1, 1, 2> {
        transition: TransitionJacobian::ZERO,
        measurement: MeasurementJacobian::ZERO,
    };
    model.measurement.x = [[1e-3, 0.0]];
    let settings = FilterSettings {
        measurement_noise: [1e-6],
        ..SETTINGS
    };
    let mut filter = MassFilter::new(PRIOR, settings);
    let update = filter.update(&model, &[1e6]);
    assert_eq!(update.sample, Sample::SignalLost);
    assert_eq!(*filter.x(), PRIOR.x);
}

#[test]
fn settings_out_of_their_range_are_named() {
    assert_eq!(SETTINGS.validate(), Ok(()));
    let wrong = FilterSettings {
        state_noise: [0.0, -1.0],
        ..SETTINGS
    };
    assert_eq!(wrong.validate(), Err(InvalidFilterSetting::StateNoise));
    let wrong = FilterSettings {
        disturbance_noise: [f32::NAN],
        ..SETTINGS
    };
    assert_eq!(
        wrong.validate(),
        Err(InvalidFilterSetting::DisturbanceNoise)
    );
    let wrong = FilterSettings {
        parameter_noise: [f32::INFINITY, 0.0],
        ..SETTINGS
    };
    assert_eq!(wrong.validate(), Err(InvalidFilterSetting::ParameterNoise));
    let wrong = FilterSettings {
        measurement_noise: [0.0],
        ..SETTINGS
    };
    assert_eq!(
        wrong.validate(),
        Err(InvalidFilterSetting::MeasurementNoise)
    );
    let wrong = FilterSettings {
        gate: f32::NAN,
        ..SETTINGS
    };
    assert_eq!(wrong.validate(), Err(InvalidFilterSetting::Gate));
}
