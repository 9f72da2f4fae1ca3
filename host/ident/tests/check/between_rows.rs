//! Inputs between rows and before the first, short recordings and bare numbers of effects.

use sinew_ident::check::{Check, check};
use sinew_ident::diagnose::{Recordings, Verdict};
use sinew_ident::fit::{FitOptions, fit, free_runs, pool};
use sinew_ident::recording::{Column, Recording};
use sinew_ident::report::{unseen, warnings};
use sinew_sim::{InputTrajectory, Plant, Rig};

use crate::beside::diagnosed;

/// A mass on a spring with parts of its text replaced.
fn rig(replaced: &[(&str, &str)]) -> Rig {
    let text = r#"
format = "sinew-rig/1"
name = "stage"
[[body]]
name = "mass"
motion = "slide"
inertia = { value = 1.3, min = 0.1, max = 10.0 }
[[spring]]
name = "coil"
from = "ground"
to = "mass"
stiffness = { value = 55.0, min = 1.0, max = 400.0 }
[[damper]]
name = "pot"
from = "ground"
to = "mass"
damping = { value = 1.4, min = 0.0, max = 20.0 }
[[actuator]]
name = "push"
drives = "mass"
input = "u_N"
gain = 1.0
[[sensor]]
name = "enc"
reads = "mass.position"
signal = "q_m"
"#;
    let text = replaced.iter().fold(text.to_owned(), |text, (old, new)| {
        assert!(text.contains(old), "{old}");
        text.replace(old, new)
    });
    Rig::parse(&text, "stage.toml").unwrap()
}

const LINEAR: (&str, &str) = ("input = \"u_N\"", "input = \"u_N\"\nhold = \"linear\"");
const BELIEVED: (&str, &str) = ("value = 1.3", "value = 1.1");
const FRICTION: &str = "[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"mass\"\nlevel = ";

/// With friction of this level, bare, at the mass.
fn with_friction(level: &str) -> (&'static str, String) {
    let end = "signal = \"q_m\"\n";
    (end, format!("{end}{FRICTION}{level}\n"))
}

/// A recording of a plant under an input over time, 100 rows a second, with 0.3 mm of noise.
fn recorded(truth: &Rig, rows: usize, name: &str, input: impl Fn(f64) -> f64) -> Recording {
    let plant = Plant::new(truth).unwrap();
    let t: Vec<f64> = (0..rows).map(|row| 0.01 * row as f64).collect();
    let u: Vec<f64> = t.iter().map(|t| input(*t)).collect();
    let drive = InputTrajectory::new(&plant, rows, &[&u]).unwrap();
    let start = vec![0.0; plant.state_len()];
    let run = plant.simulate(&plant.values(), &start, &drive, &t).unwrap();
    let noise = |row: usize| {
        let draw = |k: usize| ((row * 12 + k + name.len()) as f64 * 78.233).sin() * 43758.5453;
        let uniform = |k| draw(k) - f64::floor(draw(k));
        (0..12).map(uniform).sum::<f64>() - 6.0
    };
    let clean = run.column(0).to_vec();
    let q = clean.iter().enumerate();
    let q = q.map(|(row, q)| q + 3e-4 * noise(row)).collect();
    let column = |name: &str, values| Column {
        name: name.into(),
        values,
    };
    Recording::new(name, t, vec![column("u_N", u), column("q_m", q)]).unwrap()
}

fn smooth(t: f64) -> f64 {
    3.0 * (1.3 * t).sin() + 3.0 * (4.4 * t + 1.0).sin() + 2.0 * (9.4 * t).sin() + (19.5 * t).sin()
}

fn steps(t: f64) -> f64 {
    let place = (t / 0.7).floor();
    8.0 * (place * 2.399_963 + place * place).sin()
}

fn kinds(found: &[Check]) -> Vec<(&str, bool)> {
    found.iter().map(|it| (it.kind, it.certain)).collect()
}

/// Half a row of delay had been a hidden mass, 0.99 sure.
#[test]
fn inputs_that_run_between_rows_where_the_rig_has_them_step_are_named() {
    let truth = recorded(&rig(&[LINEAR]), 800, "a.csv", smooth);
    let found = check(std::slice::from_ref(&truth), Some(&rig(&[BELIEVED])));
    assert_eq!(kinds(&found), [("input_not_held", false)]);
    assert!(found[0].remedy.contains("hold = \"linear\""), "{found:?}");
    assert_eq!(check(&[truth], Some(&rig(&[BELIEVED, LINEAR]))), []);
    let stepped = recorded(&rig(&[]), 800, "a.csv", smooth);
    let found = check(
        std::slice::from_ref(&stepped),
        Some(&rig(&[BELIEVED, LINEAR])),
    );
    assert_eq!(kinds(&found), [("input_not_held", false)]);
    assert!(found[0].remedy.contains("hold = \"zero\""), "{found:?}");
    assert_eq!(check(&[stepped], Some(&rig(&[BELIEVED]))), []);
}

