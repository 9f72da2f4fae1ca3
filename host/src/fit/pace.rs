//! What simulating a rig costs, and how dear it may become while a search tries other numbers.

use sinew_sim::{Plant, Settings, Stepper};

use super::experiment::Experiment;

/// By how much a trial may be faster than the rig that the search begins with; and how fast it may be in any
/// case, in units of one over the usual interval. A search that runs off towards a stiff rig would otherwise
/// take minutes to find that it does no good.
const FASTER: f64 = 4.0;
const FAST: f64 = 3.2;

/// The plant's fastest rate at rest times the usual interval of the recordings.
pub(crate) fn pace(plant: &Plant, values: &[f64], experiments: &[Experiment]) -> f64 {
    at_rest(plant, values) * usual(experiments)
}

/// Sub-steps that the integrator takes for a row, about, where none is longer than `step` over the fastest rate
/// (docs/plant.md, eq. 19).
pub(crate) fn substeps(pace: f64, step: f64) -> usize {
    ((pace / step).ceil() as usize).next_power_of_two().max(1)
}

/// Sub-steps of this length; what moves many times as fast as the rig does over the first recording is refused
/// as too stiff.
pub(crate) fn settings(
    plant: &Plant,
    values: &[f64],
    experiments: &[Experiment],
    step: f64,
) -> Settings {
    let known = met(plant, values, experiments).unwrap_or_else(|| at_rest(plant, values));
    let fastest = (FASTER * known).max(FAST / usual(experiments));
    let gaps = experiments
        .iter()
        .flat_map(|experiment| experiment.t.windows(2));
    let longest = gaps.map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    let usually = Settings::default();
    Settings {
        rate_step: step,
        max_substeps: ((fastest * longest / step).ceil() as usize).clamp(1, usually.max_substeps),
        ..usually
    }
}

/// The mean interval of the first recording, s.
fn usual(experiments: &[Experiment]) -> f64 {
    experiments.first().map_or(0.0, |experiment| {
        let t = &experiment.t;
        (t[t.len() - 1] - t[0]) / (t.len() - 1).max(1) as f64
    })
}

/// The fastest rate at rest, 1/s.
fn at_rest(plant: &Plant, values: &[f64]) -> f64 {
    let rest = vec![0.0; plant.state_len()];
    Stepper::new(plant, values, &rest).map_or(0.0, |stepper| stepper.report().rate)
}

/// The fastest rate over the first recording, 1/s: stops and stiffening springs included. None where it cannot
/// be simulated.
fn met(plant: &Plant, values: &[f64], experiments: &[Experiment]) -> Option<f64> {
    let first = experiments.first()?;
    let drive = first.drive(plant, 0..first.rows()).ok()?;
    let unseen = vec![None; plant.sensors().len()];
    let start = plant.initial_state(values, &unseen).ok()?;
    let run = plant.simulate(values, &start, &drive, &first.t).ok()?;
    Some(run.report.rate)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Recording;
    use sinew_sim::{Rig, SimulationError};

    #[test]
    fn a_search_is_kept_from_rigs_that_cost_many_times_what_it_began_with() {
        let file = |name: &str| {
            let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../rigs/");
            format!("{folder}mass-spring-damper{name}")
        };
        let plant = Plant::new(&Rig::load(file(".toml")).expect("it ships")).expect("it is sound");
        let recording = Recording::read(file(".fit.csv")).expect("it ships");
        let experiments = [Experiment::new(&plant, &recording).expect("it fits")];
        let mut values = plant.values();
        let slot = plant.slot("coil.stiffness").expect("there is a spring");
        let mut runs = |factor: f64| {
            let settings = settings(&plant, &plant.values(), &experiments, 0.1);
            values[slot] = factor * plant.values()[slot];
            let drive = experiments[0].drive(&plant, 0..experiments[0].rows());
            let start = vec![0.0; plant.state_len()];
            let plant = plant.with_settings(settings);
            plant.simulate(&values, &start, &drive.expect("it fits"), &experiments[0].t)
        };
        assert!(runs(1.0).is_ok());
        assert!(runs(30.0).is_ok(), "a wrong rig still has to be found");
        let stiff = runs(1e6).expect_err("a thousand times as fast");
        assert!(matches!(stiff, SimulationError::TooStiff { .. }), "{stiff}");
    }
}
