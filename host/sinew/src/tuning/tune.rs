//! Tuning of every controller for one objective with one budget, on the same closed loops. The
//! report is on a closed loop with another plant, reference and noise.

use std::path::Path;

use sinew_model::spec::ModelSpec;

use crate::closed_loop::baseline::{BaselineController, Training, Tuning, tune};
use crate::closed_loop::mpc::Weights;
use crate::closed_loop::scenario::{Run, Scenario, Score};
use crate::closed_loop::setup::{Setup, TUNING_PLANTS};
pub use crate::tuning::firmware::Gradients;
use crate::tuning::firmware::{Firmware, by_gradient, cheapest};
use crate::tuning::objective::Objective;
use crate::tuning::optimise;
use crate::tuning::search_space::{Budget, SearchSpace};
use crate::tuning::shape::Shape;
use sinew_ident::cli::progress::Stage;
use sinew_ident::error::{Error, Result};

/// Method of a search for the weights of a controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Nelder-Mead.
    #[default]
    Simplex,
    /// Levenberg-Marquardt on the derivatives of the closed loop.
    Gradient,
    /// CMA-ES, then Nelder-Mead.
    Population,
}

/// Training loops and the reported loop of a tuning.
pub struct Request<'a> {
    /// The loop's task.
    pub bench: &'a Setup<'a>,
    /// Loops for tuning.
    pub training: Training<'a>,
    /// The loop that is reported.
    pub held_out: &'a Scenario,
    /// Evaluations of the objective for each controller.
    pub evaluations: usize,
    /// The gain of the disturbance estimate, where it is not searched.
    pub disturbance_gain: Option<f64>,
    /// Most Newton iterations a step, where they are not the model's.
    pub iterations: Option<u8>,
    /// One factor of all of Lambda, and Q as it is.
    pub tied: bool,
    /// Method of the search; PID and RISE have no gradient.
    pub by: Method,
    /// Seed of a population.
    pub seed: u64,
    /// No progress.
    pub quiet: bool,
}

/// The loop that is reported, run.
pub struct HeldOut {
    /// The loop.
    pub run: Run,
    /// Its score.
    pub score: Score,
    /// Its objective.
    pub cost: f64,
}

/// One controller before and after tuning.
pub struct Line {
    /// `MPC`, `PID`, `RISE`.
    pub name: &'static str,
    /// Evaluations of the objective that were made.
    pub evaluations: usize,
    /// Objective over the loops for tuning.
    pub training: [f64; 2],
    /// The loop that is reported.
    pub held_out: [HeldOut; 2],
    /// Course of a search by gradients, one a shape.
    pub gradients: Vec<Gradients>,
}

/// A controller without a model, tuned.
pub struct TunedFeedback<L: BaselineController> {
    /// Scores before and after.
    pub line: Line,
    /// The gains found.
    pub tuning: Vec<Tuning<L::Gains>>,
}

impl Request<'_> {
    fn judged(&self, run: Run) -> HeldOut {
        let t = &self.training;
        let score = run.score(t.limits);
        let cost = t.objective.cost(&score, t.output_range, t.input_range);
        HeldOut { run, score, cost }
    }
}

/// Tunes a controller without a model; before: the cheapest start of the search.
///
/// # Errors
/// Inputs and outputs do not pair off, or the reported plant diverges under gains that the others
/// bore.
pub fn tune_feedback<L: BaselineController>(request: &Request<'_>) -> Result<TunedFeedback<L>> {
    let stage = Stage::begin(format!("tune the {}", L::NAME), request.quiet);
    let told = counter(&stage, request.evaluations);
    let budget = match request.by {
        Method::Population => optimise::Budget::Population(request.evaluations, request.seed),
        Method::Simplex | Method::Gradient => optimise::Budget::Apart(request.evaluations),
    };
    let tuned = tune::<L>(&request.training, budget, &told)?;
    drop(told);
    let judged = |tuning: Vec<Tuning<L::Gains>>| -> Result<HeldOut> {
        let run = request.bench.run_baseline::<L>(tuning, request.held_out)?;
        Ok(request.judged(run.run))
    };
    let line = Line {
        name: L::NAME,
        evaluations: tuned.found.evaluations,
        training: [tuned.found.start_cost, tuned.found.cost],
        held_out: [judged(tuned.before)?, judged(tuned.after.clone())?],
        gradients: Vec::new(),
    };
    stage.end(format!("{} evaluations", line.evaluations));
    Ok(TunedFeedback {
        line,
        tuning: tuned.after,
    })
}

/// A progress line that counts evaluations.
fn counter(stage: &Stage, of: usize) -> impl Fn() + Sync + '_ {
    let done = std::sync::atomic::AtomicUsize::new(0);
    move || {
        let done = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        stage.share(done, of.max(done), "evaluations");
    }
}

fn no_weights() -> Error {
    Error::failed("no weights give a loop that stays finite")
}

/// Iterations of the simplex from each start in `sinew build`.
const QUICK: Budget = Budget::Iterations(30);

