//! Any bits as readings, commands, prior and settings: no panic, and recovery afterwards.

use proptest::prelude::*;
use sinew_mpc::filter::{Filter, FilterSettings, LateFilter, Prior};

use crate::common::cases;
use crate::rules::{Mass, MassFilter, PRIOR, SETTINGS};

fn any_bits() -> impl Strategy<Value = f32> {
    prop_oneof![any::<u32>().prop_map(f32::from_bits), -2.0_f32..2.0]
}

fn plausible(filter: &MassFilter) -> bool {
    let estimate = filter.x().iter().chain(filter.disturbance());
    filter.covariance().is_valid() && estimate.chain(filter.theta()).all(|v| v.is_finite())
}

proptest! {
    #![proptest_config(cases(400))]
    #[test]
    fn hostile_readings_leave_numbers_and_the_filter_recovers(
        values in prop::collection::vec((any_bits(), any_bits()), 40),
    ) {
        let mut filter: MassFilter = Filter::new(PRIOR, SETTINGS);
        for (reading, u) in &values {
            let _ = filter.update(&Mass, &[*reading]);
            prop_assert!(plausible(&filter), "{:?}", filter);
            filter.predict(&Mass, &[*u]);
            prop_assert!(plausible(&filter), "{:?}", filter);
        }
        // The plant rests at 0.
        for _ in 0..400 {
            let _ = filter.update(&Mass, &[0.0]);
            filter.predict(&Mass, &[0.0]);
        }
        prop_assert!(filter.x()[0].abs() < 0.02, "{:?}", filter.x());
        for i in 0..2 {
            let theta = filter.theta()[i];
            prop_assert!((PRIOR.lower[i]..=PRIOR.upper[i]).contains(&theta));
        }
    }

    #[test]
    fn hostile_settings_and_priors_do_no_harm(
        noise in prop::array::uniform7(any_bits()),
        gate in any_bits(),
        adapt in any::<bool>(),
        deviations in prop::array::uniform5(any_bits()),
        values in prop::collection::vec((any_bits(), any_bits()), 20),
        age in 0_usize..6,
    ) {
        let settings = FilterSettings {
            state_noise: [noise[0], noise[1]],
            disturbance_noise: [noise[2]],
            parameter_noise: [noise[3], noise[4]],
            measurement_noise: [noise[5]],
            gate,
            adapt,
            max_missing_samples: 3,
        };
        let prior = Prior {
            rest_deviation: [deviations[1], deviations[0]],
            state_deviation: [deviations[0], deviations[1]],
            disturbance_deviation: [deviations[2]],
            parameter_deviation: [deviations[3], deviations[4]],
            ..PRIOR
        };
        let mut late: LateFilter<2, 1, 1, 2, 5, 4> = LateFilter::new(Filter::new(prior, settings));
        for (reading, u) in &values {
            let _ = late.update(&Mass, &[*reading]);
            let _ = late.late(&Mass, age, &[*u]);
            late.predict(&Mass, &[*u]);
            prop_assert!(plausible(late.filter()), "{:?}", late);
        }
    }
}
