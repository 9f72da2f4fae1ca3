//! Parameters of which each recording has a value of its own.

use super::*;
use crate::report::{shared_values, warnings};

/// A mass on a spring of 120 N/m that carries a payload and a sensor with a zero.
fn carrier(zero: &str) -> Rig {
    let inertia = "inertia = { value = 2.0, per = \"recording\" }\nstart = 0.05";
    parse(&format!(
        "[[body]]\nname = \"mass\"\nmotion = \"slide\"\n{inertia}\n[[spring]]\nname = \"coil\"\n\
         from = \"ground\"\nto = \"mass\"\nstiffness = 120.0\n[[damper]]\nname = \"air\"\n\
         from = \"ground\"\nto = \"mass\"\ndamping = {{ value = 1.0 }}\n[[sensor]]\n\
         name = \"eye\"\nreads = \"mass.position\"\nsignal = \"q_m\"\noffset = {zero}\n"
    ))
}

const DIFFERS: &str = "{ value = 0.0, per = \"recording\" }";

/// Recording of `tests/foreign/payload.py`.
fn payload(name: &str) -> Recording {
    Recording::read(root().join(format!("tests/foreign/payload/{name}.csv"))).unwrap()
}

/// The own value lies within this distance of the truth, and its interval holds the truth and is
/// no wider than ten times that.
fn is_near(own: &OwnValue, truth: f64, distance: f64) {
    assert!(
        (own.value - truth).abs() < distance,
        "{own:?}, true {truth}"
    );
    let [low, high] = own.ci95.expect("the recording determines it");
    assert!(low < truth && truth < high, "{own:?}, true {truth}");
    assert!(high - low < 10.0 * distance, "{own:?}");
}

#[test]
fn payloads_and_zeros_of_a_foreign_recording_are_found_each_with_its_interval() {
    let recordings = ["first", "second", "third"].map(payload);
    let fitted = run(&carrier(DIFFERS), &recordings);
    let own = |name: &str| &parameter(&fitted, name).recordings;
    let truth = [(2.0, 0.0015), (2.6, -0.0008), (3.5, 0.0004)];
    for (index, (mass, zero)) in truth.into_iter().enumerate() {
        is_near(&own("mass.inertia")[index], mass, 0.005);
        is_near(&own("eye.offset")[index], zero, 3e-5);
        assert_eq!(own("eye.offset")[index].recording, recordings[index].name());
    }
    let mean = parameter(&fitted, "mass.inertia");
    assert!((mean.value - 2.7).abs() < 0.005, "{mean:?}");
    assert!(mean.ci95.is_some_and(|[low, high]| low < 2.7 && 2.7 < high));
    let shared = parameter(&fitted, "air.damping");
    assert!(
        (shared.value - 1.4).abs() < 0.01 && shared.recordings.is_empty(),
        "{shared:?}"
    );
    // What is left is the noise of 0.1 mm.
    assert!(fitted.sensors[0].rms < 1.1e-4, "{}", fitted.sensors[0].rms);
    let text = fitted.rig.to_toml();
    assert_eq!(text.matches("per = \"recording\"").count(), 2, "{text}");
}

#[test]
fn a_recording_that_was_not_fitted_shows_its_own_values_by_itself() {
    let recordings = ["first", "second", "third"].map(payload);
    let fitted = run(&carrier(DIFFERS), &recordings);
    let unseen = free_run(&fitted.rig, &payload("unseen")).unwrap();
    let names: Vec<&str> = unseen.own.iter().map(|own| own.name.as_str()).collect();
    assert_eq!(names, ["mass.inertia", "eye.offset"]);
    is_near(&unseen.own[0], 4.4, 0.01);
    is_near(&unseen.own[1], -0.002, 3e-5);
    let error = &pool(std::slice::from_ref(&unseen))[0];
    assert!(error.rms < 1.1e-4, "{}", error.rms);
    // One zero for all leaves the zeros' differences.
    let shared = run(&carrier("{ value = 0.0 }"), &recordings);
    let error = &score(&shared.rig, &[payload("unseen")]).unwrap()[0];
    assert!(error.rms > 1e-3, "{}", error.rms);
}

