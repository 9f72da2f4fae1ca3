//! Weights of a model with a cost-to-go, whose rows are printed for the weights beside them.

use sinew_ident::error::{Error, Result};
use sinew_model::spec::ModelSpec;

use crate::closed_loop::mpc::Weights;
use crate::tuning::search_space::{Budget, Cheapest};

/// Steps decided by the model that stands in for one with a cost-to-go, if its own are fewer.
const DECIDED: usize = 3;
/// Most evaluations, each a firmware of its own, that bring weights to the model itself.
const REFINED: usize = 15;
/// Part of them that goes to a factor of all of Lambda; the rest goes to one of the gain.
const OF_MOVES: f64 = 0.6;
/// First step of either factor, and the last one.
const STEPS: [f64; 2] = [4.0, 1.5];

/// A model that looks as far without a cost-to-go: its horizon is the whole preview. `None` for a
/// model without one.
pub(super) fn stand_in(spec: &ModelSpec) -> Option<ModelSpec> {
    let preview = spec.control.preview();
    let mut other = spec.clone();
    other.control.value.take()?;
    other.control.horizon = preview;
    let decided = spec.control.control_horizon.max(DECIDED).min(preview);
    if decided != spec.control.control_horizon {
        let own = other.control.clone();
        other.control.move_blocks.clear();
        other.control.control_horizon = decided;
        if other.validate().is_err() {
            // So many decision variables no firmware has.
            other.control = own;
        }
    }
    Some(other)
}

/// The model with other weights.
pub(super) fn weighted(spec: &ModelSpec, weights: &Weights) -> ModelSpec {
    let mut spec = spec.clone();
    spec.control.tracking_weight = weights.tracking_weight.clone();
    spec.control.move_suppression = weights.move_suppression.clone();
    spec.control.disturbance_gain = weights.disturbance_gain;
    spec.control.iterations = weights.iterations;
    spec
}

/// Part of a budget that goes to the search on the model that stands in, and the evaluations that
/// are left for [`refine`].
pub(super) fn shared(budget: Budget) -> (Budget, usize) {
    match budget {
        Budget::Iterations(_) => (budget, REFINED),
        Budget::Evaluations(all) => {
            let (searched, refined) = split(all);
            (Budget::Evaluations(searched), refined)
        }
        Budget::Population(all, seed) => {
            let (searched, refined) = split(all);
            (Budget::Population(searched, seed), refined)
        }
    }
}

/// As [`shared`], of a number of evaluations.
pub(super) fn split(all: usize) -> (usize, usize) {
    let refined = REFINED.min(all / 2);
    (all - refined, refined)
}

/// Weights that were found on the model that stands in, brought to the model itself: a factor of
/// all of Lambda where `moves` says so, one of the disturbance estimate where `gain` does, at most
/// `allowed` evaluations. With the last failure, where there was one.
pub(super) fn refine(
    found: &Cheapest,
    (moves, gain): (bool, bool),
    allowed: usize,
    mut cost: impl FnMut(&Weights) -> Result<f64>,
) -> (Cheapest, Option<Error>) {
    let mut failure = None;
    let mut evaluations = found.evaluations;
    let mut of = |weights: &Weights| {
        evaluations += 1;
        cost(weights).unwrap_or_else(|error| {
            failure = Some(error);
            f64::INFINITY
        })
    };
    let scaled = |weights: &Weights, factor: f64| Weights {
        move_suppression: (weights.move_suppression.iter())
            .map(|lambda| lambda * factor)
            .collect(),
        ..weights.clone()
    };
    let begun = of(&found.weights);
    let allowed = allowed.saturating_sub(1);
    let most = if moves {
        (OF_MOVES * allowed as f64) as usize
    } else {
        0
    };
    let of_gain = allowed - most;
    let (factor, reached) = descend(begun, most, |factor| of(&scaled(&found.weights, factor)));
    let weights = scaled(&found.weights, factor);
    let gained = |factor: f64| Weights {
        disturbance_gain: (weights.disturbance_gain * factor).min(1.0),
        ..weights.clone()
    };
    let most = if gain && weights.disturbance_gain > 0.0 {
        of_gain
    } else {
        0
    };
    let (factor, reached) = descend(reached, most, |factor| of(&gained(factor)));
    let refined = Cheapest {
        weights: gained(factor),
        cost: reached,
        evaluations,
    };
    (refined, failure)
}

