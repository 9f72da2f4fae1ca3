use std::path::Path;

use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::noise::gaussian;

/// Devices of N(`mean`, `root root'`), each seen with errors of the covariance `error error'`.
fn drawn(
    count: usize,
    (mean, root, error): (&[f64], &DMatrix<f64>, &DMatrix<f64>),
    seed: u64,
) -> Vec<Device> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let size = mean.len();
    let mut normal = || DVector::from_fn(size, |_, _| gaussian(&mut random));
    let mean = DVector::from_row_slice(mean);
    let precision = (error * error.transpose()).try_inverse().unwrap();
    let device = |_| Device {
        at: &mean + root * normal() + error * normal(),
        precision: precision.clone(),
    };
    (0..count).map(device).collect()
}

fn all(devices: &[Device]) -> Vec<&Device> {
    devices.iter().collect()
}

#[test]
fn without_errors_the_estimate_is_the_sample_covariance() {
    let root = DMatrix::from_row_slice(2, 2, &[0.3, 0.0, 0.2, 0.1]);
    let devices = drawn(
        9,
        (&[1.0, -2.0], &root, &(DMatrix::identity(2, 2) * 1e-7)),
        3,
    );
    let found = population(&all(&devices)).unwrap();
    let mean = devices.iter().map(|it| &it.at).sum::<DVector<f64>>() / 9.0;
    let about = devices.iter().map(|it| &it.at - &mean);
    let sample = about.map(|it| &it * it.transpose()).sum::<DMatrix<f64>>() / 8.0;
    assert!((&found.mean - &mean).amax() < 1e-9);
    for axis in 0..2 {
        let (found, sample) = (found.covariance[(axis, axis)], sample[(axis, axis)]);
        assert!((found / sample - 1.0).abs() < 1e-5, "{found} {sample}");
    }
    let kept = found.covariance[(0, 1)] / sample[(0, 1)];
    assert!((kept - (1.0 - found.shrinkage)).abs() < 1e-5, "{kept}");
    let of_mean = found.of_mean[(0, 0)] * 9.0 / found.covariance[(0, 0)];
    assert!((of_mean - 1.0).abs() < 1e-5, "{of_mean}");
}

#[test]
fn a_known_population_seen_with_known_errors_is_recovered() {
    let root = DMatrix::from_row_slice(2, 2, &[0.3, 0.0, 0.24, 0.18]);
    let error = DMatrix::from_row_slice(2, 2, &[0.25, 0.0, -0.1, 0.3]);
    let truth = &root * root.transpose();
    let devices = drawn(4000, (&[0.5, 3.0], &root, &error), 1);
    let found = population(&all(&devices)).unwrap();
    assert!((found.mean[0] - 0.5).abs() < 0.02 && (found.mean[1] - 3.0).abs() < 0.02);
    // Of 4,000 devices a variance of 0.15 in all is known to 0.15 sqrt(2 / 4000) = 0.0034.
    assert!((&found.covariance - &truth).amax() < 0.012, "{found:?}");
    assert!(found.shrinkage < 0.01);
    let mean = devices.iter().map(|it| &it.at).sum::<DVector<f64>>() / 4000.0;
    let about = devices.iter().map(|it| &it.at - &mean);
    let spread = about.map(|it| &it * it.transpose()).sum::<DMatrix<f64>>() / 4000.0;
    assert!((spread - truth).amax() > 0.05, "no error to take out");
}

#[test]
fn a_coordinate_that_a_device_does_not_show_counts_for_nothing() {
    let root = DMatrix::from_row_slice(2, 2, &[0.3, 0.0, 0.0, 0.2]);
    let mut devices = drawn(
        8,
        (&[0.0, 0.0], &root, &(DMatrix::identity(2, 2) * 0.05)),
        5,
    );
    devices[2].precision[(1, 1)] = 0.0;
    let hidden = |value: f64| {
        let mut devices = devices.clone();
        devices[2].at[1] = value;
        population(&all(&devices)).unwrap()
    };
    assert_eq!(hidden(0.1), hidden(1e3));
    for device in &mut devices[..6] {
        device.precision[(1, 1)] = 0.0;
    }
    assert!(population(&all(&devices)).is_none(), "two devices show it");
}

