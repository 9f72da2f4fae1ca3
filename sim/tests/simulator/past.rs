//! A stretch out of a recording: what delays, plays and lags remember from before it.

use sinew_sim::{Dual, InputTrajectory, Plant, Scalar, SimulationError};

use crate::mechanisms::{DAMPER, SPRING, effect, slide, times};

const INTERVAL: f64 = 0.01;
const ROWS: usize = 300;
/// Start of the interval; before it the past is longer than what is gone through row by row.
const CUT: usize = 181;

/// Stages with memory: kind, parameter, and the part that is not known after 64 rows.
const STAGES: [(&str, (&str, f64), f64); 3] = [
    ("input_delay", ("delay", 0.137), 1e-12),
    ("backlash", ("gap", 1.1), 1e-12),
    ("actuator_lag", ("time_constant", 0.03), 1e-9),
];

fn rig(hold: &str, stages: &[usize]) -> Plant {
    let push = format!(
        "[[actuator]]\nname = \"push\"\ndrives = \"mass\"\ninput = \"u_N\"\nhold = \"{hold}\"\ngain = 2.0\n"
    );
    let effects = stages.iter().map(|&stage| {
        let (kind, parameter, _) = STAGES[stage];
        effect(kind, "push", &[parameter])
    });
    let effects: String = effects.collect();
    slide(0.1, 0.0, &format!("{SPRING}{DAMPER}{push}{effects}"))
}

/// Large at first and small in the end, so that a play of 1.1 N is left where it was 150 rows
/// before the cut.
fn input() -> Vec<f64> {
    let at = |k: usize| {
        let t = k as f64 * INTERVAL;
        let size = if k < 30 { 2.0 } else { 0.4 };
        size * (9.0 * t).sin()
    };
    (0..ROWS).map(at).collect()
}

fn stretch(plant: &Plant, t: &[f64], input: &[f64]) -> InputTrajectory {
    let drive = InputTrajectory::new(plant, ROWS - CUT, &[&input[CUT..]]).expect("a drive");
    let past = drive.after(plant, &t[..CUT], t[CUT], &[&input[..CUT]]);
    past.expect("a past")
}

