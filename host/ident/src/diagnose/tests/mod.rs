//! Whole diagnoses of the shipped recordings, which a program that shares no code with the
//! simulator wrote.

mod alike;
mod bare_number;
mod finger;
mod judged;
mod kin;
mod local;
mod mode;
mod moves;
mod parts;
mod rivals;
mod siblings;
mod signal;
mod simpler;
mod stopped;
mod taut;
mod together;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_sim::{Plant, Rig, Stepper};

use super::{DiagnoseOptions, Diagnosis, Recordings, Verdict, diagnose};
use crate::excite;
use crate::fit::{FitOptions, fit};
use crate::noise::gaussian;
use crate::recording::{Column, Recording};

pub(crate) fn shipped(name: &str) -> String {
    format!(
        "{}/../../rigs/mass-spring-damper{name}",
        env!("CARGO_MANIFEST_DIR")
    )
}

pub(crate) fn rig() -> Rig {
    Rig::load(shipped(".toml")).expect("the demo's rig ships with the project")
}

pub(crate) fn recordings() -> Recordings {
    let read = |name| Recording::read(shipped(name)).expect("the recording ships with the project");
    Recordings {
        fit: vec![read(".fit.csv")],
        check: vec![read(".test.csv")],
        test: Vec::new(),
    }
}

fn found(rig: &Rig) -> Diagnosis {
    diagnose(
        rig,
        &recordings(),
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    )
    .expect("the rig can be diagnosed")
}

/// Recording of a push and of where it led, 100 times a second.
fn pushed([inputs, seen]: [Vec<f64>; 2]) -> Recording {
    let t = (0..seen.len()).map(|k| k as f64 * 0.01).collect();
    let column = |name: &str, values: Vec<f64>| Column {
        name: name.into(),
        values,
    };
    let columns = vec![column("u_N", inputs), column("q_m", seen)];
    Recording::new("pushed.csv", t, columns).expect("the text is a recording")
}

#[test]
fn the_demos_hidden_friction_is_named_and_mends_what_chose_nothing() {
    let found = found(&rig());
    assert_eq!(found.verdict, Verdict::MissingPhysics);
    assert_eq!(found.effects.len(), 1, "{}", found.sentence);
    let effect = &found.effects[0];
    assert_eq!(
        (effect.kind.as_str(), effect.component.as_str()),
        ("coulomb_friction", "mass")
    );
    assert!(effect.confidence > 0.8, "{}", effect.confidence);
    let recovered = found.details.recovered.as_ref().expect("a force");
    let trace = &recovered.traces[0];
    assert_eq!(trace.law.len(), trace.force.len());
    let [both, force, law] = [(0, 1), (0, 0), (1, 1)].map(|(a, b)| {
        let of = [&trace.force, &trace.law];
        let products = of[a].iter().zip(of[b]).map(|(a, b)| a * b);
        products.sum::<f64>()
    });
    let alike = both / (force * law).sqrt();
    assert!(alike > 0.7, "the law follows the force by {alike} only");
    // tests/foreign/mass_spring_damper.truth.json
    let level = &effect.parameters["level"];
    assert!((level.value / 0.58 - 1.0).abs() < 0.01, "{level:?}");
    let check = found.fit["q_m"].check;
    assert!(
        check.before_rms > 20.0 * check.after_rms.unwrap(),
        "{check:?}"
    );
    let location = found.location.expect("something is missing");
    assert_eq!(location.component, "mass");
    assert_eq!(location.follows, "sign of velocity");
    assert!(!location.intervals.is_empty());
    let sum: f64 = effect.rivals.iter().map(|rival| rival.confidence).sum();
    assert!(sum + effect.confidence <= 1.0);
}

/// A column that is missing from what is only scored is said before the search.
#[test]
fn a_test_recording_that_cannot_be_scored_is_refused_before_any_work() {
    let mut recordings = recordings();
    let rows = "t,u_N,q_mm\n0,0,0\n0.01,0,0\n";
    let test = Recording::parse(rows.as_bytes(), "column.csv").expect("the rows are a recording");
    recordings.test.push(test);
    let told = |what: &str, _, _| panic!("{what}: that is work");
    let refused = diagnose(&rig(), &recordings, &DiagnoseOptions::default(), &told);
    let refused = refused.expect_err("it lacks a column").to_string();
    assert!(refused.contains("there is no column `q_m`"), "{refused}");
}

