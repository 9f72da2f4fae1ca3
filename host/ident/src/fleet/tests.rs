use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_sim::{InputTrajectory, Plant, Rig};

use super::axes::known;
use super::{Recorded, estimate, one_second};
use crate::error::Result;
use crate::fit::{FitOptions, fit, score};
use crate::noise::gaussian;
use crate::population::Scale;
use crate::recording::{Column, Recording};

fn rig() -> Rig {
    Rig::parse(
        r#"
format = "sinew-rig/1"
name = "oscillator"
[[body]]
name = "mass"
motion = "slide"
inertia = { value = 1.0, min = 0.1, max = 10.0 }
[[spring]]
name = "coil"
from = "ground"
to = "mass"
stiffness = { value = 40.0, min = 1.0, max = 400.0 }
[[damper]]
name = "dashpot"
from = "ground"
to = "mass"
damping = { value = 1.2 }
[[actuator]]
name = "push"
drives = "mass"
input = "u_N"
gain = 1.0
[[sensor]]
name = "encoder"
reads = "mass.position"
signal = "q_m"
"#,
        "oscillator.toml",
    )
    .unwrap()
}

/// Parameters of a device: mass, stiffness and damping, the last two correlated.
fn truth(random: &mut ChaCha8Rng) -> [f64; 3] {
    let mut normal = || gaussian(random);
    let (a, b, c) = (normal(), normal(), normal());
    [
        1.2 * (0.08 * a).exp(),
        50.0 * (0.2 * b).exp(),
        1.5 * (0.3 * (0.8 * b + 0.6 * c)).exp(),
    ]
}

/// A recording of a device under commands that change every sixth row, 4 mm of noise.
fn recorded(values: [f64; 3], rows: usize, name: &str, random: &mut ChaCha8Rng) -> Recording {
    let rig = rig();
    let plant = Plant::new(&rig).unwrap();
    let mut all = plant.values();
    let names = ["mass.inertia", "coil.stiffness", "dashpot.damping"];
    for (name, value) in names.iter().zip(values) {
        all[plant.slot(name).unwrap()] = value;
    }
    let t: Vec<f64> = (0..rows).map(|k| k as f64 / 120.0).collect();
    let mut u = Vec::with_capacity(rows);
    for k in 0..rows {
        let last = u.last().copied().unwrap_or(0.0);
        u.push(if k % 12 == 0 {
            8.0 * gaussian(random)
        } else {
            last
        });
    }
    let drive = InputTrajectory::new(&plant, rows, &[&u]).unwrap();
    let run = plant.simulate(&all, &[0.0, 0.0], &drive, &t).unwrap();
    let q = run.column(0).into_iter();
    let q = q.map(|q| q + 4e-3 * gaussian(random)).collect();
    let column = |name: &str, values| Column {
        name: name.into(),
        values,
    };
    Recording::new(name, t, vec![column("u_N", u), column("q_m", q)]).unwrap()
}

fn dozen(random: &mut ChaCha8Rng) -> (Vec<[f64; 3]>, Vec<Recorded>) {
    let devices = (0..12).map(|k| {
        let values = truth(random);
        let recordings = vec![recorded(values, 180, &format!("d{k}.csv"), random)];
        let name = format!("d{k}");
        (values, Recorded { name, recordings })
    });
    devices.unzip()
}

