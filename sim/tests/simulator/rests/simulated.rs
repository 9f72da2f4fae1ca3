//! Long simulations judge the rests (docs/evaluation/simulator.md).

use super::{drawn, shipped};
use sinew_sim::{NoRest, Plant, Rest, SimulationError, Stepper};

/// Shipped rigs without anything that ends a motion: no simulation of them comes to rest.
const UNDAMPED: &[&str] = &["recorded/torque-limited-pendulum.toml"];
/// Shipped rigs that nothing holds.
const FREE: &[&str] = &[
    "emps.toml",
    "recorded/ball.toml",
    "recorded/emps-by-direction.toml",
    "recorded/emps.toml",
];

/// Longest simulation, s.
const LONGEST_S: f64 = 600.0;
/// Time over which a plant has to be still, s.
const CHUNK_S: f64 = 10.0;

/// Signals of a plant that is simulated until still, the time, and evaluations of its forces (of a
/// linear rig, which takes none: those that its sub-steps would take).
fn simulated(plant: &Plant, inputs: &[f64]) -> (Vec<f64>, f64, usize) {
    let start = vec![0.0; plant.state_len()];
    let mut stepper = Stepper::new(plant, &plant.values(), &start).unwrap();
    let mut before = vec![f64::INFINITY; plant.sensors().len()];
    loop {
        for _ in 0..1000 {
            stepper.advance(CHUNK_S / 1000.0, inputs).unwrap();
        }
        let signals: Vec<f64> = (0..before.len()).map(|k| stepper.signal(k)).collect();
        let moved = |(a, b): (&f64, &f64)| (a - b).abs() > 1e-13 * (1.0 + a.abs());
        let still = !signals.iter().zip(&before).any(moved);
        if still || stepper.time() > LONGEST_S {
            let report = stepper.report();
            let steps = (report.rate * stepper.time() / 0.1) as usize;
            return (signals, stepper.time(), 4 * report.substeps.max(steps));
        }
        before = signals;
    }
}

/// Error of a signal beside the interval of rests, which is a point without friction.
fn outside(signal: f64, rest: f64, ends: &[f64]) -> f64 {
    let low = ends.iter().copied().fold(rest, f64::min);
    let high = ends.iter().copied().fold(rest, f64::max);
    (low - signal).max(signal - high).max(0.0)
}

/// Rests of 100 inputs within the limits; `None` for a rig that nothing holds.
fn rests(name: &str, plant: &Plant, draws: &[Vec<f64>]) -> Option<Vec<Rest<f64>>> {
    let start = vec![0.0; plant.state_len()];
    let rest = |inputs: &Vec<f64>| plant.rest(&plant.values(), inputs, &start);
    match rest(&draws[0]) {
        Err(SimulationError::NoRest { reason, .. }) => {
            assert_eq!(
                (FREE.contains(&name), reason),
                (true, NoRest::Free),
                "{name}"
            );
            None
        }
        _ => Some(
            draws
                .iter()
                .map(|inputs| rest(inputs).expect(name))
                .collect(),
        ),
    }
}

/// Largest less smallest of each signal.
fn ranges(rests: &[Rest<f64>]) -> Vec<f64> {
    let range = |sensor: usize| {
        let signals = rests.iter().map(|rest| rest.signals[sensor]);
        let (low, high) = (signals.clone(), signals);
        high.fold(f64::MIN, f64::max) - low.fold(f64::MAX, f64::min)
    };
    (0..rests[0].signals.len()).map(range).collect()
}

#[test]
fn shipped_rigs_rest_where_a_long_simulation_ends() {
    let (mut seed, mut judged) = (1, 0);
    for (name, plant) in shipped() {
        let draws: Vec<Vec<f64>> = (0..100).map(|_| drawn(&plant, &mut seed)).collect();
        let Some(rests) = rests(&name, &plant, &draws) else {
            continue;
        };
        if UNDAMPED.contains(&name.as_str()) {
            continue;
        }
        let ranges = ranges(&rests);
        let count = if plant.state_len() > 12 { 3 } else { 10 };
        let (mut worst, mut longest, mut ratio) = (0.0f64, 0.0f64, f64::INFINITY);
        for (inputs, rest) in draws.iter().zip(&rests).take(count) {
            let (signals, time, evaluations) = simulated(&plant, inputs);
            let intervals = plant.rest_intervals(&plant.values(), inputs, &rest.state);
            let ends = intervals.expect("ends of the rests that were found");
            let ends: Vec<_> = ends
                .iter()
                .flat_map(|found| found.ends.iter().flatten())
                .collect();
            for (sensor, (&signal, range)) in signals.iter().zip(&ranges).enumerate() {
                let ends: Vec<f64> = ends.iter().map(|end| end.signals[sensor]).collect();
                let error = outside(signal, rest.signals[sensor], &ends);
                worst = worst.max(error / range.max(1e-12));
            }
            longest = longest.max(time);
            ratio = ratio.min(evaluations as f64 / rest.evaluations as f64);
        }
        let most = |count: fn(&Rest<f64>) -> usize| rests.iter().map(count).max().unwrap_or(0);
        println!(
            "{name}: {worst:.1e} of range, {longest:.0} s simulated, {} steps, {} evaluations, \
             1/{ratio:.0} of the simulation's, certified {:?}",
            most(|rest| rest.steps),
            most(|rest| rest.evaluations),
            rests[0].contraction
        );
        assert!(worst < 1e-8, "{name}: {worst:e}");
        assert!(ratio > 50.0, "{name}: {ratio}");
        assert!(!rests.iter().any(|rest| rest.fallback), "{name}");
        for rest in rests.iter().filter(|rest| rest.contraction.is_some()) {
            let certified = rest.contraction.expect("filtered").steps;
            assert!(
                rest.steps <= certified,
                "{name}: {} of {certified}",
                rest.steps
            );
        }
        judged += 1;
    }
    assert!(judged >= 10, "{judged} rigs");
}