/// Part of new devices of a known population that lie in the central 90 % of each parameter's
/// distribution, over populations of `devices` each: widened for few devices, or not.
fn held(devices: usize, widened: bool) -> f64 {
    let root = DMatrix::from_row_slice(3, 3, &[0.3, 0.0, 0.0, 0.2, 0.2, 0.0, -0.1, 0.05, 0.15]);
    let error = DMatrix::identity(3, 3) * 0.02;
    let (mut inside, mut of) = (0, 0);
    for seed in 0..100 {
        let fleet = drawn(devices, (&[0.0; 3], &root, &error), seed);
        let found = population(&all(&fleet)).unwrap();
        let new = drawn(20, (&[0.0; 3], &root, &(&error * 1e-6)), 1000 + seed);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let law = if widened {
            let covariance = found.of_a_new_device();
            Draws::new(found.mean.clone(), covariance, found.freedom())
        } else {
            Draws::new(found.mean.clone(), found.covariance.clone(), 100)
        };
        let draws: Vec<DVector<f64>> = (0..400).map(|_| law.draw(&mut random)).collect();
        for axis in 0..3 {
            let mut sorted: Vec<f64> = draws.iter().map(|it| it[axis]).collect();
            sorted.sort_by(f64::total_cmp);
            let band = sorted[19]..=sorted[380];
            inside += new.iter().filter(|it| band.contains(&it.at[axis])).count();
            of += new.len();
        }
    }
    f64::from(u32::try_from(inside).unwrap()) / f64::from(u32::try_from(of).unwrap())
}

#[test]
fn nine_in_ten_of_new_devices_lie_in_the_band_of_a_dozen() {
    let (widened, not) = (held(12, true), held(12, false));
    assert!((0.88..0.95).contains(&widened), "{widened}");
    assert!(not < widened - 0.02, "{not}");
}

#[test]
fn three_devices_say_how_many_more_it_takes() {
    let root = DMatrix::from_row_slice(2, 2, &[0.3, 0.0, 0.24, 0.18]);
    let error = DMatrix::identity(2, 2) * 0.02;
    let of =
        |count: usize| population(&all(&drawn(count, (&[0.0, 0.0], &root, &error), 2))).unwrap();
    let few = of(3);
    assert!(few.cost_of_few() > 1.6 && few.freedom() == 3, "{few:?}");
    assert!((5..20).contains(&few.missing()), "{}", few.missing());
    let many = of(30);
    assert!(many.missing() == 0 && many.cost_of_few() < 1.1);
}

#[test]
fn the_device_that_is_not_of_the_fleet_is_named() {
    let root = DMatrix::from_row_slice(2, 2, &[0.1, 0.0, 0.05, 0.1]);
    let error = DMatrix::identity(2, 2) * 0.02;
    let mut devices = drawn(12, (&[0.0, 1.0], &root, &error), 4);
    let (sound, judged) = members(&devices, false).unwrap();
    assert_eq!(sound.devices, 12);
    assert!(judged.iter().all(|it| it.outlier.is_none()));
    devices[6].at[1] += 1.0;
    let (found, judged) = members(&devices, false).unwrap();
    let named: Vec<_> = judged.iter().map(|it| it.outlier).collect();
    assert_eq!(named[6], Some(1));
    assert_eq!(named.iter().flatten().count(), 1);
    assert!(judged[6].deviations[1].unwrap() > 5.0, "{:?}", judged[6]);
    assert_eq!(found.devices, 11);
    let (kept, _) = members(&devices, true).unwrap();
    assert!(kept.covariance[(1, 1)] > 3.0 * found.covariance[(1, 1)]);
}

