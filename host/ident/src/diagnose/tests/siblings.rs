//! Wrong numbers, zeros and bounds of a rig that an effect imitates.

use super::bare_number::{diagnosed_with, path};
use super::pushed;
use crate::diagnose::model::Model;
use crate::diagnose::term::Term;
use crate::diagnose::{DiagnoseOptions, Diagnosis, Recordings, Verdict, diagnose};
use crate::noise::gaussian;
use crate::recording::{Column, Recording};
use rand::SeedableRng;
use sinew_sim::{Plant, Rig, SimulationSettings};

/// The rig of case 24 with a part of its text replaced. Truth: 2 kg, 50 N/m, 1.5 N s/m.
fn stage(replaced: &[(&str, &str)]) -> Rig {
    let text = std::fs::read_to_string(path("mass.toml")).expect("the text is a rig");
    let free = text.replace("inertia = 1.6", "inertia = { value = 1.6 }");
    let text = replaced.iter().fold(free, |text, (old, new)| {
        assert!(text.contains(old), "{old}");
        text.replace(old, new)
    });
    Rig::parse(&text, "stage.toml").expect("the text is a rig")
}

/// The recordings of case 24, with these readings of the encoder.
fn read_as(reading: impl Fn(f64) -> f64) -> Recordings {
    let read = |name: &str| {
        let recording = Recording::read(path(name)).expect("the recording is there");
        let columns = recording.columns().iter().map(|column| {
            let mut values = column.values.clone();
            if column.name == "q_m" {
                values.iter_mut().for_each(|value| *value = reading(*value));
            }
            Column {
                name: column.name.clone(),
                values,
            }
        });
        Recording::new(name, recording.t().to_vec(), columns.collect()).expect("it stays one")
    };
    Recordings {
        fit: vec![read("A.csv")],
        check: vec![read("B.csv")],
        test: Vec::new(),
    }
}

fn judged(rig: &Rig, recordings: &Recordings) -> Diagnosis {
    let found = diagnose(rig, recordings, &DiagnoseOptions::default(), &|_, _, _| {});
    found.expect("the rig can be diagnosed")
}

/// A constant load, the rest of the spring and the offset of the encoder are one motion here.
#[test]
fn zeros_that_look_like_a_load_are_said_beside_it() {
    let found = judged(&stage(&[]), &read_as(|q| q + 0.02));
    assert_eq!(found.verdict, Verdict::MissingPhysics, "{}", found.sentence);
    let effect = &found.effects[0];
    assert_eq!(effect.kind, "constant_load");
    for number in ["encoder.offset", "spring.rest"] {
        assert!(found.sentence.contains(number), "{}", found.sentence);
        let mut alike = effect.indistinguishable_from.iter();
        assert!(alike.any(|it| it.component == number), "{effect:?}");
    }
    assert!(effect.confidence < 0.8, "{}", effect.confidence);
}

#[test]
fn a_damping_whose_bound_excludes_the_truth_is_suspected_and_no_other_is_named() {
    let bound = (
        "damping = { value = 1.0 }",
        "damping = { value = 0.9, max = 1.0 }",
    );
    let found = judged(&stage(&[bound]), &read_as(|q| q));
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.sentence);
    let said = "A bound of the rig is suspected: `damper.damping` rests at its bound of 1.00 N s/m";
    assert!(found.sentence.starts_with(said), "{}", found.sentence);
}

/// Released alone, the mass is kept by the stiffness that its own bound keeps.
#[test]
fn bounds_that_hide_behind_one_another_are_all_said() {
    let rig = stage(&[
        (
            "inertia = { value = 1.6 }",
            "inertia = { value = 1.4, max = 1.5 }",
        ),
        (
            "stiffness = { value = 40.0 }",
            "stiffness = { value = 40.0, max = 45.0 }",
        ),
    ]);
    let found = diagnosed_with(&rig);
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.sentence);
    for said in [
        "`mass.inertia` rests",
        "`spring.stiffness` rests",
        "2.00 kg",
        "50.0 N/m",
    ] {
        assert!(found.sentence.contains(said), "{}", found.sentence);
    }
}

const AXIS: &str = r#"
format = "sinew-rig/1"
name = "axis"
[[body]]
name = "carriage"
motion = "slide"
inertia = { value = 1.5 }
[[damper]]
name = "screw"
from = "ground"
to = "carriage"
damping = 2.0
[[actuator]]
name = "motor"
drives = "carriage"
input = "u_N"
gain = 1.0
[[sensor]]
name = "encoder"
reads = "carriage.position"
signal = "q_m"
"#;

/// A carriage of 2 kg and 6 N s/m under a controller: ten seconds with noise of 0.1 mm, in small
/// steps of symplectic Euler.
fn carriage(seed: u64) -> Recording {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let (mut q, mut v) = (0.0, 0.0);
    let (mut inputs, mut seen) = (Vec::new(), Vec::new());
    for k in 0..1000 {
        let at = 0.01 * f64::from(k) + seed as f64;
        let wanted = 0.1 * (2.0 * at).sin() + 0.05 * (5.0 * at).cos();
        let u = 200.0 * (wanted - q) - 20.0 * v;
        inputs.push(u);
        seen.push(q + 1e-4 * gaussian(&mut random));
        for _ in 0..20 {
            v += 5e-4 * (u - 6.0 * v) / 2.0;
            q += 5e-4 * v;
        }
    }
    pushed([inputs, seen])
}

