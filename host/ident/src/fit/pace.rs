//! Cost of simulating a rig, and the step budget of a search that tries other numbers.

use sinew_sim::{Plant, SimulationSettings, Stepper};

use super::experiment::Experiment;

/// By how much a trial may be faster than the rig that the search begins with; and how fast it may
/// be in any case, in units of one over the usual interval. A search that runs off towards a stiff
/// rig would otherwise take minutes to find that it does no good.
const FASTER: f64 = 4.0;
const FAST: f64 = 3.2;

/// Products of a rig's forces from where on its steps cost more than usual, in proportion and up to
/// `MOST` times as much: a chain that tendons pull takes a hundred, a body on a spring four.
const USUAL_TERMS: f64 = 40.0;
const MOST: f64 = 2.0;

/// Cost of a sub-step beside the usual one. The sub-steps of a search are longer by this factor,
/// and its fewest rows fewer: a search among a hundred candidate terms on six bodies would
/// otherwise take a quarter of an hour.
pub(crate) fn step_cost(plant: &Plant) -> f64 {
    (plant.terms() as f64 / USUAL_TERMS).clamp(1.0, MOST)
}

/// The plant's fastest rate at rest times the usual interval of the recordings.
pub(crate) fn pace(plant: &Plant, values: &[f64], experiments: &[Experiment]) -> f64 {
    at_rest(plant, values) * usual(experiments)
}

/// Sub-steps that the integrator takes for a row, about, where none is longer than `step` over the
/// fastest rate (docs/explanation/plant.md, eq. 19).
pub(crate) fn substeps(pace: f64, step: f64) -> usize {
    ((pace / step).ceil() as usize).next_power_of_two().max(1)
}

/// Sub-steps of this length; what moves many times as fast as the rig does over the recordings is
/// refused as too stiff.
pub(crate) fn settings(
    plant: &Plant,
    values: &[f64],
    experiments: &[Experiment],
    step: f64,
) -> SimulationSettings {
    let known = met(plant, values, experiments).unwrap_or_else(|| at_rest(plant, values));
    let fastest = (FASTER * known).max(FAST / usual(experiments));
    let gaps = experiments
        .iter()
        .flat_map(|experiment| experiment.t.windows(2));
    let longest = gaps.map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    let usually = SimulationSettings::default();
    SimulationSettings {
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

/// The fastest rate over the recordings, 1/s: stops and stiffening springs included. None where the
/// rig cannot be simulated over any of them.
fn met(plant: &Plant, values: &[f64], experiments: &[Experiment]) -> Option<f64> {
    let of = |experiment: &Experiment| -> Option<f64> {
        let drive = experiment.drive(plant, 0..experiment.rows()).ok()?;
        let first = |column: &Vec<f64>| column.iter().copied().find(|sample| sample.is_finite());
        let seen: Vec<Option<f64>> = experiment.signals.iter().map(first).collect();
        let start = plant.initial_state(values, &seen).ok()?;
        let run = plant.simulate(values, &start, &drive, &experiment.t).ok()?;
        Some(run.report.rate)
    };
    experiments.iter().filter_map(of).max_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Column, Recording};
    use sinew_sim::{Rig, SimulationError};

    /// A stop that only the second recording meets is no reason to refuse the rig there.
    #[test]
    fn a_stop_that_one_recording_meets_is_allowed_for() {
        let text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"m\"\nmotion = \"slide\"\n\
                    inertia = 1.0\n[[spring]]\nname = \"s\"\nfrom = \"ground\"\nto = \"m\"\nstiffness = 40.0\n\
                    [[actuator]]\nname = \"a\"\ndrives = \"m\"\ninput = \"u_N\"\ngain = 1.0\n\
                    [[sensor]]\nname = \"e\"\nreads = \"m.position\"\nsignal = \"q_m\"\n\
                    [[effect]]\nkind = \"end_stop\"\ncomponent = \"m\"\nposition = 0.5\nstiffness = 1e8\n\
                    damping = 10.0\nside = 1.0\n";
        let rig = Rig::parse(text, "x.toml").unwrap_or_else(|error| panic!("{error}"));
        let plant = Plant::new(&rig).expect("the rig is sound");
        let experiment = |force: f64| {
            let t: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
            let columns = [("u_N", force), ("q_m", 0.0)].map(|(name, value)| Column {
                name: name.into(),
                values: vec![value; t.len()],
            });
            let recording = Recording::new("x.csv", t.clone(), columns.into())
                .expect("the text is a recording");
            Experiment::new(&plant, &recording).expect("the recording fits the rig")
        };
        let most = |experiments: &[Experiment]| {
            settings(&plant, &plant.values(), experiments, 0.1).max_substeps
        };
        let (without, with) = (
            most(&[experiment(1.0)]),
            most(&[experiment(1.0), experiment(40.0)]),
        );
        assert!(without < 100, "{without}");
        // sqrt(1e8) 1/s over 10 ms at 0.1 are 1,000 sub-steps.
        assert!(with >= 1000, "{with}");
    }

    #[test]
    fn a_chain_with_tendons_is_dear_and_masses_on_springs_are_not() {
        let of = |name: &str| {
            let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../rigs/");
            let rig =
                Rig::load(format!("{folder}{name}.toml")).expect("the rig ships with the project");
            step_cost(&Plant::new(&rig).expect("the rig is sound"))
        };
        assert_eq!(of("tendon"), MOST);
        for cheap in ["mass-spring-damper", "two-mass-drive", "three-mass", "emps"] {
            assert_eq!(of(cheap), 1.0, "{cheap}");
        }
    }

    #[test]
    fn a_search_is_kept_from_rigs_that_cost_many_times_what_it_began_with() {
        let file = |name: &str| {
            let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../rigs/");
            format!("{folder}mass-spring-damper{name}")
        };
        let plant = Plant::new(&Rig::load(file(".toml")).expect("the rig ships with the project"))
            .expect("the rig is sound");
        let recording =
            Recording::read(file(".fit.csv")).expect("the recording ships with the project");
        let experiments =
            [Experiment::new(&plant, &recording).expect("the recording fits the rig")];
        let mut values = plant.values();
        let slot = plant.slot("coil.stiffness").expect("there is a spring");
        let mut runs = |factor: f64| {
            let settings = settings(&plant, &plant.values(), &experiments, 0.1);
            values[slot] = factor * plant.values()[slot];
            let drive = experiments[0].drive(&plant, 0..experiments[0].rows());
            let start = vec![0.0; plant.state_len()];
            let plant = plant.with_settings(settings);
            plant.simulate(
                &values,
                &start,
                &drive.expect("the rig can be fitted"),
                &experiments[0].t,
            )
        };
        assert!(runs(1.0).is_ok());
        assert!(runs(30.0).is_ok(), "a wrong rig still has to be found");
        let refused = matches!(runs(1e6), Err(SimulationError::TooStiff { .. }));
        assert!(refused, "a thousand times as fast");
    }
}