/// Without a push a recording says nothing of the motor's gain: it takes what the others share.
#[test]
fn a_recording_that_says_nothing_of_a_value_takes_the_shared_one() {
    let rig = |gain: &str| {
        let text = oscillator(2.0, 80.0, 1.5, "");
        parse(
            &text
                .replace("gain = 1.0", &format!("gain = {gain}"))
                .replace("inertia = { value = 2.0 }", "inertia = 2.0\nstart = 0.02"),
        )
    };
    let gains = [0.8, 1.0, 1.5];
    let mut recordings: Vec<Recording> = (0..)
        .zip(gains)
        .map(|(seed, gain)| recorded(&rig(&format!("{gain:?}")), 600, 0.01, 10.0, 0.01, seed + 5))
        .collect();
    recordings.push(ringing());
    let fitted = run(&rig("{ value = 1.2, per = \"recording\" }"), &recordings);
    let gain = parameter(&fitted, "push.gain");
    for (own, truth) in gain.recordings.iter().zip(gains) {
        is_near(own, truth, 0.03);
    }
    let silent = &gain.recordings[3];
    assert!(silent.ci95.is_none(), "{silent:?}");
    assert_eq!(silent.value, gain.value, "{silent:?}");
    assert!((gain.value - 1.1).abs() < 0.02, "{gain:?}");
    assert!(
        gain.ci95.is_some_and(|[low, high]| low < 1.1 && 1.1 < high),
        "{gain:?}"
    );
}

/// One sample determines no payload, whatever it draws the fit to: the mean is of the other three.
#[test]
fn a_recording_of_one_sample_does_not_move_the_mean() {
    let mut recordings = ["first", "second", "third"].map(payload).to_vec();
    let [known, with] = [false, true].map(|with| {
        if with {
            let unseen = payload("unseen");
            let mut position = vec![f64::NAN; unseen.len()];
            position[0] = unseen.column("q_m").unwrap()[0];
            let columns = unseen.columns().iter().map(|column| Column {
                name: column.name.clone(),
                values: if column.name == "q_m" {
                    position.clone()
                } else {
                    column.values.clone()
                },
            });
            let times = unseen.t().to_vec();
            recordings.push(Recording::new("empty.csv", times, columns.collect()).unwrap());
        }
        run(&carrier("0.0"), &recordings)
    });
    let [alone, beside] = [&known, &with].map(|fitted| parameter(fitted, "mass.inertia"));
    assert!(
        (alone.value - beside.value).abs() < 1e-4,
        "{alone:?} {beside:?}"
    );
    assert!(beside.ci95.is_some(), "{beside:?}");
    assert_eq!(beside.recordings[3].value, beside.value);
    assert!(beside.recordings[3].ci95.is_none());
}

/// Four readings fit two own values and two start states exactly: they determine nothing.
#[test]
fn a_recording_of_as_many_readings_as_unknowns_determines_no_own_value() {
    let text = oscillator(1.0, 40.0, 1.0, "")
        .replace("inertia = { value = 1.0 }", "inertia = 1.0")
        .replace("40.0 }", "40.0, per = \"recording\" }")
        .replace(
            "damping = { value = 1.0 }",
            "damping = { value = 1.0, per = \"recording\" }",
        );
    let rig = parse(&text);
    let truth = parse(&oscillator(1.0, 50.0, 2.0, ""));
    let whole = recorded(&truth, 600, 0.01, 10.0, 0.0, 5);
    let other = recorded(&truth, 600, 0.01, 10.0, 0.01, 6);
    let columns = other.columns().iter().map(|column| Column {
        name: column.name.clone(),
        values: if column.name == "q_m" {
            (0..)
                .zip(&column.values)
                .map(|(row, value)| {
                    if [90, 230, 370, 510].contains(&row) {
                        *value
                    } else {
                        f64::NAN
                    }
                })
                .collect()
        } else {
            column.values.clone()
        },
    });
    let sparse = Recording::new("sparse.csv", other.t().to_vec(), columns.collect()).unwrap();
    let fitted = run(&rig, &[whole, sparse]);
    for (name, value) in [("coil.stiffness", 50.0), ("dashpot.damping", 2.0)] {
        let shared = parameter(&fitted, name);
        assert!((shared.value / value - 1.0).abs() < 0.01, "{shared:?}");
        let sparse = &shared.recordings[1];
        assert!(
            sparse.ci95.is_none() && sparse.value == shared.value,
            "{sparse:?}"
        );
    }
}

