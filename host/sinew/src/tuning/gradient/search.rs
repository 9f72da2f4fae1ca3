//! Search of the settings over the loops of a tuning.

use rayon::prelude::*;
use sinew_model::spec::ModelSpec;
use sinew_sim::{Dual, Scalar};

use super::closed_loop::{self, Course, Linear, SEEDS, Seeded};
use super::controller::Settings;
use super::levenberg::{self, Descent, Ended, Quadratic};
use super::network::Predictor;
use crate::closed_loop::baseline::Training;
use crate::closed_loop::mpc::Weights;
use crate::closed_loop::scenario::{Run, Scenario};
use crate::tuning::optimise::{self, Budget, Range};
use crate::tuning::search_space::LogarithmicSpace;

/// Most evaluations of the simplex that polishes, in corners of its first.
const POLISHED: usize = 10;

/// Result of a search.
#[derive(Clone, Debug)]
pub struct Found {
    /// The cheapest weights.
    pub weights: Weights,
    /// Place, cost and evaluations of the gradients; with the polish.
    pub descent: Descent,
    /// Evaluations of the simplex after a stall.
    pub polished: usize,
}

/// Loops of a tuning with a model in them.
pub struct Search<'a> {
    /// The model.
    pub spec: &'a ModelSpec,
    /// The loops.
    pub training: &'a Training<'a>,
    /// Unknowns of the search.
    pub space: &'a LogarithmicSpace,
    /// Told of every evaluation.
    pub progress: &'a (dyn Fn() + Sync),
}

/// A place of the search.
pub(super) struct Place<'a> {
    space: &'a LogarithmicSpace,
    at: &'a [f64],
}

fn settings<S: Scalar>(weights: &Weights, mut number: impl FnMut(usize, f64) -> S) -> Settings<S> {
    let gain = number(0, weights.disturbance_gain);
    let inputs = weights.move_suppression.len();
    let mut all = |values: &[f64], first: usize| -> Vec<S> {
        let places = values.iter().enumerate();
        places.map(|(i, value)| number(first + i, *value)).collect()
    };
    Settings {
        gain,
        moves: all(&weights.move_suppression, 1),
        tracking: all(&weights.tracking_weight, 1 + inputs),
        iterations: weights.iterations,
    }
}

impl Seeded for Place<'_> {
    fn seeded<const N: usize>(&self, first: usize) -> Settings<Dual<N>> {
        let unknowns: Vec<Option<usize>> = self.space.unknowns().collect();
        settings(&self.space.weights(self.at), |weight, value| {
            let mut number = Dual::constant(value);
            let seed = unknowns[weight].and_then(|unknown| unknown.checked_sub(first));
            if let Some(derivative) = seed.and_then(|seed| number.derivative.get_mut(seed)) {
                *derivative = value;
            }
            number
        })
    }

    fn plain(&self) -> Settings<f64> {
        settings(&self.space.weights(self.at), |_, value| value)
    }
}

/// Runs a loop with weights where the model has no derivatives here: on the firmware. It keeps the
/// reason of a failure.
pub type Runner<'a> = &'a (dyn Fn(&Weights, &Scenario) -> Result<Run, ()> + Sync);

/// Step of a logarithm for differences of the firmware's loops, which are rounded to single
/// precision.
const DIFFERENCE: f64 = 0.03;

