//! Whole plans: reached under the hard laws within few simulations, the file is the plan, and what
//! cannot be reached is an error.

use std::path::Path;

use sinew_ident::recording::Recording;
use sinew_plan::{Goal, Options, Plan, plan};
use sinew_sim::{Plant, Rig};

const SLED: &str = include_str!("sled.toml");

fn plant(text: &str) -> Plant {
    let rig = Rig::parse(text, "sled.toml").unwrap_or_else(|error| panic!("{error}"));
    Plant::new(&rig).expect("the rig is sound")
}

fn planned(text: &str, goals: &[&str], options: &Options) -> Result<Plan, String> {
    let goals: Result<Vec<Goal>, _> = goals.iter().map(|goal| Goal::parse(goal)).collect();
    let goals = goals.map_err(|error| error.to_string())?;
    let file = Path::new("sled.toml");
    plan(&plant(text), file, &goals, None, options, &mut |_| {}).map_err(|error| error.to_string())
}

/// Across the gap, from rest, through dry friction of both: at most 0.2 mm in at most 300
/// simulations, whatever the seed.
#[test]
fn the_second_mass_is_pushed_across_the_gap_by_every_seed() {
    for seed in 1..=5 {
        let options = Options {
            seed,
            ..Options::default()
        };
        let found = planned(SLED, &["second.position = 0.12 at 1.5 s"], &options);
        let found = found.unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        let miss = (found.outcomes[0].reached - 0.12).abs();
        assert!(miss <= 2e-4, "seed {seed}: missed by {miss} m");
        let used = found.count.equivalent();
        assert!(used <= 300, "seed {seed}: {used} simulations");
    }
}

/// The file's inputs, simulated as `sinew simulate` does, give the file's signals to the last bit.
#[test]
fn the_file_is_the_plan() {
    let text = SLED
        .replace(
            "signal = \"sled_m\"",
            "signal = \"sled_mm\"\nunit = \"mm\"\ngain = 0.9\noffset = 0.01",
        )
        .replace("input = \"u_N\"", "input = \"u_kN\"\nunit = \"kN\"");
    let found = planned(
        &text,
        &["second.position = 0.08 at 1.0 s"],
        &Options::default(),
    );
    let found = found.unwrap_or_else(|error| panic!("{error}"));
    let plant = plant(&text);
    let csv = found
        .recording(&plant, "plan.csv")
        .expect("a recording")
        .to_csv();
    let read = Recording::parse(csv.as_bytes(), "plan.csv").expect("the plan reads back");
    let column = |name: &str, factor: f64| -> Vec<f64> {
        let values = read.column(name).expect("the plan has the column");
        values.iter().map(|value| value * factor).collect()
    };
    let input = &plant.inputs()[0];
    let u = column(&input.column, input.column_factor);
    let (limit, rate) = (
        input.limit.expect("a limit"),
        input.rate_limit.expect("a rate limit"),
    );
    for row in 1..u.len() {
        let seconds = read.t()[row] - read.t()[row - 1];
        assert!(u[row] >= limit.0 && u[row] <= limit.1, "row {row}");
        assert!((u[row] - u[row - 1]).abs() <= rate * seconds, "row {row}");
    }
    let signals: Vec<Vec<f64>> = (plant.sensors().iter())
        .map(|sensor| column(&sensor.column, sensor.column_factor))
        .collect();
    let slices: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
    let run = plant
        .simulate_recording(read.t(), &[&u], &slices)
        .expect("the plan is simulated");
    for (index, sensor) in plant.sensors().iter().enumerate() {
        let again: Vec<f64> = (run.trajectory.column(index).iter())
            .map(|value| value / sensor.column_factor)
            .collect();
        assert_eq!(
            Some(&again[..]),
            read.column(&sensor.column),
            "{}",
            sensor.name
        );
    }
}

#[test]
fn a_limit_that_excludes_the_goal_says_by_how_much() {
    let weak = SLED.replace("limit = [-20.0, 20.0]", "limit = [-2.5, 2.5]");
    let options = Options {
        simulations: 150,
        ..Options::default()
    };
    let found = planned(&weak, &["second.position = 0.4 at 0.6 s"], &options);
    let found = found.unwrap_or_else(|error| panic!("{error}"));
    let error = found.reached(0.01).expect_err("it is out of reach");
    let text = error.to_string();
    assert!(
        text.contains("is missed by 0.") && text.contains("at a limit"),
        "{text}"
    );
    assert_eq!(error.exit_code(), 1);
}

#[test]
fn goals_that_make_no_sense_are_refused_before_any_work() {
    let refused = |goal: &str, seconds: Option<f64>| {
        let options = Options {
            seconds,
            ..Options::default()
        };
        planned(SLED, &[goal], &options).expect_err("it is refused")
    };
    let unknown = refused("second.positon = 0.12 at 1.5 s", None);
    assert!(
        unknown.contains("did you mean `second.position`?"),
        "{unknown}"
    );
    let late = refused("second.position = 0.12 at 1.5 s", Some(1.0));
    assert!(late.contains("a time up to the horizon, 1 s"), "{late}");
    let form = refused("second.position to 0.12", None);
    assert!(form.contains("`NAME = VALUE at TIME s`"), "{form}");
    let free = SLED.replace("limit = [-20.0, 20.0]\n", "");
    let free = planned(
        &free,
        &["second.position = 0.12 at 1.5 s"],
        &Options::default(),
    );
    let free = free.expect_err("it has no limit");
    assert!(free.contains("actuator `push` has no `limit`"), "{free}");
}

/// A path of the sled, and no goal: its distance is what is judged.
#[test]
fn a_path_is_followed() {
    let rows = (0..=50).map(|k| {
        let t = f64::from(k) / 50.0;
        format!("{t},{}\n", 0.02 * (1.0 - (std::f64::consts::PI * t).cos()))
    });
    let text = format!("t,sled_m\n{}", rows.collect::<String>());
    let path = Recording::parse(text.as_bytes(), "path.csv").expect("a path");
    let options = Options::default();
    let file = Path::new("sled.toml");
    let found = plan(&plant(SLED), file, &[], Some(&path), &options, &mut |_| {});
    let found = found.unwrap_or_else(|error| panic!("{error}"));
    let rms = found.path_rms.expect("a path");
    assert!(rms < 0.05, "{rms}");
    let strange = Recording::parse(b"t,x_m\n0,1\n1,2\n", "path.csv").expect("a table");
    let error = plan(
        &plant(SLED),
        file,
        &[],
        Some(&strange),
        &options,
        &mut |_| {},
    );
    let error = error.expect_err("it names nothing").to_string();
    assert!(
        error.starts_with("path.csv:1:1: no column of the path"),
        "{error}"
    );
}
