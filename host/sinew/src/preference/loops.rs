//! Loops that are compared: one for each of many weights about those of the model.

use std::path::Path;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sinew_ident::cli::progress::Stage;
use sinew_ident::error::{Error, Result};
use sinew_model::spec::ModelSpec;

use crate::closed_loop::control_problem::ControlProblem;
use crate::closed_loop::mpc::Weights;
use crate::closed_loop::scenario::{Run, Scenario};
use crate::preference::features::Features;
use crate::tuning::firmware::Firmware;
use crate::tuning::search_space::SearchSpace;

/// Factor by which a weight may be larger or smaller than the model's.
const REACH: f64 = 100.0;

/// One candidate.
#[derive(Clone, Debug)]
pub struct Loop {
    /// Its weights.
    pub weights: Weights,
    /// Its run.
    pub run: Run,
    /// What a person may judge it by.
    pub features: Features,
}

/// Runs the loops of the model's own weights and of `count` - 1 drawn ones. A loop that diverges or
/// whose command leaves the limits is no candidate.
///
/// # Errors
/// Firmware that does not build, or fewer than two loops that end.
pub fn candidates(
    spec: &ModelSpec,
    (task, scenario): (&ControlProblem, &Scenario),
    (count, seed): (usize, u64),
    (folder, cache, quiet): (&Path, Option<&Path>, bool),
) -> Result<Vec<Loop>> {
    if spec.control.value.is_some() {
        return Err(Error::arguments(
            "a model with a cost-to-go has one set of weights: its rows were made for them",
        )
        .help("ask with a model of a rig without `terminal = \"value\"`"));
    }
    let firmware = Firmware::build(spec, folder, cache, quiet)?;
    let stage = Stage::begin("run the loops", quiet);
    let mut found = Vec::new();
    for (k, weights) in drawn(spec, count, seed).into_iter().enumerate() {
        stage.share(k, count, "loops");
        let Ok(run) = firmware.run(&weights, scenario) else {
            continue;
        };
        let sound = run.y.iter().flatten().all(|y| y.is_finite());
        if sound && run.score(&task.limits).outside_limits == 0 {
            let features = Features::of(&run, task);
            found.push(Loop {
                weights,
                run,
                features,
            });
        }
    }
    if found.len() < 2 {
        return Err(Error::failed(format!(
            "{} of {count} loops stay finite and inside the limits: nothing can be compared",
            found.len()
        ))
        .help("look at the loop first: sinew compare"));
    }
    stage.end(format!("{} of {count} can be compared", found.len()));
    Ok(found)
}

/// Weights: the model's own, and others about them on logarithmic scales.
fn drawn(spec: &ModelSpec, count: usize, seed: u64) -> Vec<Weights> {
    let space = SearchSpace::about(&spec.control, None, None, false).logarithmic();
    let own = space.starts[0].clone();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut all = vec![Weights::of(&spec.control)];
    while all.len() < count {
        let one = |(own, [low, high]): (&f64, &[f64; 2])| {
            let away = REACH.ln() * (2.0 * random.random::<f64>() - 1.0);
            (own + away).clamp(*low, *high)
        };
        let place: Vec<f64> = own.iter().zip(&space.ranges).map(one).collect();
        all.push(space.weights(&place));
    }
    all
}