/// The effect that imitates the half row is less sure, and its sentence names the check.
#[test]
fn what_is_named_beside_an_input_that_was_not_held_is_in_doubt() {
    let recordings = Recordings {
        fit: vec![recorded(&rig(&[LINEAR]), 800, "a.csv", smooth)],
        check: vec![recorded(&rig(&[LINEAR]), 800, "bb.csv", |t| {
            smooth(t + 50.0)
        })],
        test: Vec::new(),
    };
    let found = diagnosed(&rig(&[BELIEVED]), &recordings);
    assert!(
        found.effects.iter().all(|it| it.confidence <= 0.7),
        "{:?}",
        found.effects
    );
    assert!(
        found.sentence.contains("input_not_held"),
        "{}",
        found.sentence
    );
}

#[test]
fn a_fit_that_misses_what_it_has_not_seen_by_far_more_says_so() {
    let level = with_friction("0.9");
    let truth = rig(&[(level.0, &level.1)]);
    let all = |truth: &Rig, rows| {
        [
            recorded(truth, rows, "a.csv", steps),
            recorded(truth, 400, "b.csv", smooth),
        ]
    };
    let said = |recordings: &[Recording; 2]| {
        let [seen, test] = recordings;
        let found = fit(
            &rig(&[BELIEVED]),
            std::slice::from_ref(seen),
            &FitOptions::default(),
            &mut |_| {},
        )
        .unwrap();
        let runs = free_runs(&found.rig, std::slice::from_ref(test)).unwrap();
        (warnings(&found), unseen(&found, &pool(&runs)))
    };
    let (own, beyond) = said(&all(&truth, 40));
    assert_eq!(own, [""; 0], "a short recording hides the friction");
    assert_eq!(beyond.len(), 1);
    assert!(beyond[0].contains("too little of the device"), "{beyond:?}");
    let (own, beyond) = said(&all(&rig(&[]), 400));
    assert_eq!((own.len(), beyond.len()), (0, 0), "{own:?} {beyond:?}");
}

/// A gain of 0.4 and the level as it is, or a gain of 1 and another level: both are said.
#[test]
fn a_bare_number_of_an_effect_is_suspected_beside_others() {
    let level = with_friction("1.0");
    let truth = rig(&[(level.0, &level.1)]);
    let recordings = Recordings {
        fit: vec![recorded(&truth, 1000, "a.csv", steps)],
        check: vec![recorded(&truth, 1000, "bb.csv", |t| steps(t + 100.0))],
        test: Vec::new(),
    };
    let wrong = with_friction("0.4");
    let found = diagnosed(&rig(&[BELIEVED, (wrong.0, &wrong.1)]), &recordings);
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.sentence);
    for name in ["`mass.coulomb_friction.level`", "`push.gain`"] {
        assert!(found.sentence.contains(name), "{}", found.sentence);
    }
}

#[test]
fn a_huge_sentinel_is_written_by_its_power_of_ten() {
    let mut columns = recorded(&rig(&[]), 300, "a.csv", steps).columns().to_vec();
    for row in [50, 120] {
        columns[1].values[row] = -1e30;
    }
    let t = (0..300).map(|row| 0.01 * f64::from(row)).collect();
    let faulty = Recording::new("a.csv", t, columns).unwrap();
    let found = check(&[faulty], None);
    assert_eq!(found[0].remedy, "--missing -1e30");
    assert!(
        found[0].sentence.starts_with("-1e30 stands in 2 rows"),
        "{found:?}"
    );
}

/// A recording that a script begins as it commands the first step. The lag of its actuator had been
/// one of the sensor, 0.99 sure.
#[test]
fn a_lag_that_begins_with_the_recording_may_be_of_either_end() {
    let end = "signal = \"q_m\"\n";
    let lag = format!(
        "{end}[[effect]]\nkind = \"actuator_lag\"\ncomponent = \"push\"\ntime_constant = 0.06\n"
    );
    let truth = rig(&[(end, &lag)]);
    let begun = |name: &str, later: f64| {
        let input = |t: f64| if t < 0.3 { 0.0 } else { steps(t + later) };
        recorded(&truth, 830, name, input).rows(30..830).unwrap()
    };
    let recordings = Recordings {
        fit: vec![begun("a.csv", 0.4)],
        check: vec![begun("bb.csv", 7.4)],
        test: Vec::new(),
    };
    let found = diagnosed(&rig(&[BELIEVED]), &recordings);
    let [effect] = &found.effects[..] else {
        panic!("{}", found.sentence);
    };
    let alike = effect.indistinguishable_from.iter();
    let mut kinds: Vec<&str> = alike.map(|it| it.kind.as_str()).collect();
    kinds.push(&effect.kind);
    kinds.sort_unstable();
    assert_eq!(kinds, ["actuator_lag", "sensor_lag"], "{}", found.sentence);
    assert!(effect.confidence <= 0.7, "{}", effect.confidence);
    assert!(effect.sentence.contains("would look the same"));
    let time = &effect.parameters["time_constant"];
    assert!((time.value / 0.06 - 1.0).abs() < 0.02, "{time:?}");
}
