//! Derivatives and steps of the search.

use super::*;
use crate::fit::levenberg::{
    DecisionVariables, Prior, StoppingCriteria, descend, minimise, total_cost,
};

#[test]
fn the_derivatives_are_those_of_the_simulation() {
    let rig = parse(&oscillator(1.1, 50.0, 0.8, FRICTION))
        .with_values(&[("mass.coulomb_friction.level", 0.3)])
        .unwrap();
    let plant = Plant::new(&rig).unwrap();
    let recording = recorded(&rig, 150, 0.01, 10.0, 0.0, 4);
    let experiments = [Experiment::new(&plant, &recording).unwrap()];
    let problem = Problem {
        plant: &plant,
        experiments: &experiments,
        slots: plant.free_slots(),
        local: Vec::new(),
        scale: vec![0.5, 20.0, 0.4, 0.2],
        sigma: vec![1e-3],
        state_scale: vec![0.1, 2.0],
        rests: None,
    };
    let segment = Segment::new(&plant, &experiments, 0, 10..140, plant.state_len()).unwrap();
    let (values, state) = (plant.values(), vec![0.02, 0.5]);
    let rows = problem.rows(&segment, &values, &state).unwrap();
    let seeded = problem.seeded::<8>(std::slice::from_ref(&segment), &values, 6);
    let wide = problem.rows_by(&seeded, &segment, &state).unwrap();
    assert_eq!(
        (&rows.jacobian, &rows.residual),
        (&wide.jacobian, &wide.residual)
    );
    for direction in 0..6 {
        let shifted = |step: f64| {
            let (mut values, mut state) = (values.clone(), state.clone());
            match direction {
                0..4 => values[problem.slots[direction]] += step * problem.scale[direction],
                _ => state[direction - 4] += step * problem.state_scale[direction - 4],
            }
            problem.rows(&segment, &values, &state).unwrap().residual
        };
        let (up, down) = (shifted(1e-5), shifted(-1e-5));
        let exact: Vec<f64> = rows
            .jacobian
            .iter()
            .skip(direction)
            .step_by(6)
            .copied()
            .collect();
        let norm = exact.iter().map(|value| value * value).sum::<f64>().sqrt();
        assert!(
            norm > 1e-3,
            "direction {direction} does not show: this tests nothing"
        );
        // The residual is measured less simulated: its derivative has the other sign.
        let differences = up.iter().zip(&down).map(|(up, down)| (down - up) / 2e-5);
        let error = exact
            .iter()
            .zip(differences)
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>()
            .sqrt();
        assert!(
            error < 1e-4 * norm,
            "direction {direction}: {}",
            error / norm
        );
    }
}

#[test]
fn the_same_data_give_the_same_bits() {
    let recording = recorded(
        &parse(&oscillator(1.0, 40.0, 1.0, FRICTION)),
        800,
        0.01,
        10.0,
        0.01,
        8,
    );
    let rig = parse(&oscillator(2.0, 60.0, 3.0, FRICTION));
    let bits = |fit: &Fit| {
        fit.parameters
            .iter()
            .map(|p| p.value.to_bits())
            .collect::<Vec<_>>()
    };
    let first = run(&rig, std::slice::from_ref(&recording));
    assert_eq!(bits(&first), bits(&run(&rig, &[recording])));
}

#[test]
fn what_is_tied_changes_by_the_same_part_of_its_scale() {
    let truth = parse(&oscillator(1.0, 60.0, 1.2, ""));
    let recording = recorded(&truth, 400, 0.01, 10.0, 0.01, 8);
    let plant = Plant::new(&parse(&oscillator(1.0, 40.0, 1.0, ""))).unwrap();
    let experiments = [Experiment::new(&plant, &recording).unwrap()];
    let segments = [Segment::new(&plant, &experiments, 0, 0..400, plant.state_len()).unwrap()];
    let begun = [1.0, 40.0, 1.0];
    let problem = Problem {
        plant: &plant,
        experiments: &experiments,
        slots: plant.free_slots(),
        local: Vec::new(),
        scale: begun.to_vec(),
        sigma: vec![1e-3],
        state_scale: vec![0.1, 1.0],
        rests: None,
    };
    let fitted = |tied: &[&[usize]]| {
        let belief = Prior {
            bounds: vec![[0.01, 1e3]; 3],
            written: begun.to_vec(),
            widths: vec![f64::INFINITY; 3],
            tied: tied.iter().map(|group| group.to_vec()).collect(),
            sums: Vec::new(),
            fleet: None,
        };
        let effort = StoppingCriteria {
            iterations: 30,
            relative: 1e-9,
        };
        let mut at = DecisionVariables {
            values: plant.values(),
            states: vec![vec![0.0; 2]],
        };
        let tell = &mut |_, _| {};
        minimise(&problem, &belief, &segments, &mut at, &effort, tell).unwrap();
        let found = problem.slots.iter().map(|&slot| at.values[slot]);
        let parts: Vec<f64> = found
            .zip(begun)
            .map(|(found, begun)| found / begun)
            .collect();
        (parts, total_cost(&problem, &belief, &segments, &at))
    };
    let (parts, least) = fitted(&[]);
    for (part, truth) in parts.iter().zip([1.0, 1.5, 1.2]) {
        assert!((part / truth - 1.0).abs() < 0.03, "{parts:?}");
    }
    let (parts, tied) = fitted(&[&[1, 2]]);
    assert!((parts[1] / parts[2] - 1.0).abs() < 1e-12, "{parts:?}");
    assert!(1.2 < parts[1] && parts[1] < 1.5, "{parts:?}");
    assert!(tied > least);
}

