//! Searches for weights whose loops run in a firmware built for this computer.

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use sinew_model::fingerprint;
use sinew_model::spec::ModelSpec;

use crate::closed_loop::baseline::Training;
use crate::closed_loop::mpc::{MpcController, Weights};
use crate::closed_loop::scenario::{Run, Scenario};
use crate::closed_loop::setup::Setup;
use crate::project::{self, Board, Built, Optimise};
use crate::tuning::cost_to_go;
use crate::tuning::gradient::Search;
use crate::tuning::gradient::levenberg::Ended;
use crate::tuning::search_space::{Budget, Cheapest, SearchSpace};
use sinew_ident::error::{Error, Result};

/// Course of a search by gradients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gradients {
    /// Objective that it found, of the loops that it searched on.
    pub objective: f64,
    /// Evaluations without derivatives.
    pub plain: usize,
    /// Evaluations with derivatives.
    pub linear: usize,
    /// Derivatives of the closed loop, not differences.
    pub exact: bool,
    /// Reason of the end.
    pub ended: Ended,
    /// Evaluations of the simplex after a stall.
    pub polished: usize,
}

/// One firmware, built for this computer.
pub(crate) struct Firmware<'a> {
    folder: &'a Path,
    built: Built,
    model: u32,
    sensed: bool,
}

impl<'a> Firmware<'a> {
    /// # Errors
    /// A folder that cannot be written, or a firmware that does not build.
    pub(crate) fn build(
        spec: &ModelSpec,
        folder: &'a Path,
        cache: Option<&Path>,
        quiet: bool,
    ) -> Result<Self> {
        eprint!(
            "{}",
            project::kept(&project::write(folder, spec, Optimise::Speed)?)
        );
        Ok(Self {
            folder,
            built: project::build_shown(folder, Board::Host, cache, quiet)?,
            model: fingerprint(spec),
            sensed: spec.soft_sensor.is_some(),
        })
    }

    /// Searches the weights of this firmware; with the last failure of a run, where there was one.
    fn cheapest(
        &self,
        space: &SearchSpace,
        budget: Budget,
        training: &Training<'_>,
        progress: &(dyn Fn() + Sync),
    ) -> (Cheapest, Option<Error>) {
        let failure = Mutex::new(None);
        let found = space.cheapest(budget, |weights| {
            progress();
            let cost = training.cost(|scenario| self.run(weights, scenario));
            cost.unwrap_or_else(|error| {
                // A panic elsewhere cannot leave an error half stored.
                *failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                f64::INFINITY
            })
        });
        let failure = failure.into_inner();
        (found, failure.unwrap_or_else(PoisonError::into_inner))
    }

    /// A device that has run nothing yet, since a reset keeps the command applied last.
    ///
    /// # Errors
    /// The device cannot be reached, or the plant diverges.
    pub(crate) fn run(&self, weights: &Weights, scenario: &Scenario) -> Result<Run> {
        let mut device = Setup::start(self.folder, Board::Host, &self.built)?;
        let mut mpc = MpcController::new(&mut device, self.model)?.sensed(self.sensed);
        mpc.tune(weights)?;
        scenario.run(&mut mpc)
    }
}

/// The cheapest weights of a model with a number of evaluations told to `progress`; with the last
/// failure of a run, where there was one.
///
/// Rows of a cost-to-go are printed for the weights beside them, so a firmware with one cannot try
/// others. The search is then on a horizon that sees as far without a cost-to-go, and
/// [`refine`](cost_to_go::refine) brings what it found to the model itself.
pub(super) fn cheapest(
    spec: &ModelSpec,
    (folder, cache, quiet): (&Path, Option<&Path>, bool),
    (space, budget): (&SearchSpace, Budget),
    training: &Training<'_>,
    progress: &(dyn Fn() + Sync),
) -> Result<(Cheapest, Option<Error>)> {
    let build = |spec: &ModelSpec| Firmware::build(spec, folder, cache, quiet);
    let Some(stand_in) = cost_to_go::stand_in(spec) else {
        return Ok(build(spec)?.cheapest(space, budget, training, progress));
    };
    let (budget, left) = cost_to_go::shared(budget);
    let (found, failure) = build(&stand_in)?.cheapest(space, budget, training, progress);
    if !found.cost.is_finite() {
        return Ok((found, failure));
    }
    let refined = cost_to_go::refine(&found, space.searched(), left, |weights| {
        progress();
        let firmware = build(&cost_to_go::weighted(spec, weights))?;
        training.cost(|scenario| firmware.run(weights, scenario))
    });
    let (refined, error) = refined;
    Ok((refined, failure.or(error)))
}

/// The cheapest weights of a model by the derivatives of its loops, by differences of them where
/// there are none; with the last failure of a run, where there was one.
///
/// As in [`cheapest`], a model with a cost-to-go gets its weights from one without that sees as
/// far.
pub(super) fn by_gradient(
    spec: &ModelSpec,
    (folder, cache, quiet): (&Path, Option<&Path>, bool),
    (space, evaluations): (&SearchSpace, usize),
    training: &Training<'_>,
    progress: &(dyn Fn() + Sync),
) -> Result<(Cheapest, Gradients, Option<Error>)> {
    let build = |spec: &ModelSpec| Firmware::build(spec, folder, cache, quiet);
    let stand_in = cost_to_go::stand_in(spec);
    let logarithmic = space.logarithmic();
    let search = Search {
        spec: stand_in.as_ref().unwrap_or(spec),
        training,
        space: &logarithmic,
        progress,
    };
    let (budget, left) = match &stand_in {
        None => (evaluations, 0),
        Some(_) => cost_to_go::split(evaluations),
    };
    let exact = search.is_exact();
    let failure = Mutex::new(None);
    let found = if exact {
        search.descend(budget, None)
    } else {
        let firmware = build(search.spec)?;
        let run = |weights: &Weights, scenario: &Scenario| {
            let run = firmware.run(weights, scenario);
            run.map_err(|error| {
                // A panic elsewhere cannot leave an error half stored.
                *failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            })
        };
        search.descend(budget, Some(&run))
    };
    let failure = failure.into_inner().unwrap_or_else(PoisonError::into_inner);
    let descent = &found.descent;
    let gradients = Gradients {
        objective: descent.cost,
        plain: descent.plain,
        linear: descent.linear,
        exact,
        ended: descent.ended,
        polished: found.polished,
    };
    let cheapest = Cheapest {
        weights: found.weights,
        cost: descent.cost,
        evaluations: descent.made + found.polished,
    };
    if stand_in.is_none() || !cheapest.cost.is_finite() {
        return Ok((cheapest, gradients, failure));
    }
    let (refined, error) = cost_to_go::refine(&cheapest, space.searched(), left, |weights| {
        progress();
        let firmware = build(&cost_to_go::weighted(spec, weights))?;
        training.cost(|scenario| firmware.run(weights, scenario))
    });
    Ok((refined, gradients, failure.or(error)))
}
