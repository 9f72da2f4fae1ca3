//! Devices found by the search have the statistics that were released.

use rand::SeedableRng;
use rand_chacha::{ChaCha8Rng, ChaCha20Rng};
use sinew_ident::noise::gaussian;
use sinew_share::statistics::{expected_error, means};
use sinew_share::{Budget, Release, enough, synthesise};

/// Places of devices that differ, two of three coordinates together.
fn fleet(count: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let draw = |_| {
        let (a, b) = (gaussian(&mut random), gaussian(&mut random));
        vec![0.3 + 0.1 * a, -0.2 + 0.08 * a + 0.05 * b, 0.15 * b]
    };
    (0..count).map(draw).collect()
}

#[test]
fn many_devices_are_told_almost_exactly() {
    let places = fleet(20_000, 1);
    let budget = Budget {
        epsilon: 4.0,
        delta: 1e-6,
    };
    let release = Release::new(&places, &budget, ChaCha20Rng::seed_from_u64(2));
    let shared = synthesise(&release, 100, 3);
    assert_eq!(shared.places.len(), 100);
    for (true_mean, own) in means(&places).iter().zip(means(&shared.places)) {
        assert!((true_mean - own).abs() < 2e-3, "{true_mean} {own}");
    }
}

#[test]
fn the_error_is_the_one_that_was_foretold() {
    let budget = Budget {
        epsilon: 2.0,
        delta: 1e-5,
    };
    let devices = 300;
    let places = fleet(devices, 4);
    let wanted = means(&places);
    let foretold = expected_error(3, devices, &budget);
    let mut squares = 0.0;
    for seed in 0..30 {
        let release = Release::new(&places, &budget, ChaCha20Rng::seed_from_u64(seed));
        let own = means(&synthesise(&release, 60, seed).places);
        squares += (0..3).map(|k| (own[k] - wanted[k]).powi(2)).sum::<f64>() / 90.0;
    }
    let ratio = squares.sqrt() / foretold;
    assert!((0.7..1.3).contains(&ratio), "{ratio}");
}

#[test]
fn a_fleet_of_the_size_that_is_asked_for_is_enough_and_one_less_is_not() {
    let budget = Budget {
        epsilon: 1.0,
        delta: 1e-6,
    };
    let devices = enough(4, &budget, 0.05);
    assert!(expected_error(4, devices, &budget) <= 0.05);
    assert!(expected_error(4, devices - 1, &budget) > 0.05);
}

#[test]
fn noise_that_hides_the_covariance_still_gives_devices_within_the_region() {
    let budget = Budget {
        epsilon: 0.1,
        delta: 1e-6,
    };
    for count in [1, 3, 12] {
        let release = Release::new(&fleet(12, 5), &budget, ChaCha20Rng::seed_from_u64(6));
        let shared = synthesise(&release, count, 7);
        assert_eq!(shared.places.len(), count);
        for place in shared.places {
            assert!(
                place.iter().map(|x| x * x).sum::<f64>() <= 1.0 + 1e-9,
                "{place:?}"
            );
        }
    }
}