/// Tunes the weights of a network straight from training with a small budget: on the fitted plant
/// and plants near it, never on the plant, the reference or the noise of the comparison. The
/// weights are left in `spec`.
///
/// # Errors
/// Firmware that does not build or run, or no weights that give a finite cost.
pub fn tune_quickly(
    spec: &mut ModelSpec,
    setup: &Setup<'_>,
    folder: &Path,
    cache: Option<&Path>,
    quiet: bool,
) -> Result<()> {
    let stage = Stage::begin("tune the controller", quiet);
    let scenarios = setup.tuning_scenarios(&setup.tuning_plants(TUNING_PLANTS))?;
    let task = setup.task;
    let space = SearchSpace::untuned(
        &task.tracking_weight,
        task.move_suppression.as_deref(),
        task.limits.len(),
        spec.control.iterations,
    );
    let training = setup.training(&scenarios, Objective::Tracking);
    let built = (folder, cache, quiet);
    let (found, failure) = cheapest(spec, built, (&space, QUICK), &training, &|| ())?;
    if found.cost.is_nan() || found.cost >= f64::MAX {
        return Err(failure.unwrap_or_else(no_weights));
    }
    spec.control.move_suppression = found.weights.move_suppression;
    spec.control.disturbance_gain = found.weights.disturbance_gain;
    stage.end(format!(
        "move suppression {:.1e}, disturbance gain {:.2}",
        spec.control.move_suppression[0], spec.control.disturbance_gain
    ));
    Ok(())
}

/// Tunes the predictive controller: for each shape a share of the budget on Q (the first output's
/// is 1, as only ratios count), Lambda and the gain of the disturbance estimate. Before: the model
/// as it came.
///
/// # Errors
/// Firmware that does not build or run, or no weights that give a finite cost.
pub fn tune_mpc(
    request: &Request<'_>,
    spec: &ModelSpec,
    shapes: &[Shape],
    folder: &Path,
    cache: Option<&Path>,
) -> Result<(Line, ModelSpec)> {
    let control = &spec.control;
    let own = Weights::of(control);
    let space = SearchSpace::about(
        control,
        request.disturbance_gain,
        request.iterations,
        request.tied,
    );

    let before = {
        let firmware = Firmware::build(spec, folder, cache, request.quiet)?;
        let trained = request
            .training
            .cost(|scenario| firmware.run(&own, scenario))?;
        (
            trained,
            request.judged(firmware.run(&own, request.held_out)?),
        )
    };
    let mut best: Option<(f64, ModelSpec)> = None;
    let mut failure = None;
    let mut gradients = Vec::new();
    let (mut evaluations, share) = (0, request.evaluations / shapes.len().max(1));
    for shape in shapes {
        let mut candidate = shape.of(spec)?;
        let title = format!(
            "tune the MPC, {} and {} steps",
            shape.horizon, shape.control_horizon
        );
        let stage = Stage::begin(title, request.quiet);
        let built = (folder, cache, request.quiet);
        let told = counter(&stage, share);
        let (found, error) = match request.by {
            Method::Simplex => {
                let budget = (&space, Budget::Evaluations(share));
                cheapest(&candidate, built, budget, &request.training, &told)?
            }
            Method::Population => {
                let budget = (&space, Budget::Population(share, request.seed));
                cheapest(&candidate, built, budget, &request.training, &told)?
            }
            Method::Gradient => {
                let budget = (&space, share);
                let (found, course, error) =
                    by_gradient(&candidate, built, budget, &request.training, &told)?;
                gradients.push(course);
                (found, error)
            }
        };
        drop(told);
        failure = failure.or(error);
        let weights = found.weights;
        candidate.control.tracking_weight = weights.tracking_weight;
        candidate.control.move_suppression = weights.move_suppression;
        candidate.control.disturbance_gain = weights.disturbance_gain;
        candidate.control.iterations = weights.iterations;
        evaluations += found.evaluations;
        stage.end(format!("objective {:.3e}", found.cost));
        if found.cost < best.as_ref().map_or(f64::MAX, |(cost, _)| *cost) {
            best = Some((found.cost, candidate));
        }
    }
    let Some((mut cost, tuned)) = best else {
        return Err(failure.unwrap_or_else(no_weights));
    };
    // The firmware that is reported carries its weights itself.
    let firmware = Firmware::build(&tuned, folder, cache, request.quiet)?;
    let weights = Weights::of(&tuned.control);
    if request.by == Method::Gradient {
        // Found on the loop in double precision; what is reported is the firmware's.
        cost = (request.training).cost(|scenario| firmware.run(&weights, scenario))?;
        evaluations += 1;
    }
    let after = request.judged(firmware.run(&weights, request.held_out)?);
    let line = Line {
        name: "MPC",
        evaluations,
        training: [before.0, cost],
        held_out: [before.1, after],
        gradients,
    };
    Ok((line, tuned))
}

#[cfg(test)]
mod tests {
    use sinew_mpc::feedback::pid::PidState;
    use sinew_mpc::feedback::rise::RiseState;
    use sinew_sim::{Plant, Rig};

    use super::*;
    use crate::closed_loop::control_problem::ControlProblem;
    use crate::closed_loop::disturbance::Disturbance;
    use sinew_ident::recording::Recording;