#[test]
fn nothing_is_missing_from_the_mended_rig_and_no_effect_is_invented() {
    let mended = found(&rig()).mended;
    let again = found(&mended);
    assert_eq!(again.verdict, Verdict::Consistent, "{}", again.sentence);
    assert!(again.effects.is_empty() && again.location.is_none());
    let check = again.fit["q_m"].check;
    assert_eq!(Some(check.before_rms), check.after_rms);
}

#[test]
fn a_number_far_from_what_its_owner_wrote_is_pointed_at() {
    let mended = found(&rig()).mended;
    let off = mended.with_values(&[("dashpot.damping", 0.1)]);
    let found = found(&off.expect("the plant has this parameter"));
    assert_eq!(found.verdict, Verdict::Parameters, "{}", found.sentence);
    let said = "but `dashpot.damping` is 11 times what the rig says: an effect may hide there";
    assert!(found.sentence.contains(said), "{}", found.sentence);
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let text = |mut diagnosis: Diagnosis| {
        diagnosis.seconds = 0.0;
        serde_json::to_string(&diagnosis).expect("the value has a JSON form")
    };
    assert_eq!(text(found(&rig())), text(found(&rig())));
}

/// A rig of `cargo xtask experiments correction`.
fn stage(name: &str) -> Rig {
    let folder = env!("CARGO_MANIFEST_DIR");
    Rig::load(format!(
        "{folder}/../../rigs/experiments/flexure-stage{name}.toml"
    ))
    .expect("the rig ships with the project")
}

fn compiled(rig: &Rig) -> Plant {
    Plant::new(rig).expect("the rig can be simulated")
}

/// Answer of `real` to an experiment designed for `believed`, with this much noise on every
/// signal.
fn recorded(
    [own, real]: [&Rig; 2],
    (seconds, rate_hz): (f64, f64),
    noise: f64,
    seed: u64,
) -> Recording {
    let (own, real) = (compiled(own), compiled(real));
    let options = excite::Options {
        seconds,
        rate_hz,
        seed,
        ..excite::Options::default()
    };
    let asked = excite::design(&own, "believed", &options).expect("the input has limits");
    let nothing = vec![f64::NAN; asked.t.len()];
    let inputs: Vec<&[f64]> = asked.inputs.iter().map(Vec::as_slice).collect();
    let unseen = vec![&nothing[..]; real.sensors().len()];
    let run = real.simulate_recording(&asked.t, &inputs, &unseen);
    let run = run.expect("the motion stays finite");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut columns = Vec::new();
    for (input, values) in real.inputs().iter().zip(&asked.inputs) {
        columns.push(column(&input.column, values.clone()));
    }
    for (index, sensor) in real.sensors().iter().enumerate() {
        let signal = run.trajectory.column(index).into_iter();
        let signal = signal.map(|x| x + noise * gaussian(&mut random));
        columns.push(column(&sensor.column, signal.collect()));
    }
    Recording::new(format!("{seed}.csv"), asked.t, columns).expect("the text is a recording")
}

fn column(name: &str, values: Vec<f64>) -> Column {
    Column {
        name: name.into(),
        values,
    }
}

/// Two seconds of the real stage, 28 um of noise.
fn recorded_stage(seed: u64) -> Recording {
    let stages = [&stage(""), &stage(".real")];
    recorded(stages, (2.0, 200.0), 28e-6, seed)
}

/// Positions at the end of the controller's horizon, from rest anywhere under constant commands.
fn horizons(rig: &Rig) -> Vec<f64> {
    let (plant, mut ends) = (compiled(rig), Vec::new());
    let values = plant.values();
    for q in [-6e-3, -3e-3, 0.0, 3e-3, 6e-3] {
        for u in [-1.5, -0.7, 0.0, 0.7, 1.5] {
            let start = plant.initial_state(&values, &[Some(q)]).expect("a start");
            let mut stepper = Stepper::new(&plant, &values, &start).expect("a start");
            stepper
                .advance(12.0 / 200.0, &[u])
                .expect("the fit stays finite");
            ends.push(stepper.signal(0));
        }
    }
    ends
}

