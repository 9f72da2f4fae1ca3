//! `sinew adopt` from end to end: firmware on this computer controls a plant that is not the one of
//! its model, and the rig that it gives back simulates that plant better.

use std::path::Path;

use sinew::adopt::{Columns, Learned, Source, adopt, recorded};
use sinew::closed_loop::mpc::MpcController;
use sinew::closed_loop::reference::Reference;
use sinew::device::Device;
use sinew::project::{self, Board, Optimise};
use sinew_ident::fit::score;
use sinew_ident::recording::{Column, Recording};
use sinew_model::spec::ModelSpec;
use sinew_model::{fingerprint, store};
use sinew_sim::{InputTrajectory, Plant, Rig};
use sinew_tests::state_demo::{MODEL, scenario};
use sinew_tests::{image, skip};

/// The demo's rig with the numbers of the usual device of the model.
fn usual(spec: &ModelSpec) -> Rig {
    let text = std::fs::read_to_string(image::root().join("rigs/demo.toml"));
    let text = text.expect("a shipped rig")
        + "\n[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"mass\"\nlevel = { value = 1.0 }\n";
    let rig = Rig::parse(&text, "demo.toml").expect("the text is a rig");
    let state = spec.state.as_ref().expect("a model with a state");
    let values: Vec<(&str, f64)> = state
        .parameters
        .iter()
        .map(|it| (it.name.as_str(), it.value))
        .collect();
    rig.with_values(&values)
        .expect("the model's parameters are the rig's")
}

/// The recording of a loop of the model's firmware with this plant, as `sinew pil` writes it: over
/// a staircase, or 20 s back and forth by an amplitude in metres at a rate in radians a second.
fn closed_loop(spec: &ModelSpec, rig: &Rig, motion: Option<[f64; 2]>) -> String {
    let folder = image::cache().join(MODEL);
    project::write(&folder, spec, Optimise::Speed).unwrap_or_else(|error| panic!("{error}"));
    let built = project::build(&folder, Board::Host, Some(&image::cache()));
    let built = built.unwrap_or_else(|error| panic!("{error}"));
    let mut device = Device::host(&built.lockstep).unwrap_or_else(|error| panic!("{error}"));
    let controller = MpcController::new(&mut device, fingerprint(spec));
    let mut controller = controller
        .unwrap_or_else(|error| panic!("{error}"))
        .learning(30);
    let mut scenario = scenario(rig, spec.period_s).unwrap_or_else(|error| panic!("{error}"));
    if let Some([amplitude, rate]) = motion {
        let rows = (0..2400).map(|k| vec![amplitude * (rate * k as f64 * spec.period_s).sin()]);
        scenario.reference = Reference {
            rows: rows.collect(),
        };
    }
    let run = scenario.run(&mut controller);
    let run = run.unwrap_or_else(|error| panic!("{error}"));
    let signals = (vec!["u_N"], vec!["q_m"]);
    let path = Path::new("run.csv");
    recorded(path, &Columns::of(spec), &run, &controller.learned, signals)
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Four seconds of the plant under commands that no loop gave.
fn held_out(rig: &Rig) -> Recording {
    let plant = Plant::new(rig).expect("the rig can be simulated");
    let t: Vec<f64> = (0..480).map(|k| f64::from(k) / 120.0).collect();
    let levels = [4.0, -3.0, 6.0, 0.0, -5.0, 3.0, 0.0, 5.0];
    let u: Vec<f64> = (0..480).map(|k| levels[k / 60]).collect();
    let drive = InputTrajectory::new(&plant, t.len(), &[&u]).expect("one input");
    let start = plant
        .initial_state(&plant.values(), &[Some(0.0)])
        .expect("a start at zero");
    let run = plant
        .simulate(&plant.values(), &start, &drive, &t)
        .expect("it can be simulated");
    let column = |name: &str, values| Column {
        name: name.into(),
        values,
    };
    let columns = vec![column("u_N", u), column("q_m", run.column(0))];
    Recording::new("test.csv", t, columns).expect("a recording")
}

fn error(rig: &Rig, test: &Recording) -> f64 {
    score(rig, std::slice::from_ref(test)).expect("the rig can be simulated")[0].rms
}

#[test]
fn a_device_that_differs_gives_back_a_rig_that_simulates_it_better() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let spec = store::load(&image::root().join("models").join(MODEL)).expect("a committed model");
    let usual = usual(&spec);
    // Steps show the mass. Of small and slow motions dry friction is a good part.
    for (name, motion) in [
        ("mass.inertia", None),
        ("mass.coulomb_friction.level", Some([0.02, 3.0])),
    ] {
        let values = Plant::new(&usual).expect("a rig");
        let before = values.values()[values.slot(name).expect("a parameter")];
        let truth = 1.2 * before;
        let plant = usual
            .with_values(&[(name, truth)])
            .expect("a value of that sign");
        let text = closed_loop(&spec, &plant, motion);
        let recording = Recording::parse(text.as_bytes(), "run.csv").expect("a recording");
        let source = Source {
            recording: &recording,
            text: &text,
            model: Path::new(MODEL),
        };
        let only = [name.to_string()];
        let (adopted, learned) =
            adopt(&usual, &spec, &source, &only).unwrap_or_else(|error| panic!("{error}"));
        let Learned {
            value, interval, ..
        } = &learned[0];
        assert!(
            (value - truth).abs() < 0.7 * (before - truth).abs(),
            "{name}: {before} before, {value} in {interval:?} learned, {truth} in truth"
        );
        // Within three deviations, of which the interval has 1.96.
        let half = 0.5 * (interval[1] - interval[0]);
        assert!(
            (value - truth).abs() < 3.0 / 1.96 * half && half < (before - truth).abs(),
            "{name}: {value} in {interval:?} learned, {truth} in truth"
        );
        let test = held_out(&plant);
        let errors = [&usual, &adopted].map(|rig| error(rig, &test));
        assert!(
            errors[1] < 0.75 * errors[0],
            "{name}: free-run error {errors:?} before and after"
        );
    }
}