/// The best factor and its cost, begun at 1 with its cost: steps up or down as long as they help,
/// then shorter ones, `most` evaluations in all.
fn descend(begun: f64, most: usize, mut cost: impl FnMut(f64) -> f64) -> (f64, f64) {
    let (mut best, mut reached, mut left) = (1.0, begun, most);
    let mut step = STEPS[0];
    while left > 0 && step >= STEPS[1] {
        let mut moved = false;
        for direction in [step, 1.0 / step] {
            while left > 0 {
                left -= 1;
                let tried = best * direction;
                let found = cost(tried);
                if found.is_nan() || found >= reached {
                    break;
                }
                (best, reached, moved) = (tried, found, true);
            }
            if moved {
                break;
            }
        }
        step = step.sqrt();
    }
    (best, reached)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec() -> ModelSpec {
        let folder =
            std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/reference-s");
        sinew_model::store::load(&folder).expect("the model is committed")
    }

    fn weights() -> Weights {
        Weights {
            tracking_weight: vec![1.0],
            move_suppression: vec![0.01, 0.02],
            disturbance_gain: 0.1,
            iterations: 2,
        }
    }

    #[test]
    fn the_model_that_stands_in_looks_as_far() {
        let mut spec = spec();
        assert!(stand_in(&spec).is_none(), "it has no cost-to-go");
        spec.control.horizon = 2;
        spec.control.control_horizon = 2;
        spec.control.move_blocks = vec![2];
        spec.control.value = Some(sinew_model::spec::ValueSpec {
            rows: 2,
            ahead: 6,
            points: vec![vec![0.0; spec.outputs.len()]],
        });
        let other = stand_in(&spec).expect("the specification has a cost-to-go");
        other.validate().expect("a firmware carries it");
        assert_eq!((other.control.horizon, other.control.preview()), (8, 8));
        assert_eq!(other.control.control_horizon, 3);
        assert!(other.control.move_blocks.is_empty() && other.control.value.is_none());
        spec.control.control_horizon = 2;
        spec.control
            .value
            .as_mut()
            .expect("the specification has a cost-to-go")
            .ahead = 0;
        let near = stand_in(&spec).expect("the specification has a cost-to-go");
        assert_eq!(near.control.move_blocks, [2], "blocks stay where steps do");
    }

    #[test]
    fn refined_weights_are_those_of_the_model_itself() {
        let found = Cheapest {
            weights: weights(),
            cost: 7.0,
            evaluations: 20,
        };
        let mut calls = 0;
        let bowl = |weights: &Weights| {
            calls += 1;
            let lambda = (weights.move_suppression[0] / 0.3).ln();
            let gain = (weights.disturbance_gain / 0.05).ln();
            Ok(1.0 + lambda * lambda + gain * gain)
        };
        let (refined, failure) = refine(&found, (true, true), 15, bowl);
        assert!(failure.is_none());
        assert!(refined.cost < 1.2, "{refined:?}");
        let ratio = refined.weights.move_suppression[1] / refined.weights.move_suppression[0];
        assert!((ratio - 2.0).abs() < 1e-12, "one factor of all");
        assert_eq!(refined.evaluations, 20 + calls);
        assert!(calls <= 15, "{calls}");
        let (kept, _) = refine(&found, (false, true), 15, |_| Ok(1.0));
        assert_eq!(
            kept.weights,
            weights(),
            "nothing is better, Lambda is the rig's"
        );
        let (lost, failure) = refine(&found, (true, true), 15, |_| Err(Error::failed("no plant")));
        assert!(lost.cost.is_infinite() && failure.is_some());
    }
}