/// The gain of a controller (docs/evaluation/correction.md) begins with what its model foresees.
#[test]
fn the_mended_stage_foresees_what_no_refit_of_the_believed_one_does() {
    let recordings = Recordings {
        fit: vec![recorded_stage(1)],
        check: vec![recorded_stage(2)],
        test: Vec::new(),
    };
    let both = [recordings.fit.clone(), recordings.check.clone()].concat();
    let refitted = fit(&stage(""), &both, &FitOptions::default(), &mut |_| {}).expect("a fit");
    let found = diagnose(
        &stage(""),
        &recordings,
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    );
    let found = found.expect("the rig can be diagnosed");
    let mut kinds: Vec<&str> = found.effects.iter().map(|e| e.kind.as_str()).collect();
    kinds.sort_unstable();
    assert_eq!(kinds, ["coulomb_friction", "cubic_stiffness"]);
    let real = horizons(&stage(".real"));
    let rms = |rig: &Rig| {
        let ends = horizons(rig);
        let squares = ends.iter().zip(&real).map(|(a, b)| (a - b).powi(2));
        (squares.sum::<f64>() / real.len() as f64).sqrt()
    };
    let (before, after) = (rms(&refitted.rig), rms(&found.mended));
    assert!(before > 100e-6, "{before}: there is little to gain");
    assert!(after < before / 10.0, "{before} before, {after} after");
}

/// Motion of a mass of 1 kg on 40 N/m, damped by 1.2 N s/m that grow with the square of its
/// position: van der Pol's law, of which the vocabulary has nothing. Classical Runge-Kutta, the
/// inputs held.
fn stiffly_damped(u: &[f64], seed: u64) -> Recording {
    let (step, parts) = (1.0 / 120.0, 4);
    let h = step / f64::from(parts);
    let slope = |[q, v]: [f64; 2], u: f64| {
        let damping = 1.2 + 6.0 * (q / 0.15).powi(2);
        [v, u - 40.0 * q - damping * v]
    };
    let at = |x: [f64; 2], k: [f64; 2], h: f64| [x[0] + h * k[0], x[1] + h * k[1]];
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut x, mut seen) = ([0.0; 2], Vec::new());
    for u in u {
        seen.push(x[0] + 2e-4 * gaussian(&mut random));
        for _ in 0..parts {
            let a = slope(x, *u);
            let b = slope(at(x, a, h / 2.0), *u);
            let c = slope(at(x, b, h / 2.0), *u);
            let d = slope(at(x, c, h), *u);
            for i in 0..2 {
                x[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
            }
        }
    }
    let t = (0..u.len()).map(|k| k as f64 * step).collect();
    let columns = vec![column("u_N", u.to_vec()), column("q_m", seen)];
    Recording::new(format!("{seed}.csv"), t, columns).expect("the text is a recording")
}

#[test]
fn a_law_without_a_name_is_located_and_learned_and_foresees_what_taught_nothing() {
    let plant = compiled(&rig());
    let recorded = |seed: u64| {
        let options = excite::Options {
            seconds: 4.0,
            amplitude: 0.5,
            seed,
            ..excite::Options::default()
        };
        let asked = excite::design(&plant, "mass", &options).expect("the input has limits");
        stiffly_damped(&asked.inputs[0], seed)
    };
    let recordings = Recordings {
        fit: vec![recorded(1), recorded(2)],
        check: vec![recorded(3)],
        test: vec![recorded(4)],
    };
    let found = diagnose(
        &rig(),
        &recordings,
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    );
    let found = found.expect("the rig can be diagnosed");
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.sentence);
    assert!(found.effects.is_empty());
    assert_eq!(found.location.expect("somewhere").component, "mass");
    assert!(found.sentence.contains("a learned force at mass"));
    let test = found.fit["q_m"].test.expect("a recording was kept back");
    assert!(test.before_rms > 5.0 * test.after_rms.unwrap(), "{test:?}");
    // What stands in is in the rig, and the rig is one: every other verb takes it.
    let mended = Rig::parse(found.mended.to_toml(), "mended.toml").expect("the text is a rig");
    assert!(compiled(&mended).values().len() > compiled(&rig()).values().len());
}