/// One fit in which every simulation ends early that may, and one in which none does; in how many
/// steps the latter refused what the former did not simulate to its end, and what part of the cost
/// was left.
fn fitted_twice(start: [f64; 3], recording: &Recording) -> (usize, f64) {
    let [inertia, stiffness, damping] = start;
    let rig = parse(&oscillator(inertia, stiffness, damping, FRICTION));
    let plant = Plant::new(&rig).unwrap();
    let experiments = [Experiment::new(&plant, recording).unwrap()];
    let stretch = |k: usize| {
        let rows = 200 * k..200 * (k + 1);
        Segment::new(&plant, &experiments, 0, rows, plant.state_len())
    };
    let segments: Vec<Segment> = (0..4).map(|k| stretch(k).unwrap()).collect();
    let problem = Problem {
        plant: &plant,
        experiments: &experiments,
        slots: plant.free_slots(),
        local: Vec::new(),
        scale: vec![inertia, stiffness, damping, 0.1],
        sigma: vec![1e-3],
        state_scale: vec![0.1, 1.0],
        rests: None,
    };
    let belief = Prior {
        bounds: vec![[0.01, 1e3], [0.1, 1e3], [0.0, 1e3], [0.0, 1e3]],
        written: plant.values(),
        widths: vec![100.0; 4],
        tied: Vec::new(),
        sums: Vec::new(),
        fleet: None,
    };
    let effort = StoppingCriteria {
        iterations: 30,
        relative: 1e-6,
    };
    let from = DecisionVariables {
        values: plant.values(),
        states: vec![vec![0.0; 2]; 4],
    };
    let cost = |unknowns: &DecisionVariables| total_cost(&problem, &belief, &segments, unknowns);
    let tell = &mut |_, _| {};

    let mut early = from.clone();
    let ended = minimise(&problem, &belief, &segments, &mut early, &effort, tell);
    let refused = std::cell::Cell::new(0);
    let to_the_end = |candidate: &DecisionVariables, most: f64| {
        let cost = cost(candidate);
        refused.set(refused.get() + usize::from(cost > most));
        cost
    };
    let mut whole = from.clone();
    let judge = &to_the_end;
    let ended_too = descend(
        &problem, &belief, &segments, &mut whole, &effort, tell, judge,
    );

    let bits = |unknowns: &DecisionVariables| -> Vec<u64> {
        let numbers = unknowns
            .values
            .iter()
            .chain(unknowns.states.iter().flatten());
        numbers.map(|number| number.to_bits()).collect()
    };
    assert_eq!(ended, ended_too);
    assert_eq!(bits(&early), bits(&whole));

    // Nothing is changed up to the cost that is asked for, and all of it is refused above.
    let below = |most| problem.cost_below(&segments, &from.values, &from.states, most);
    let full = problem.cost(&segments, &from.values, &from.states);
    for most in [f64::INFINITY, 2.0 * full, full * (1.0 + 1e-9)] {
        assert_eq!(below(most).to_bits(), full.to_bits());
    }
    for most in [full * (1.0 - 1e-9), 0.5 * full, 0.0, -1.0] {
        assert_eq!(below(most), f64::INFINITY);
    }
    (refused.get(), cost(&whole) / cost(&from))
}

/// Near and far: where the fit arrives, and where it gets lost and most of its steps are refused.
#[test]
fn a_fit_whose_simulations_end_early_has_the_same_bits() {
    let truth = parse(&oscillator(1.0, 40.0, 1.0, FRICTION));
    let recording = recorded(&truth, 800, 0.01, 10.0, 0.01, 8);
    let starts = [[0.9, 42.0, 1.2], [2.0, 60.0, 3.0], [0.2, 300.0, 0.05]];
    let fits = starts.map(|start| fitted_twice(start, &recording));
    let refused: usize = fits.iter().map(|(refused, _)| refused).sum();
    assert!(refused > 0, "every step was taken: nothing ended early");
    assert!(
        fits.iter().any(|(_, left)| *left < 0.01),
        "nothing was fitted: {fits:?}"
    );
}