    fn checkout(file: &str) -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../..")
            .join(file)
    }

    fn rig() -> Rig {
        Rig::load(checkout("rigs/mass-spring-damper.toml")).expect("the shipped rig is sound")
    }

    #[test]
    fn the_objective_falls_on_references_that_tuning_has_not_seen() {
        let rig = rig();
        let plant = Plant::new(&rig).expect("the rig can be simulated");
        let recording = Recording::read(checkout("rigs/mass-spring-damper.fit.csv"))
            .expect("the recording can be read");
        let task = ControlProblem::new(&rig, &plant, std::slice::from_ref(&recording), &recording)
            .expect("the recording fits the rig");
        let bench = Setup {
            plant: &plant,
            task: &task,
            seed: 3,
            disturbance: Disturbance::Ramp,
            delay_s: 0.0,
            program: None,
            fleet: None,
        };
        let scenarios = bench
            .tuning_scenarios(&[plant.values()])
            .expect("the loop starts");
        let (values, _) = bench.perturbed_plant();
        let held_out = bench.scenario(&values).expect("the loop starts");
        assert_ne!(scenarios[0].reference, held_out.reference);
        let request = |objective| Request {
            bench: &bench,
            training: bench.training(&scenarios, objective),
            held_out: &held_out,
            evaluations: 120,
            disturbance_gain: None,
            iterations: None,
            tied: false,
            by: Method::Simplex,
            seed: 1,
            quiet: true,
        };
        let falls = |line: &Line| {
            let [before, after] = [line.held_out[0].cost, line.held_out[1].cost];
            assert!(
                line.training[1] < 0.8 * line.training[0],
                "{}: {:?}",
                line.name,
                line.training
            );
            assert!(after < 0.9 * before, "{}: {before} to {after}", line.name);
            assert!(line.evaluations <= 120);
        };
        let of = |objective| {
            let pid = tune_feedback::<PidState>(&request(objective)).expect("the plant bears it");
            let rise = tune_feedback::<RiseState>(&request(objective)).expect("the plant bears it");
            falls(&pid.line);
            falls(&rise.line);
            pid
        };
        let accurate = of(Objective::Tracking);
        let smooth =
            tune_feedback::<PidState>(&request(Objective::Smooth)).expect("the plant bears it");
        let effort = |line: &Line| line.held_out[1].score.effort[0];
        assert!(
            effort(&smooth.line) < 0.7 * effort(&accurate.line),
            "another objective, the same gains"
        );
        let again =
            tune_feedback::<PidState>(&request(Objective::Tracking)).expect("the plant bears it");
        assert_eq!(accurate.tuning, again.tuning);
    }

    /// Objectives of PID and RISE at equal evaluations, by the simplex and by populations of five
    /// seeds: on the plants of tuning, and on ten that it has not seen.
    #[test]
    #[ignore = "minutes; prints figures of docs/decisions/0109-population-search.md"]
    fn population_beside_the_simplex() {
        fn figures<L: BaselineController>(training: &Training<'_>, unseen: &Training<'_>) {
            for evaluations in [120, 300, 1000] {
                let found = |budget| {
                    let tuned = tune::<L>(training, budget, &|| ()).expect("the plants bear it");
                    assert!(tuned.found.evaluations <= evaluations);
                    [tuned.found.cost, unseen.cost_of::<L>(&tuned.after)]
                };
                let shown = |method, [seen, unseen]: [f64; 2]| {
                    println!(
                        "{} {evaluations} {method}: {seen:.4e}, {unseen:.4e}",
                        L::NAME
                    );
                };
                shown("simplex", found(optimise::Budget::Apart(evaluations)));
                let mut population: Vec<[f64; 2]> = (1..=5)
                    .map(|seed| found(optimise::Budget::Population(evaluations, seed)))
                    .collect();
                population.sort_by(|a, b| a[0].total_cmp(&b[0]));
                population
                    .into_iter()
                    .for_each(|costs| shown("population", costs));
            }
        }
        let rig = rig();
        let plant = Plant::new(&rig).expect("the rig can be simulated");
        let recording = Recording::read(checkout("rigs/mass-spring-damper.fit.csv"))
            .expect("the recording can be read");
        let task = ControlProblem::new(&rig, &plant, std::slice::from_ref(&recording), &recording)
            .expect("the recording fits the rig");
        let setup = |seed| Setup {
            plant: &plant,
            task: &task,
            seed,
            disturbance: Disturbance::None,
            delay_s: 0.0,
            program: None,
            fleet: None,
        };
        let (bench, other) = (setup(1), setup(5001));
        let loops = |bench: &Setup<'_>, count| {
            let plants = bench.tuning_plants(count);
            bench.tuning_scenarios(&plants).expect("the loops start")
        };
        let (seen, unseen) = (loops(&bench, TUNING_PLANTS), loops(&other, 11));
        for objective in [Objective::Tracking, Objective::Peak] {
            println!("{}", objective.name());
            let training = bench.training(&seen, objective);
            let unseen = other.training(&unseen[1..], objective);
            figures::<PidState>(&training, &unseen);
            figures::<RiseState>(&training, &unseen);
        }
    }
}