fn axis(replaced: &[(&str, &str)]) -> Rig {
    let text = replaced.iter().fold(AXIS.to_owned(), |text, (old, new)| {
        assert!(text.contains(old), "{old}");
        text.replace(old, new)
    });
    Rig::parse(&text, "axis.toml").expect("the text is a rig")
}

/// A viscous damping beside the damper is one motion with it.
#[test]
fn a_bare_damping_that_is_wrong_is_said_although_an_effect_moves_alike() {
    let recordings = Recordings {
        fit: vec![carriage(1)],
        check: vec![carriage(2)],
        test: Vec::new(),
    };
    let found = judged(&axis(&[]), &recordings);
    assert!(
        found.sentence.contains("`screw.damping`"),
        "{}",
        found.sentence
    );
}

/// No effect looks like it, and no load.
#[test]
fn an_offset_of_one_of_two_sensors_is_suspected() {
    let speed = |seed| {
        let recording = carriage(seed);
        let (t, q) = (recording.t().to_vec(), recording.column("q_m"));
        let q = q.expect("it has the column");
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(10 + seed);
        let speeds = (0..q.len()).map(|row| {
            let (from, to) = (row.saturating_sub(3), (row + 3).min(q.len() - 1));
            0.05 + (q[to] - q[from]) / (t[to] - t[from]) + 1e-3 * gaussian(&mut random)
        });
        let mut columns = recording.columns().to_vec();
        columns.push(Column {
            name: "qd_m_s".into(),
            values: speeds.collect(),
        });
        Recording::new("speed.csv", t, columns).expect("the columns are as long")
    };
    let recordings = Recordings {
        fit: vec![speed(1)],
        check: vec![speed(2)],
        test: Vec::new(),
    };
    let known = axis(&[("damping = 2.0", "damping = { value = 5.0 }")]);
    let tacho =
        "[[sensor]]\nname = \"tacho\"\nreads = \"carriage.velocity\"\nsignal = \"qd_m_s\"\n";
    let rig =
        Rig::parse(&(known.to_toml().to_owned() + tacho), "axis.toml").expect("the text is a rig");
    let found = judged(&rig, &recordings);
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.sentence);
    assert!(
        found.sentence.contains("`tacho.offset`"),
        "{}",
        found.sentence
    );
}

/// Other terms begin from the values of a tried number; the number itself is the rig's again.
#[test]
fn a_bare_number_keeps_its_value_whatever_was_tried() {
    let rig = axis(&[]);
    let tried = [Term::Number {
        name: "screw.damping".into(),
    }];
    let model = |terms: &[Term]| {
        Model::new(&rig, &rig, terms, SimulationSettings::default()).expect("the rig is sound")
    };
    let plant = Plant::new(&rig).expect("the rig is sound");
    let slot = |name: &str| plant.slot(name).expect("the plant has this parameter");
    let mut values = plant.values();
    values[slot("screw.damping")] = 7.0;
    values[slot("carriage.inertia")] = 1.7;
    let inherited = |terms: &[Term]| {
        let values = model(terms).inherit(&plant, &values);
        [slot("screw.damping"), slot("carriage.inertia")].map(|slot| values[slot])
    };
    assert_eq!(inherited(&[]), [2.0, 1.7]);
    assert_eq!(inherited(&tried), [7.0, 1.7]);
}

/// On an axis that nothing holds a drift of the encoder and a load are one motion.
#[test]
fn a_drift_of_a_sensor_is_said_beside_a_load_on_a_free_axis() {
    let drifting = |seed| {
        let recording = carriage(seed);
        let columns = recording.columns().iter().map(|column| {
            let mut values = column.values.clone();
            if column.name == "q_m" {
                for (value, t) in values.iter_mut().zip(recording.t()) {
                    *value += 4e-3 * t;
                }
            }
            Column {
                name: column.name.clone(),
                values,
            }
        });
        let columns = columns.collect();
        Recording::new("drift.csv", recording.t().to_vec(), columns).expect("it stays one")
    };
    let recordings = Recordings {
        fit: vec![drifting(1)],
        check: vec![drifting(2)],
        test: Vec::new(),
    };
    let known = axis(&[("damping = 2.0", "damping = { value = 5.0 }")]);
    let found = judged(&known, &recordings);
    let effect = &found.effects[0];
    assert_eq!(effect.kind, "constant_load", "{}", found.sentence);
    let said = "A drift of encoder by 4.";
    assert!(found.sentence.contains(said), "{}", found.sentence);
    let mut alike = effect.indistinguishable_from.iter();
    assert!(alike.any(|it| it.kind == "sensor_drift"), "{effect:?}");
    assert!(effect.confidence < 0.75, "{}", effect.confidence);
}

/// 1.6 kg for 2.0 and 3.0 N s/m for 1.5: no single number mends both.
#[test]
fn two_bare_numbers_that_are_wrong_are_suspected_together() {
    let rig = stage(&[
        ("inertia = { value = 1.6 }", "inertia = 1.6"),
        ("damping = { value = 1.0 }", "damping = 3.0"),
    ]);
    let found = diagnosed_with(&rig);
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.sentence);
    let more = found
        .sentence
        .starts_with("More than one number of the rig is suspected");
    let pair = [
        "`mass.inertia` and `damper.damping`",
        "`damper.damping` and `mass.inertia`",
    ];
    let named = pair.iter().any(|pair| found.sentence.contains(pair));
    assert!(more && named, "{}", found.sentence);
}