#[test]
fn a_dozen_devices_give_their_distribution_and_the_next_one_from_a_second() -> Result<()> {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let (truths, devices) = dozen(&mut random);
    let found = estimate(&rig(), &devices, false, &mut |_, _| {})?;
    assert!(found.outliers().is_empty(), "{:?}", found.outliers());
    for (j, axis) in found.fleet.axes.iter().enumerate() {
        let logs = truths.iter().map(|it| it[j].ln());
        let mean = logs.clone().sum::<f64>() / 12.0;
        let spread = (logs.map(|it| (it - mean).powi(2)).sum::<f64>() / 11.0).sqrt();
        let estimated = found.population.covariance[(j, j)].sqrt();
        assert_eq!(axis.scale, Scale::Log);
        assert!((axis.mean.ln() - mean).abs() < 0.08, "{axis:?} {mean}");
        let off = (estimated / spread - 1.0).abs();
        assert!(off < 0.35, "{}: {estimated} {spread}", axis.name);
    }
    let together = &found.population.covariance;
    assert!(together[(1, 2)] > 0.2 * (together[(1, 1)] * together[(2, 2)]).sqrt());

    let (mut better, mut alone_sum, mut with_sum) = (0, 0.0, 0.0);
    for k in 0..8 {
        let values = truth(&mut random);
        let second = [recorded(values, 60, "new.csv", &mut random)];
        let test = [recorded(values, 480, "test.csv", &mut random)];
        let with = FitOptions {
            fleet: Some(found.fleet.clone()),
            ..FitOptions::default()
        };
        let error = |options: &FitOptions| -> Result<f64> {
            let fitted = fit(&rig(), &second, options, &mut |_| {})?;
            Ok(score(&fitted.rig, &test)?[0].rms)
        };
        let (alone, with) = (error(&FitOptions::default())?, error(&with)?);
        println!("{k}: {alone:.5} alone, {with:.5} with the fleet");
        alone_sum += alone;
        with_sum += with;
        better += usize::from(with < alone);
    }
    assert!(better >= 6, "{better} of 8");
    assert!(with_sum < 0.8 * alone_sum, "{with_sum} {alone_sum}");
    Ok(())
}

#[test]
fn what_a_recording_shows_is_not_moved_however_far_from_the_fleet() -> Result<()> {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let (_, devices) = dozen(&mut random);
    let found = estimate(&rig(), &devices, false, &mut |_, _| {})?;
    // More than five deviations: the fleet's is a fifth.
    let far = [1.2, 160.0, 1.5];
    let recordings = [recorded(far, 480, "far.csv", &mut random)];
    let with = FitOptions {
        fleet: Some(found.fleet),
        ..FitOptions::default()
    };
    let fitted = fit(&rig(), &recordings, &with, &mut |_| {})?;
    for (parameter, truth) in fitted.parameters.iter().zip(far) {
        let [low, high] = parameter.ci95.expect("an interval");
        let margin = 0.5 * (high - low);
        assert!(
            (low - margin..=high + margin).contains(&truth),
            "{parameter:?}"
        );
    }
    Ok(())
}

#[test]
fn a_device_with_another_damper_is_named() -> Result<()> {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let (mut truths, mut devices) = dozen(&mut random);
    truths[7][2] *= 6.0;
    devices[7].recordings = vec![recorded(truths[7], 180, "d7.csv", &mut random)];
    let found = estimate(&rig(), &devices, false, &mut |_, _| {})?;
    let [sentence] = &found.outliers()[..] else {
        panic!("{:?}", found.outliers());
    };
    assert!(
        sentence.starts_with("d7 is not of this fleet: its dashpot.damping is "),
        "{sentence}"
    );
    assert_eq!(found.population.devices, 11);
    let outlier = found.fleet.members[7].outlier.as_deref();
    assert_eq!(outlier, Some("dashpot.damping"));
    let kept = estimate(&rig(), &devices, true, &mut |_, _| {})?;
    assert_eq!(kept.population.devices, 12);
    Ok(())
}

#[test]
fn what_no_fleet_follows_from_is_refused_before_any_fit() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let (_, devices) = dozen(&mut random);
    let refused = |rig: &Rig, devices: &[Recorded]| {
        let found = estimate(rig, devices, false, &mut |_, _| panic!("a fit began"));
        found.unwrap_err().to_string()
    };
    let message = refused(&rig(), &devices[..2]);
    assert!(message.starts_with("2 devices are no fleet"), "{message}");
    let twice = [&devices[..3], &devices[..1]].concat();
    let message = refused(&rig(), &twice);
    assert!(
        message.starts_with("two devices are called `d0`"),
        "{message}"
    );
    let held = rig()
        .to_toml()
        .replace("{ value = 1.0, min = 0.1, max = 10.0 }", "1.0")
        .replace("{ value = 40.0, min = 1.0, max = 400.0 }", "40.0")
        .replace("{ value = 1.2 }", "1.2");
    let held = Rig::parse(&held, "held.toml").unwrap();
    let message = refused(&held, &devices);
    assert!(
        message.contains("held.toml: the rig has no free parameter"),
        "{message}"
    );
}