/// Thirty rows at rest leave the own stiffness open, wherever a search for it ends.
#[test]
fn an_own_value_that_a_short_recording_leaves_open_is_the_shared_one_and_at_no_bound() {
    let own = "40.0, min = 20.0, max = 60.0, per = \"recording\" }";
    let text = oscillator(1.0, 40.0, 1.0, "").replace("40.0 }", own);
    let rig = parse(&text);
    let moving = recorded(&rig, 600, 0.01, 10.0, 0.01, 7);
    let fitted = run(&rig, &[moving]);
    let shared = parameter(&fitted, "coil.stiffness").value;
    for seed in 0..20 {
        let mut random = Noise(seed);
        let noise = (0..30).map(|_| 1e-3 * random.normal()).collect();
        let t = (0..30).map(|k| 0.01 * f64::from(k)).collect();
        let column = |name: &str, values| Column {
            name: name.into(),
            values,
        };
        let columns = vec![column("u_N", vec![0.0; 30]), column("q_m", noise)];
        let short = Recording::new("short.csv", t, columns).unwrap();
        let run = free_run(&fitted.rig, &short).unwrap();
        let own = &run.own[0];
        assert!(own.ci95.is_none() && !own.at_bound, "{seed}: {own:?}");
        assert_eq!(own.value, shared, "{seed}");
    }
}

/// A mass of 2 kg on 80 N/m and 1.5 N s/m, let go at 0.1 m, in closed form.
fn ringing() -> Recording {
    let mut random = Noise(31);
    let decay = 1.5 / 4.0;
    let omega = (40.0_f64 - decay * decay).sqrt();
    let t: Vec<f64> = (0..600).map(|k| 0.01 * f64::from(k)).collect();
    let q = t.iter().map(|t| {
        let wave = (omega * t).cos() + decay / omega * (omega * t).sin();
        0.1 * (-decay * t).exp() * wave + 3e-4 * random.normal()
    });
    let column = |name: &str, values| Column {
        name: name.into(),
        values,
    };
    let columns = vec![column("q_m", q.collect()), column("u_N", vec![0.0; 600])];
    Recording::new("ringing.csv", t, columns).unwrap()
}

#[test]
fn own_values_keep_to_the_bounds_of_the_rig() {
    let zero = "{ value = 0.0, min = -0.001, max = 0.01, per = \"recording\" }";
    let recordings = ["first", "second", "third", "unseen"].map(payload);
    let fitted = run(&carrier(zero), &recordings);
    let own = &parameter(&fitted, "eye.offset").recordings;
    assert_eq!(own[3].value, -0.001);
    assert!(own[3].at_bound && own[3].ci95.is_none(), "{:?}", own[3]);
    is_near(&own[1], -0.0008, 3e-5);
    let alone = free_run(&fitted.rig, &recordings[3]).unwrap();
    assert_eq!(alone.own[1].value, -0.001);
}

#[test]
fn one_recording_and_verbs_without_recordings_say_what_per_means_for_them() {
    let fitted = run(&carrier(DIFFERS), &[payload("first")]);
    let said = warnings(&fitted);
    let note = "`mass.inertia`, `eye.offset` may differ by recording, and there is only one";
    assert!(said.iter().any(|line| line.starts_with(note)), "{said:?}");
    is_near(
        &parameter(&fitted, "eye.offset").recordings[0],
        0.0015,
        3e-5,
    );
    let line = shared_values(&carrier(DIFFERS)).expect("the rig has shared parameters");
    let list = "`mass.inertia` = 2.00 kg, `eye.offset` = 0 m";
    assert!(line.ends_with(list), "{line}");
    assert_eq!(shared_values(&parse(&oscillator(1.0, 2.0, 3.0, ""))), None);
}
