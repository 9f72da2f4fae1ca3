//! f32 factors against f64 matrices: 100,000 random periods, and random models.

use proptest::prelude::*;
use sinew_mpc::filter::{Filter, FilterSettings, Prior};

use crate::common::{Random, cases};
use crate::linear::Linear;
use crate::reference::Reference;

const NX: usize = 3;
const NU: usize = 1;
const NM: usize = 2;
const NP: usize = 2;
const NZ: usize = NX + NU + NP;

fn prior() -> Prior<NX, NU, NP> {
    Prior {
        x: [0.0; NX],
        rest_deviation: [1.0; NX],
        state_deviation: [1.0; NX],
        disturbance_deviation: [0.5],
        theta: [0.0; NP],
        parameter_deviation: [0.3; NP],
        lower: [-10.0; NP],
        upper: [10.0; NP],
    }
}

fn settings(noise: f32, reading: f32) -> FilterSettings<NX, NU, NM, NP> {
    FilterSettings {
        state_noise: [noise; NX],
        disturbance_noise: [0.1 * noise],
        parameter_noise: [0.0; NP],
        measurement_noise: [reading; NM],
        gate: f32::INFINITY,
        adapt: true,
        max_missing_samples: u16::MAX,
    }
}

fn square(deviation: f32) -> f64 {
    f64::from(deviation) * f64::from(deviation)
}

/// Largest errors over a run.
#[derive(Debug, Default)]
struct Errors {
    /// Of the mean, in the reference's standard deviations.
    mean: f64,
    /// Of the covariance, relative to the two standard deviations.
    covariance: f64,
    /// Covariances that were not positive semidefinite.
    indefinite: usize,
}

/// Runs both over random models of which some readings are missing.
fn compare(seed: u64, periods: usize, settings: FilterSettings<NX, NU, NM, NP>) -> Errors {
    let mut random = Random(seed);
    let mut filter: Filter<NX, NU, NM, NP, NZ> = Filter::new(prior(), settings);
    let variances = [1.0, 1.0, 1.0, 0.25, square(0.3), square(0.3)];
    let mut reference = Reference::new(vec![0.0; NZ], &variances);
    let q = square(settings.state_noise[0]);
    let noise = [q, q, q, square(settings.disturbance_noise[0])];
    let mut plant: [f32; NX] = [0.5, -0.5, 0.2];
    let theta: [f32; NP] = random.array(0.3);
    let mut errors = Errors::default();
    for k in 0..periods {
        let model = Linear::<NX, NU, NM, NP>::random(&mut random);
        let clean = sinew_mpc::StateSpace::measure(&model, &plant, &theta);
        let readings: [f32; NM] = core::array::from_fn(|i| {
            let missing = k > 0 && random.unit() < 0.2;
            let noise = settings.measurement_noise[i] * random.signed();
            if missing { f32::NAN } else { clean[i] + noise }
        });
        let _ = filter.update(&model, &readings);
        let r = square(settings.measurement_noise[0]);
        reference.update(&model, &readings, r);
        let estimate = filter.x().iter().chain(filter.disturbance());
        for (i, value) in estimate.chain(filter.theta()).enumerate() {
            let error = (f64::from(*value) - reference.z[i]).abs() / reference.deviation(i);
            errors.mean = errors.mean.max(error);
        }
        for r in 0..NZ {
            for c in 0..NZ {
                let exact = reference.p[r][c];
                let error = (f64::from(filter.covariance().element(r, c)) - exact).abs();
                let scale = reference.deviation(r) * reference.deviation(c);
                errors.covariance = errors.covariance.max(error / scale);
            }
        }
        errors.indefinite += usize::from(!filter.covariance().is_valid());
        let u: [f32; NU] = random.array(1.0);
        filter.predict(&model, &u);
        reference.predict(&model, &u, &noise);
        plant = sinew_mpc::StateSpace::transition(&model, &plant, &u, &theta, &mut ());
        for x in &mut plant {
            *x += settings.state_noise[0] * random.signed();
        }
    }
    errors
}

#[test]
fn a_hundred_thousand_periods_neither_drift_nor_become_indefinite() {
    let errors = compare(7, 100_000, settings(0.03, 0.1));
    println!("{errors:?}");
    assert_eq!(errors.indefinite, 0);
    assert!(errors.mean < 0.02, "{errors:?}");
    assert!(errors.covariance < 5e-4, "{errors:?}");
}

/// Readings a thousand times as exact as the prior: where P - K h P fails in f32.
#[test]
fn exact_readings_leave_a_valid_covariance() {
    let errors = compare(11, 2_000, settings(0.01, 1e-3));
    println!("{errors:?}");
    assert_eq!(errors.indefinite, 0);
    assert!(errors.covariance < 1e-4, "{errors:?}");
}

proptest! {
    #![proptest_config(cases(50))]
    #[test]
    fn random_noise_levels_agree(
        seed in 1_u64..1 << 40,
        state in -3.0_f32..0.0,
        reading in -2.0_f32..0.5,
    ) {
        let errors = compare(seed, 200, settings(10_f64.powf(f64::from(state)) as f32,
            10_f64.powf(f64::from(reading)) as f32));
        prop_assert_eq!(errors.indefinite, 0);
        prop_assert!(errors.covariance < 1e-3, "{:?}", errors);
        prop_assert!(errors.mean < 0.01, "{:?}", errors);
    }
}