/// The page has to say of a second what fits of another dozen's seconds find.
#[test]
fn a_new_second_is_as_sure_as_the_page_says() -> Result<()> {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let (_, devices) = dozen(&mut random);
    let found = estimate(&rig(), &devices, false, &mut |_, _| {})?;
    let second = one_second(&rig(), &devices, &found, |_| {})?;
    let with = FitOptions {
        fleet: Some(found.fleet.clone()),
        ..FitOptions::default()
    };
    let mut errors = [[(); 3]; 2].map(|row| row.map(|()| Vec::new()));
    for _ in 0..24 {
        let values = truth(&mut random);
        let recording = [recorded(values, 121, "new.csv", &mut random)];
        for (errors, options) in errors.iter_mut().zip([&FitOptions::default(), &with]) {
            let fitted = fit(&rig(), &recording, options, &mut |_| {})?;
            for (j, axis) in found.fleet.axes.iter().enumerate() {
                let (value, _) = known(&fitted, &axis.name).expect("a second shows it");
                errors[j].push((value / values[j]).ln().abs());
            }
        }
    }
    // Half of all normal errors are within 0.674 deviations.
    let typical = errors.map(|row| {
        row.map(|mut all| {
            all.sort_by(f64::total_cmp);
            all[12] / 0.674
        })
    });
    for j in 0..3 {
        for (said, typical) in [
            (second.alone[j], typical[0][j]),
            (second.both[j], typical[1][j]),
        ] {
            let ratio = typical / said;
            assert!(
                (0.45..2.2).contains(&ratio),
                "{j}: {said} said, {typical} found"
            );
        }
        assert!(second.both[j] < second.fleet[j] && second.both[j] < second.alone[j]);
    }
    Ok(())
}

#[test]
fn a_page_has_every_device_its_interval_and_the_outlier_in_red() -> Result<()> {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let (mut truths, mut devices) = dozen(&mut random);
    truths[7][2] *= 6.0;
    devices[7].recordings = vec![recorded(truths[7], 180, "d7.csv", &mut random)];
    devices[3].name = "<b>".into();
    let found = estimate(&rig(), &devices, false, &mut |_, _| {})?;
    let second = one_second(&rig(), &devices, &found, |_| {})?;
    let html = super::page::report(
        &found,
        &second,
        &crate::report::Provenance::new("sinew fleet rig.toml"),
    )
    .to_html();
    for expected in [
        "d7 is not of this fleet: its dashpot.damping is",
        "d7 (not of this fleet)",
        "outlier: ",
        "&lt;b&gt;",
        "95 % of new devices",
        "A new device of one second",
        "1 s and the fleet",
        "Correlations",
        "color-scheme\" content=\"light dark",
        "series red points",
    ] {
        assert!(html.contains(expected), "{expected} is not on the page");
    }
    let (drawn, _) = html
        .split_once("<script>")
        .expect("plots are read by a script");
    for forbidden in ["http:", "https:", "<b>", "NaN", "style=\"", "fill=\"#"] {
        assert!(!drawn.contains(forbidden), "{forbidden} is on the page");
    }
    // One plot a parameter, in each a point of every device: the odd one alone is red.
    let plots: Vec<&str> = drawn.split("<figure>").skip(1).collect();
    assert_eq!(plots.len(), 3);
    let red = |plot: &str| plot.contains("series red");
    assert_eq!(plots.iter().filter(|plot| red(plot)).count(), 1);
    assert!(red(plots[2]), "the damping is what is odd");
    Ok(())
}

#[test]
fn a_quantile_is_not_exceeded_by_its_share_of_draws() -> Result<()> {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let (_, devices) = dozen(&mut random);
    let fleet = estimate(&rig(), &devices, false, &mut |_, _| {})?.fleet;
    let draws: Vec<Vec<f64>> = (0..4000).map(|_| fleet.draw(&mut random)).collect();
    for axis in 0..3 {
        for share in [0.05, 0.5, 0.9] {
            let bound = fleet.quantile(axis, share);
            let below = draws.iter().filter(|draw| draw[axis] <= bound).count();
            let found = below as f64 / 4000.0;
            assert!((found - share).abs() < 0.02, "{axis} {share}: {found}");
        }
    }
    Ok(())
}
