//! Initial states of shooting segments.

use super::*;
use crate::fit::experiment::spreads;

/// Stretches of a recording, cut into this many.
fn cut(plant: &Plant, experiments: &[Experiment], parts: usize) -> Vec<Segment> {
    let rows = experiments[0].rows();
    let part = |k: usize| k * rows / parts..(k + 1) * rows / parts;
    let segment = |k| Segment::new(plant, experiments, 0, part(k), plant.state_len()).unwrap();
    (0..parts).map(segment).collect()
}

/// A problem of start states only, in units of this part of each signal's spread.
fn of_states<'a>(
    plant: &'a Plant,
    rig: &Rig,
    experiments: &'a [Experiment],
    part: f64,
) -> Problem<'a> {
    let views = experiment::Views::new(rig, plant);
    let spreads = spreads(experiments).into_iter();
    Problem::of_states(
        plant,
        experiments,
        spreads.map(|spread| part * spread).collect(),
        start::scales(experiments, &views, &plant.values()),
    )
}

/// A lag that began each stretch with the recording's first sample missed the first rows of all but
/// one by what the device had moved meanwhile, and was taken for no explanation.
#[test]
fn a_memory_in_the_middle_of_a_recording_begins_with_what_was_read_there() {
    let lag = "[[effect]]\nkind = \"sensor_lag\"\ncomponent = \"encoder\"\ntime_constant = { value = 0.05 }\n";
    let text =
        oscillator(2.0, 50.0, 3.0, lag).replace("\"q_m\"", "\"q_m\"\ngain = 2.0\noffset = 0.1");
    let rig = parse(&text);
    let experiments = {
        let plant = Plant::new(&rig).unwrap();
        let recording = recorded(&rig, 600, 0.01, 20.0, 1e-4, 3);
        [Experiment::new(&plant, &recording).unwrap()]
    };
    let plant = Plant::new(&rig).unwrap();
    let problem = of_states(&plant, &rig, &experiments, 1.0);
    let views = experiment::Views::new(&rig, &plant);
    let names = plant.state_names();
    let reading = names.iter().position(|n| n.ends_with("sensor_lag.reading"));
    let reading = reading.unwrap();
    let off = |segments: &[Segment]| {
        let states = start::states(&problem, &views, segments, &plant.values()).unwrap();
        let each = segments.iter().zip(&states).map(|(segment, state)| {
            (2.0 * state[reading] + 0.1 - experiments[0].signals[0][segment.rows.start]).abs()
        });
        each.fold(0.0, f64::max) / problem.sigma[0]
    };
    let all = cut(&plant, &experiments, 8);
    assert!(off(&all) < 0.01, "{}", off(&all));
    // Nothing ends where the second of these begins.
    let mut apart = all;
    apart.retain(|segment| segment.rows.start % 150 == 0);
    assert!(apart.len() > 1 && off(&apart) < 0.01, "{}", off(&apart));
}

#[test]
fn a_start_that_ends_in_another_well_is_found_by_its_first_rows() {
    let ripple = "[[effect]]\nkind = \"position_ripple\"\ncomponent = \"mass\"\namplitude = { value = 12.0 }\nwave_number = { value = 40.0 }\nphase = { value = 0.4 }\n";
    let rig = parse(&oscillator(2.0, 5.0, 3.0, ripple));
    let plant = Plant::new(&rig).unwrap();
    let recording = recorded(&rig, 900, 0.01, 20.0, 1e-3, 5);
    let experiments = [Experiment::new(&plant, &recording).unwrap()];
    let problem = of_states(&plant, &rig, &experiments, 1e-3);
    let views = experiment::Views::new(&rig, &plant);
    let segments = cut(&plant, &experiments, 3);
    let values = plant.values();
    let guess = start::states(&problem, &views, &segments, &values).unwrap();
    let near = start::near(&problem, &segments, &values, guess.clone());
    let cost = |states: &[Vec<f64>]| problem.cost(&segments, &values, states);
    assert!(
        cost(&near) < 0.01 * cost(&guess),
        "{} {}",
        cost(&near),
        cost(&guess)
    );
    let settled = start::settle(&problem, &segments, &values, guess);
    assert!(
        cost(&settled) <= cost(&near),
        "{} {}",
        cost(&settled),
        cost(&near)
    );
}

/// A play that began each stretch in its middle pushed with half a gap too much for as long as the
/// input took to turn.
#[test]
fn a_play_in_the_middle_of_a_recording_stands_where_the_rows_before_left_it() {
    let play = "[[effect]]\nkind = \"backlash\"\ncomponent = \"push\"\ngap = { value = 8.0 }\n";
    let rig = parse(&oscillator(2.0, 50.0, 3.0, play));
    let plant = Plant::new(&rig).unwrap();
    let recording = recorded(&rig, 600, 0.01, 20.0, 0.0, 3);
    let experiments = [Experiment::new(&plant, &recording).unwrap()];
    let problem = of_states(&plant, &rig, &experiments, 1.0);
    let values = plant.values();
    let start = vec![0.0; plant.state_len()];
    for segment in cut(&plant, &experiments, 8) {
        let rows = segment.rows.clone();
        let until = Segment::new(
            &plant,
            &experiments,
            0,
            0..rows.start + 1,
            plant.state_len(),
        )
        .unwrap();
        let state = problem.final_state(&until, &values, &start).unwrap();
        let shown = problem.signals(&segment, &values, &state).unwrap();
        let recorded = &experiments[0].signals[0][rows.clone()];
        let apart = shown.iter().zip(recorded).map(|(a, b)| (a - b).abs());
        let apart = apart.fold(0.0, f64::max) / problem.sigma[0];
        assert!(apart < 1e-9, "{rows:?}: {apart}");
    }
}