#[test]
fn sound_fleets_seldom_have_an_outlier() {
    let root = DMatrix::from_row_slice(2, 2, &[0.1, 0.0, 0.05, 0.1]);
    let error = DMatrix::identity(2, 2) * 0.05;
    let false_alarms = (0..100).filter(|&seed| {
        let devices = drawn(10, (&[0.0, 1.0], &root, &error), seed);
        let (_, judged) = members(&devices, false).unwrap();
        judged.iter().any(|it| it.outlier.is_some())
    });
    let count = false_alarms.count();
    assert!(
        count <= 22,
        "{count} of 200, at most one in twenty expected"
    );
}

fn fleet() -> Fleet {
    Fleet {
        file: "fleet.toml".into(),
        rig: "cart \"A\"".into(),
        axes: vec![
            Axis {
                name: "cart.inertia".into(),
                unit: "kg".into(),
                scale: Scale::Log,
                mean: 2.0,
            },
            Axis {
                name: "encoder.offset".into(),
                unit: "m".into(),
                scale: Scale::Linear,
                mean: -0.001,
            },
        ],
        covariance: DMatrix::from_row_slice(2, 2, &[0.01, 1e-5, 1e-5, 1e-6]),
        of_mean: DMatrix::from_row_slice(2, 2, &[0.001, 0.0, 0.0, 1e-7]),
        widening: 1.7,
        freedom: 9,
        members: vec![Member {
            name: "a".into(),
            recordings: vec!["a.csv".into()],
            outlier: Some("cart.inertia".into()),
            values: vec![("cart.inertia".into(), 3.0)],
        }],
    }
}

#[test]
fn a_file_says_what_was_written() {
    let fleet = fleet();
    let read = Fleet::parse(&fleet.to_toml(), Path::new("fleet.toml")).unwrap();
    assert_eq!(read, fleet);
}

#[test]
fn what_is_wrong_with_a_file_is_said_with_its_line() {
    let text = fleet().to_toml();
    for (from, to, said) in [
        (
            "sinew-fleet/1",
            "sinew-fleet/2",
            "fleet.toml:3:1: the format is `sinew-fleet/2`",
        ),
        (
            "\"linear\"",
            "\"cubic\"",
            "fleet.toml:22:1: the scale of `encoder.offset` is `cubic`",
        ),
        (
            "mean = 2.0",
            "mean = 0.0",
            "the mean of `cart.inertia` is 0",
        ),
        (
            "encoder.offset\"\nunit",
            "cart.inertia\"\nunit",
            "`cart.inertia` is here twice",
        ),
        (
            "freedom = 9",
            "freedom = 2",
            "fleet.toml:6:1: `freedom` is 2",
        ),
        ("widening = 1.7", "widening = 0.5", "`widening` is 0.5"),
        (
            "[1e-2, 1e-5]",
            "[1e-2, 2e-5]",
            "`covariance` is not symmetric",
        ),
        (
            "[1e-2, 1e-5]",
            "[-1e-2, 1e-5]",
            "`covariance` has the eigenvalue",
        ),
        (
            "[1e-2, 1e-5]",
            "[nan, 1e-5]",
            "`covariance` has a number that is not finite",
        ),
        (
            "[1e-2, 1e-5]",
            "[1e-2]",
            "`covariance` has a row of 1 numbers",
        ),
        (
            "outlier = \"cart",
            "outlier = \"car",
            "device `a` has `car.inertia`",
        ),
        ("unit = \"kg\"", "units = \"kg\"", "unknown field `units`"),
        ("rig =", "# rig =", "missing field `rig`"),
    ] {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from} is not there");
        let error = Fleet::parse(&changed, Path::new("fleet.toml")).unwrap_err();
        let message = error.to_string();
        assert!(message.contains(said), "{said}: {message}");
        assert!(message.contains("expected: ") && message.contains("help: "));
        assert_eq!(error.exit_code(), 2);
    }
}

