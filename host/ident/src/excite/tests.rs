use proptest::prelude::*;
use sinew_sim::{Plant, Rig};

use super::{Kind, Options, design};

const KINDS: [Kind; 5] = [
    Kind::Multisine,
    Kind::Steps,
    Kind::Triangle,
    Kind::Chirp,
    Kind::Mixed,
];

fn plant(actuators: &[&str]) -> Plant {
    let mut text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"m\"\n\
                    motion = \"slide\"\ninertia = 1.0\n"
        .to_owned();
    for (k, more) in actuators.iter().enumerate() {
        text += &format!(
            "[[actuator]]\nname = \"a{k}\"\ndrives = \"m\"\ninput = \"u{k}_N\"\ngain = 1.0\n{more}\n"
        );
    }
    let rig = Rig::parse(&text, "x.toml").unwrap_or_else(|error| panic!("{error}"));
    Plant::new(&rig).expect("the rig is sound")
}

fn spread(u: &[f64]) -> f64 {
    let (low, high) = crate::scales::range(u);
    high - low
}

proptest! {
    /// As a program reads them back from the file, in the column's own unit.
    #[test]
    fn limits_and_rate_limits_hold_to_the_last_bit(
        kind in 0..KINDS.len(), seed in 0..50u64, amplitude in 0.05..1.0f64,
        low in -30.0..0.0f64, span in 0.01..50.0f64, rate in 0.5..500.0f64, rate_hz in 20.0..500.0f64,
    ) {
        let high = low + span;
        let limits = format!("limit = [{low:?}, {high:?}]\nrate_limit = {rate:?}\nunit = \"kN\"");
        let plant = plant(&[&limits]);
        let options = Options { kind: KINDS[kind], seconds: 5.0, rate_hz, seed, amplitude, ..Options::default() };
        let recording = design(&plant, "x.toml", &options).and_then(|e| e.recording(&plant, "x.csv"));
        let bytes = recording.map(|r| r.to_csv()).expect("the experiment can be designed");
        let read = crate::recording::Recording::parse(bytes.as_bytes(), "x.csv").expect("the recording reads back");
        let u = read.column("u0_N").expect("the recording has this column");
        let factor = plant.inputs()[0].column_factor;
        let limit = plant.inputs()[0].limit.expect("the input has a limit");
        let most = plant.inputs()[0].rate_limit.expect("the input has a limit");
        for k in 0..u.len() {
            let here = u[k] * factor;
            prop_assert!(here >= limit.0 && here <= limit.1, "row {k}: {here} of {limit:?}");
            if k > 0 {
                let (change, dt) = (here - u[k - 1] * factor, read.t()[k] - read.t()[k - 1]);
                prop_assert!(change.abs() <= most * dt, "row {k}: {change} in {dt}");
            }
        }
    }
}

#[test]
fn every_kind_uses_the_range_that_it_is_given() {
    let plant = plant(&["limit = [-2.0, 2.0]"]);
    for kind in KINDS {
        let options = Options {
            kind,
            amplitude: 0.5,
            ..Options::default()
        };
        let experiment =
            design(&plant, "x.toml", &options).expect("the experiment can be designed");
        let u = &experiment.inputs[0];
        assert!(u[0] == 0.0, "{kind:?} begins at {}", u[0]);
        assert!(
            (spread(u) / 2.0 - 1.0).abs() < 0.1,
            "{kind:?}: {}",
            spread(u)
        );
        assert_eq!(experiment.t.len(), 3601);
    }
}

#[test]
fn two_inputs_do_not_move_as_one() {
    let plant = plant(&["limit = [-2.0, 2.0]", "limit = [-2.0, 2.0]"]);
    for kind in KINDS {
        let options = Options {
            kind,
            ..Options::default()
        };
        let inputs = design(&plant, "x.toml", &options)
            .expect("the experiment can be designed")
            .inputs;
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (a, b) = (&inputs[0], &inputs[1]);
        let cosine = product(a, b) / (product(a, a) * product(b, b)).sqrt();
        assert!(cosine.abs() < 0.3, "{kind:?}: {cosine}");
    }
}

#[test]
fn the_same_seed_draws_the_same_and_another_does_not() {
    let plant = plant(&["limit = [-2.0, 2.0]"]);
    let of = |seed| {
        let options = Options {
            seed,
            ..Options::default()
        };
        design(&plant, "x.toml", &options)
            .expect("the experiment can be designed")
            .inputs
    };
    assert_eq!(of(7), of(7));
    assert_ne!(of(7), of(8));
}