impl Search<'_> {
    /// True where the loops have derivatives: a dense network on past readings without a budget,
    /// and plants of this project. Everything else is searched by differences of the firmware's own
    /// loops.
    pub fn is_exact(&self) -> bool {
        let own = |scenario: &Scenario| scenario.program.is_none();
        let spec = self.spec;
        spec.soft_sensor.is_none()
            && spec.control.value.is_none()
            && spec.control.budget.is_none()
            && Predictor::new(spec).is_some()
            && self.training.scenarios.iter().all(own)
    }

    /// Searches from the cheapest start, in at most `evaluations`: with derivatives, which asks for
    /// [`Search::is_exact`], or by differences of what `runner` gives.
    /// A simplex goes on from the place where gradients stall.
    pub fn descend(&self, evaluations: usize, runner: Option<Runner<'_>>) -> Found {
        let cost = |at: &[f64]| self.cost(at, runner);
        let (ranges, starts) = (&self.space.ranges, &self.space.starts);
        let descent = if runner.is_none() {
            let exact = |at: &[f64]| self.by_derivatives(at);
            levenberg::descend(ranges, starts, evaluations, 1, cost, exact)
        } else {
            let price = 2 * ranges.len() + 1;
            let differences = |at: &[f64]| self.by_differences(at, runner);
            levenberg::descend(ranges, starts, evaluations, price, cost, differences)
        };
        self.polished(descent, evaluations, cost)
    }

    /// The cheapest weights, after a simplex where gradients stalled.
    fn polished(
        &self,
        mut descent: Descent,
        evaluations: usize,
        cost: impl Fn(&[f64]) -> f64 + Sync,
    ) -> Found {
        let mut polished = 0;
        let left = evaluations.saturating_sub(descent.made);
        if descent.ended == Ended::Stalled && descent.cost.is_finite() && left > 1 {
            let ends = self.space.ranges.iter();
            let ranges = ends.map(|[low, high]| Range::logarithmic(low.exp(), high.exp()));
            let start: Vec<f64> = descent.place.iter().map(|z| z.exp()).collect();
            let most = left.min(POLISHED * (descent.place.len() + 1));
            let found = optimise::search(
                &ranges.collect::<Vec<_>>(),
                &[start],
                Budget::Evaluations(most),
                |at| cost(&at.iter().map(|value| value.ln()).collect::<Vec<_>>()),
            );
            polished = found.evaluations;
            if found.cost < descent.cost {
                descent.place = found.best.iter().map(|value| value.ln()).collect();
                descent.cost = found.cost;
            }
        }
        Found {
            weights: self.space.weights(&descent.place),
            descent,
            polished,
        }
    }

    /// Objective at a place; infinite where a loop does not end.
    pub fn cost(&self, at: &[f64], runner: Option<Runner<'_>>) -> f64 {
        (self.progress)();
        let squares = self.training.scenarios.par_iter().map(|scenario| {
            let all = self.residuals(at, scenario, runner)?;
            Some(all.iter().map(|r| r * r).sum::<f64>())
        });
        let squares: Option<Vec<f64>> = squares.collect();
        squares.map_or(f64::INFINITY, |squares| squares.iter().sum())
    }

    fn residuals(
        &self,
        at: &[f64],
        scenario: &Scenario,
        runner: Option<Runner<'_>>,
    ) -> Option<Vec<f64>> {
        let Some(runner) = runner else {
            let place = self.place(at);
            return closed_loop::plain(scenario, self.spec, self.training, &place);
        };
        let run = runner(&self.space.weights(at), scenario).ok()?;
        let course = Course { y: run.y, u: run.u };
        Some(closed_loop::residuals(&course, scenario, self.training))
    }

    pub(super) fn place<'b>(&'b self, at: &'b [f64]) -> Place<'b> {
        Place {
            space: self.space,
            at,
        }
    }

    pub(super) fn by_derivatives(&self, at: &[f64]) -> Option<Quadratic> {
        (self.progress)();
        let (place, unknowns) = (self.place(at), at.len());
        let parts = self.training.scenarios.iter().flat_map(|scenario| {
            (0..unknowns)
                .step_by(SEEDS)
                .map(move |first| (scenario, first))
        });
        let parts: Vec<(&Scenario, usize)> = parts.collect();
        let linear = parts.par_iter().map(|(scenario, first)| {
            let count = (unknowns - first).min(SEEDS);
            closed_loop::linear(scenario, self.spec, self.training, &place, *first, count)
        });
        let linear = linear.collect::<Option<Vec<Linear>>>()?;
        let per_loop = unknowns.div_ceil(SEEDS).max(1);
        let mut sum = Quadratic::zero(unknowns);
        for parts in linear.chunks(per_loop) {
            for (i, residual) in parts[0].residuals.iter().enumerate() {
                let row = parts
                    .iter()
                    .flat_map(|part| part.jacobian[i].iter().copied());
                sum.add(*residual, &row.collect::<Vec<f64>>());
            }
        }
        sum.is_finite().then_some(sum)
    }

    fn by_differences(&self, at: &[f64], runner: Option<Runner<'_>>) -> Option<Quadratic> {
        (self.progress)();
        let mut places = vec![at.to_vec()];
        for i in 0..at.len() {
            for step in [DIFFERENCE, -DIFFERENCE] {
                let mut place = at.to_vec();
                place[i] += step;
                places.push(place);
            }
        }
        let loops = places.iter().flat_map(|place| {
            (self.training.scenarios.iter()).map(move |scenario| (place, scenario))
        });
        let loops: Vec<_> = loops.collect();
        let all = loops
            .par_iter()
            .map(|(place, scenario)| self.residuals(place, scenario, runner));
        let all = all.collect::<Option<Vec<Vec<f64>>>>()?;
        let scenarios = self.training.scenarios.len();
        let mut sum = Quadratic::zero(at.len());
        for scenario in 0..scenarios {
            for (k, residual) in all[scenario].iter().enumerate() {
                let of = |place: usize| all[place * scenarios + scenario][k];
                let row =
                    (0..at.len()).map(|i| (of(2 * i + 1) - of(2 * i + 2)) / (2.0 * DIFFERENCE));
                sum.add(*residual, &row.collect::<Vec<f64>>());
            }
        }
        sum.is_finite().then_some(sum)
    }
}