#[test]
fn a_rig_with_other_parameters_is_refused_by_their_names() {
    let fleet = fleet();
    assert!(
        fleet
            .is_of("cart.toml", &["encoder.offset", "cart.inertia"])
            .is_ok()
    );
    let refused = |names: &[&str]| fleet.is_of("cart.toml", names).unwrap_err().to_string();
    let message = refused(&["cart.inertia"]);
    assert!(
        message.contains("has `encoder.offset`, which cart.toml does not"),
        "{message}"
    );
    let message = refused(&["cart.inertia", "encoder.offset", "coil.stiffness"]);
    assert!(message.contains("has no `coil.stiffness`"), "{message}");
    let message = refused(&["cart.inertia", "coil.stiffness"]);
    assert!(
        message.contains("`encoder.offset` in place of `coil.stiffness`"),
        "{message}"
    );
}

#[test]
fn draws_have_the_mean_and_covariance_of_a_new_device() {
    let fleet = fleet();
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let (count, mean) = (20_000, fleet.mean());
    let mut sum = DMatrix::zeros(2, 2);
    for _ in 0..count {
        let values = fleet.draw(&mut random);
        assert!(values[0] > 0.0);
        let at = fleet.axes.iter().zip(&values);
        let at = DVector::from_iterator(2, at.map(|(axis, value)| axis.coordinate(*value)));
        sum += (&at - &mean) * (at - &mean).transpose();
    }
    let (found, wanted) = (sum / f64::from(count), fleet.of_a_new_device());
    for (found, wanted) in found.iter().zip(&wanted) {
        assert!(
            (found / wanted - 1.0).abs() < 0.05
                || wanted.abs() < 1e-4 && (found - wanted).abs() < 3e-6,
            "{found} {wanted}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20, ..ProptestConfig::default() })]

    /// Units of the parameters do not matter: another scale of an axis scales its row and column.
    #[test]
    fn another_scale_of_an_axis_scales_its_covariance(seed in 0_u64..1000, scale in 0.01_f64..100.0) {
        let root = DMatrix::from_row_slice(2, 2, &[0.3, 0.0, 0.2, 0.1]);
        let error = DMatrix::from_row_slice(2, 2, &[0.05, 0.0, 0.02, 0.08]);
        let devices = drawn(10, (&[0.4, 1.0], &root, &error), seed);
        let factor = DMatrix::from_row_slice(2, 2, &[scale, 0.0, 0.0, 1.0]);
        let inverse = DMatrix::from_row_slice(2, 2, &[1.0 / scale, 0.0, 0.0, 1.0]);
        let scaled: Vec<Device> = devices.iter().map(|it| Device {
            at: &factor * &it.at,
            precision: &inverse * &it.precision * &inverse,
        }).collect();
        let (found, other) = (population(&all(&devices)).unwrap(), population(&all(&scaled)).unwrap());
        let wanted = &factor * &found.covariance * &factor;
        let sizes = wanted.diagonal();
        for row in 0..2 {
            for column in 0..2 {
                let off = (other.covariance[(row, column)] - wanted[(row, column)]).abs();
                prop_assert!(off < 1e-3 * (sizes[row] * sizes[column]).sqrt());
            }
        }
    }

    /// Whatever the devices, the covariance is one: symmetric, without a negative eigenvalue.
    #[test]
    fn a_covariance_is_always_one(seed in 0_u64..10_000, count in 3_usize..15, noise in 0.001_f64..2.0) {
        let root = DMatrix::from_row_slice(3, 3, &[0.3, 0.0, 0.0, 0.2, 0.1, 0.0, 0.1, 0.0, 0.0]);
        let devices = drawn(count, (&[0.0; 3], &root, &(DMatrix::identity(3, 3) * noise)), seed);
        let found = population(&all(&devices)).unwrap();
        for matrix in [&found.covariance, &found.of_mean, &found.of_a_new_device()] {
            prop_assert!((matrix - matrix.transpose()).amax() <= 1e-12 * matrix.amax());
            let least = matrix.clone().symmetric_eigen().eigenvalues.min();
            prop_assert!(least >= -1e-9 * matrix.amax(), "{least}");
        }
    }
}