#[test]
fn a_stretch_with_its_past_goes_on_as_the_whole_recording_does() {
    let (t, input) = (times(ROWS, INTERVAL), input());
    for hold in ["zero", "linear"] {
        for stages in [&[0][..], &[1], &[2], &[0, 1], &[1, 2], &[0, 1, 2]] {
            let plant = rig(hold, stages);
            let whole = InputTrajectory::new(&plant, ROWS, &[&input]).expect("a drive");
            let mut state = Vec::new();
            let mut signals = Vec::new();
            let values = plant.values();
            let see = |row: usize, at: &sinew_sim::Stepper<f64>| {
                if row == CUT {
                    state = at.state();
                }
                if row >= CUT {
                    signals.extend(at.signals());
                }
            };
            plant
                .simulate_with(&values, &[0.1, 0.0], &whole, &t, see)
                .expect("the rig can be simulated");
            let largest = signals.iter().fold(0.0f64, |m, s| m.max(s.abs()));
            let missed = |drive: &InputTrajectory| {
                let part = plant.simulate(&values, &state, drive, &t[CUT..]);
                let part = part.expect("the rig can be simulated");
                let apart = part.signals.iter().zip(&signals);
                apart.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            let tolerance = stages.iter().map(|&s| STAGES[s].2).fold(0.0, f64::max);
            let with = missed(&stretch(&plant, &t, &input));
            assert!(with < tolerance, "{hold}, {stages:?}: {with}");
            let without =
                missed(&InputTrajectory::new(&plant, ROWS - CUT, &[&input[CUT..]]).expect("one"));
            assert!(without > 1e-3 * largest, "{hold}, {stages:?}: {without}");
        }
    }
}

/// A play of 1.1 N: an input of 0.5 N has not met its edge, one of 1 N is half a gap past it.
#[test]
fn a_recording_begins_with_a_play_whose_input_came_from_nothing() {
    let t = times(ROWS, INTERVAL);
    let moved = |plant: &Plant, input: f64| {
        let drive = InputTrajectory::new(plant, ROWS, &[&[input; ROWS]]).expect("a drive");
        let run = plant.simulate(&plant.values(), &[0.0, 0.0], &drive, &t);
        run.expect("the rig can be simulated").signals
    };
    let (loose, tight) = (rig("zero", &[1]), rig("zero", &[]));
    assert!(moved(&loose, 0.5).iter().all(|q| *q == 0.0));
    let (through, less) = (moved(&loose, -1.0), moved(&tight, -0.45));
    let apart = through.iter().zip(&less).map(|(a, b)| (a - b).abs());
    let apart = apart.fold(0.0, f64::max);
    // The one without a play is linear and solved in closed form.
    assert!(apart < 1e-6, "{apart}");
    assert!(less.iter().any(|q| q.abs() > 1e-3));
}

#[test]
fn derivatives_see_the_past_forwards_and_backwards() {
    let t = times(ROWS, INTERVAL);
    // Beyond the play to the end, so that all three matter.
    let input: Vec<f64> = input().iter().map(|u| 2.0 * u).collect();
    let plant = rig("linear", &[0, 1, 2]);
    let drive = stretch(&plant, &t, &input);
    let slots: Vec<usize> = ["delay", "gap", "time_constant"]
        .iter()
        .flat_map(|name| {
            plant
                .parameters()
                .iter()
                .position(|p| p.name.ends_with(name))
        })
        .collect();
    let plain = plant.values();
    let start = [0.05, -0.2];
    let mut values: Vec<Dual<4>> = plain.iter().map(|&v| Dual::constant(v)).collect();
    for (seed, &slot) in slots.iter().enumerate() {
        values[slot].derivative[seed] = 1.0;
    }
    let forward = plant
        .simulate(&values, &start.map(Dual::constant), &drive, &t[CUT..])
        .expect("the rig can be simulated");
    let weights: Vec<f64> = (0..forward.signals.len())
        .map(|k| (0.37 * k as f64).sin())
        .collect();
    let loss = |signals: &[f64]| -> f64 { signals.iter().zip(&weights).map(|(s, w)| s * w).sum() };
    let backward = plant
        .gradient(&plain, &start, &drive, &t[CUT..], |run| {
            (loss(&run.signals), weights.clone())
        })
        .expect("the loss has a gradient");
    for (seed, &slot) in slots.iter().enumerate() {
        let parts = forward.signals.iter().zip(&weights);
        let ours: f64 = parts.map(|(s, w)| s.derivative[seed] * w).sum();
        let beside = |step: f64| {
            let mut values = plain.clone();
            values[slot] += step;
            let run = plant.simulate(&values, &start, &drive, &t[CUT..]);
            loss(&run.expect("the rig can be simulated").signals)
        };
        let exact = (beside(1e-6) - beside(-1e-6)) / 2e-6;
        let name = &plant.parameters()[slot].name;
        assert!(exact.abs() > 1e-3, "{name}: {exact}");
        assert!((ours / exact - 1.0).abs() < 1e-5, "{name}: {ours} {exact}");
        let back = backward.parameters[slot];
        assert!((back / ours - 1.0).abs() < 1e-9, "{name}: {back} {ours}");
    }
}

#[test]
fn a_past_that_does_not_fit_is_refused() {
    let plant = rig("zero", &[1]);
    let drive = || InputTrajectory::new(&plant, 2, &[&[1.0, 2.0]]).expect("a drive");
    let refused = |times: &[f64], columns: &[&[f64]]| {
        let refusal = drive().after(&plant, times, 0.0, columns).err();
        refusal.expect("a refusal")
    };
    let shape = |error: SimulationError| matches!(error, SimulationError::Shape { .. });
    assert!(shape(refused(&[-0.1], &[])));
    assert!(shape(refused(&[-0.1], &[&[1.0, 2.0]])));
    let late = refused(&[-0.1, 0.0], &[&[1.0, 2.0]]);
    assert!(matches!(late, SimulationError::Time { row: 2 }), "{late}");
    // Without a row there is nothing that it could come before.
    let none = InputTrajectory::new(&plant, 0, &[&[]]).expect("a drive");
    let none = none.after(&plant, &[-0.1], 0.0, &[&[1.0]]).expect("a past");
    let values = plant.values();
    assert!(plant.simulate(&values, &[0.1, 0.0], &none, &[]).is_ok());
    let missing = refused(&[-0.1], &[&[f64::NAN]]);
    assert!(missing.to_string().contains("u_N"), "{missing}");
}
