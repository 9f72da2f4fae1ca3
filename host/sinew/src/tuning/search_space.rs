//! Search space of the MPC weights. Weights are first scaled by one common factor, then searched
//! individually.

use std::sync::atomic::{AtomicUsize, Ordering};

use sinew_model::spec::ControlSpec;

use crate::closed_loop::mpc::Weights;
use crate::tuning::optimise::{self, Found, Range, minimise, search};

const GAIN: Range = Range::logarithmic(1e-3, 1.0);
const MOVE_SUPPRESSION: Range = Range::logarithmic(1e-8, 1e2);
const TRACKING_WEIGHT: Range = Range::logarithmic(1e-3, 1e3);

/// Starts of a search beside the model's own weights: gain of the disturbance estimate and move
/// suppression.
const STARTS: [(f64, f64); 2] = [(0.1, 1e-2), (0.3, 1e-5)];

/// The same of a search by derivatives, which does not leave the valley that it starts in: a loop
/// that swings from limit to limit has no slope that leads out of it.
const SPREAD_STARTS: [(f64, f64); 4] = [(0.3, 1e-5), (0.1, 1e-2), (0.05, 1.0), (0.03, 30.0)];

/// First start of a network without tuned weights: gain of the disturbance estimate and move
/// suppression.
const FIRST: (f64, f64) = (0.02, 1e-3);

/// Part of the evaluations that the tied search takes.
const TIED: f64 = 1.0 / 3.0;

/// Budget of a search of the weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Budget {
    /// Iterations of the simplex from each start, over one common move suppression and the
    /// disturbance gain.
    Iterations(u64),
    /// Evaluations in all, over every weight.
    Evaluations(usize),
    /// The same by a population with a seed.
    Population(usize, u64),
}

/// Result of a search of the weights.
#[derive(Clone, Debug)]
pub struct Cheapest {
    /// The cheapest weights found.
    pub weights: Weights,
    /// Their cost.
    pub cost: f64,
    /// Evaluations that were made.
    pub evaluations: usize,
}

/// Search space: the gain of the disturbance estimate, Lambda, and Q but for the first output's,
/// which is 1: only ratios count.
pub struct SearchSpace {
    gain: f64,
    move_suppression: Vec<f64>,
    tracking_weight: Vec<f64>,
    iterations: u8,
    /// The gain that is not space.
    kept: Option<f64>,
    /// Lambda stays as it is.
    suppression_fixed: bool,
    /// All of Lambda moves by one factor, and Q stays, to the end.
    tied: bool,
}

impl SearchSpace {
    /// About the weights of a model. `kept` holds the gain of the disturbance estimate where it is.
    /// `tied` searches nothing but that gain and one factor of all of Lambda.
    pub fn about(
        control: &ControlSpec,
        kept: Option<f64>,
        iterations: Option<u8>,
        tied: bool,
    ) -> Self {
        let first = control.tracking_weight.first().copied();
        let first = first.filter(|q| *q > 0.0).unwrap_or(1.0);
        let scaled = |values: &[f64]| values.iter().map(|v| v / first).collect::<Vec<f64>>();
        Self {
            gain: control.disturbance_gain,
            move_suppression: scaled(&control.move_suppression),
            tracking_weight: scaled(&control.tracking_weight),
            iterations: iterations.unwrap_or(control.iterations),
            kept,
            suppression_fixed: false,
            tied,
        }
    }

    /// About a network without tuned weights: Q and, where the rig fixes it, Lambda are the rig's.
    pub fn untuned(
        tracking_weight: &[f64],
        move_suppression: Option<&[f64]>,
        inputs: usize,
        iterations: u8,
    ) -> Self {
        Self {
            gain: FIRST.0,
            move_suppression: move_suppression
                .map_or_else(|| vec![FIRST.1; inputs], <[f64]>::to_vec),
            tracking_weight: tracking_weight.to_vec(),
            iterations,
            kept: None,
            suppression_fixed: move_suppression.is_some(),
            tied: true,
        }
    }

    /// True for each that is searched: Lambda, and the gain of the disturbance estimate.
    pub fn searched(&self) -> (bool, bool) {
        (!self.suppression_fixed, self.kept.is_none())
    }

    /// The same space on logarithmic scales, for a search by derivatives.
    pub fn logarithmic(&self) -> LogarithmicSpace {
        let (inputs, outputs) = (self.move_suppression.len(), self.tracking_weight.len());
        let mut space = LogarithmicSpace {
            ranges: Vec::new(),
            weights: Vec::new(),
            inputs,
            iterations: self.iterations,
            starts: vec![Vec::new(); 1 + SPREAD_STARTS.len()],
        };
        let others = SPREAD_STARTS.map(|(gain, _)| gain);
        match self.kept {
            Some(gain) => space.weights.push((gain, None)),
            None => {
                space.add(GAIN, self.gain, &others);
                space.weights.push((1.0, Some(0)));
            }
        }
        let others = SPREAD_STARTS.map(|(_, lambda)| lambda);
        let mean = self.mean();
        let own = |lambda: &f64| lambda.max(MOVE_SUPPRESSION.low);
        if self.suppression_fixed {
            let fixed = self.move_suppression.iter().map(|lambda| (*lambda, None));
            space.weights.extend(fixed);
        } else if self.tied {
            let unknown = space.add(MOVE_SUPPRESSION, mean, &others);
            let shares = self
                .move_suppression
                .iter()
                .map(|lambda| own(lambda) / mean);
            (space.weights).extend(shares.map(|share| (share, Some(unknown))));
        } else {
            for lambda in self.move_suppression.iter().map(own) {
                let others = others.map(|other| other * lambda / mean);
                let unknown = space.add(MOVE_SUPPRESSION, lambda, &others);
                space.weights.push((1.0, Some(unknown)));
            }
        }
        space.weights.push((1.0, None));
        for output in 1..outputs {
            let q = self.tracking_weight[output];
            if self.tied {
                space.weights.push((q, None));
            } else {
                let unknown = space.add(TRACKING_WEIGHT, q, &[q; SPREAD_STARTS.len()]);
                space.weights.push((1.0, Some(unknown)));
            }
        }
        space
    }

    /// The cheapest weights within a budget and their cost; infinite where no weights have one.
    pub fn cheapest(&self, budget: Budget, cost: impl Fn(&Weights) -> f64 + Sync) -> Cheapest {
        match budget {
            Budget::Evaluations(evaluations) | Budget::Population(evaluations, _) => {
                let seed = match budget {
                    Budget::Population(_, seed) => Some(seed),
                    _ => None,
                };
                let found = self.search(evaluations, seed, cost);
                Cheapest {
                    weights: self.weights(&found.best),
                    cost: found.cost,
                    evaluations: found.evaluations,
                }
            }
            Budget::Iterations(iterations) => {
                let evaluations = AtomicUsize::new(0);
                let weights_at = |at: &[f64]| self.common(at[0], at[1]);
                let starts = std::iter::once((self.gain, FIRST.1)).chain(STARTS);
                let starts: Vec<Vec<f64>> =
                    starts.map(|(gain, lambda)| vec![lambda, gain]).collect();
                let (best, cost) = minimise(&[MOVE_SUPPRESSION, GAIN], &starts, iterations, |at| {
                    evaluations.fetch_add(1, Ordering::Relaxed);
                    cost(&weights_at(at))
                });
                Cheapest {
                    weights: weights_at(&best),
                    cost,
                    evaluations: evaluations.into_inner(),
                }
            }
        }
    }

    /// One move suppression for all inputs, unless it is fixed.
    fn common(&self, move_suppression: f64, gain: f64) -> Weights {
        Weights {
            tracking_weight: self.tracking_weight.clone(),
            move_suppression: if self.suppression_fixed {
                self.move_suppression.clone()
            } else {
                vec![move_suppression; self.move_suppression.len()]
            },
            disturbance_gain: gain,
            iterations: self.iterations,
        }
    }

    /// The weights at a place of the search.
    fn weights(&self, at: &[f64]) -> Weights {
        let inputs = self.move_suppression.len();
        Weights {
            tracking_weight: std::iter::once(1.0)
                .chain(at[1 + inputs..].iter().copied())
                .collect(),
            move_suppression: at[1..=inputs].to_vec(),
            disturbance_gain: self.kept.unwrap_or(at[0]),
            iterations: self.iterations,
        }
    }

    /// The cheapest weights within a budget of evaluations. Where there are several inputs or
    /// outputs, a third of it goes to the gain and to a factor of all of Lambda: a simplex in as
    /// many dimensions as there are weights takes more evaluations to shape itself than anybody
    /// grants it, and ends with inputs that are damped differently for no reason.
    fn search(
        &self,
        evaluations: usize,
        seed: Option<u64>,
        cost: impl Fn(&Weights) -> f64 + Sync,
    ) -> Found {
        let within = |evaluations| match seed {
            None => optimise::Budget::Evaluations(evaluations),
            Some(seed) => optimise::Budget::Population(evaluations, seed),
        };
        let (inputs, outputs) = (self.move_suppression.len(), self.tracking_weight.len());
        let mut ranges = vec![GAIN];
        ranges.extend(vec![MOVE_SUPPRESSION; inputs]);
        ranges.extend(vec![TRACKING_WEIGHT; outputs.saturating_sub(1)]);
        let own = self.place(self.gain, self.move_suppression.clone());
        let others = STARTS.map(|(gain, lambda)| self.place(gain, vec![lambda; inputs]));
        let of_place = |at: &[f64]| cost(&self.weights(at));
        if ranges.len() == 2 {
            let starts: Vec<Vec<f64>> = std::iter::once(own).chain(others).collect();
            return search(&ranges, &starts, within(evaluations), of_place);
        }
        let mean = self.mean();
        let starts: Vec<Vec<f64>> = std::iter::once((self.gain, mean))
            .chain(STARTS)
            .map(|(gain, lambda)| vec![gain, lambda])
            .collect();
        let share = if self.tied {
            evaluations
        } else {
            (TIED * evaluations as f64) as usize
        };
        let tied = search(&[GAIN, MOVE_SUPPRESSION], &starts, within(share), |at| {
            of_place(&self.untied(at))
        });
        if self.tied {
            return Found {
                start: self.untied(&tied.start),
                best: self.untied(&tied.best),
                ..tied
            };
        }
        let rest = evaluations.saturating_sub(tied.evaluations);
        let starts = [self.untied(&tied.best), own];
        let found = search(&ranges, &starts, within(rest), of_place);
        Found {
            evaluations: tied.evaluations + found.evaluations,
            ..found
        }
    }

    fn place(&self, gain: f64, move_suppression: Vec<f64>) -> Vec<f64> {
        let mut place = vec![gain];
        place.extend(move_suppression);
        place.extend(self.tracking_weight.iter().skip(1));
        place
    }

    /// Geometric mean of the model's move suppression.
    fn mean(&self) -> f64 {
        let logs = self.move_suppression.iter();
        let logs = logs.map(|l| l.max(MOVE_SUPPRESSION.low).ln());
        (logs.sum::<f64>() / self.move_suppression.len().max(1) as f64).exp()
    }

    /// The place of a gain and of a mean move suppression, each input's in proportion to the
    /// model's own.
    fn untied(&self, at: &[f64]) -> Vec<f64> {
        let factor = at[1] / self.mean();
        let own = self.move_suppression.iter();
        let own = own.map(|l| factor * l.max(MOVE_SUPPRESSION.low)).collect();
        self.place(at[0], own)
    }
}

/// Search space on logarithmic scales: every weight is a constant, or a constant times the
/// exponential of one unknown.
pub struct LogarithmicSpace {
    /// Least and largest value of each unknown, logarithms.
    pub ranges: Vec<[f64; 2]>,
    /// The model's own place, and others; nearest ends where they lie outside.
    pub starts: Vec<Vec<f64>>,
    /// Constant and unknown of the gain, of each of Lambda, of each of Q.
    weights: Vec<(f64, Option<usize>)>,
    inputs: usize,
    iterations: u8,
}

impl LogarithmicSpace {
    /// Adds an unknown with its starts and returns its index.
    fn add(&mut self, range: Range, own: f64, others: &[f64]) -> usize {
        let values = std::iter::once(&own).chain(others);
        for (start, value) in self.starts.iter_mut().zip(values) {
            start.push(value.clamp(range.low, range.high).ln());
        }
        self.ranges.push([range.low.ln(), range.high.ln()]);
        self.ranges.len() - 1
    }

    /// The weights at a place.
    pub fn weights(&self, place: &[f64]) -> Weights {
        let all: Vec<f64> = (self.weights.iter())
            .map(|(constant, unknown)| constant * unknown.map_or(1.0, |i| place[i].exp()))
            .collect();
        Weights {
            disturbance_gain: all[0],
            move_suppression: all[1..=self.inputs].to_vec(),
            tracking_weight: all[1 + self.inputs..].to_vec(),
            iterations: self.iterations,
        }
    }

    /// Unknown of each weight, in the order gain, Lambda, Q; a weight's derivative by the logarithm
    /// of its unknown is the weight.
    pub fn unknowns(&self) -> impl Iterator<Item = Option<usize>> {
        self.weights.iter().map(|(_, unknown)| *unknown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn about(inputs: usize, outputs: usize) -> SearchSpace {
        SearchSpace {
            gain: 0.2,
            move_suppression: vec![0.5; inputs],
            tracking_weight: vec![1.0; outputs],
            iterations: 2,
            kept: None,
            suppression_fixed: false,
            tied: false,
        }
    }

    /// Six inputs that want the same and three outputs: on 120 evaluations a search of all nine at
    /// once ends at 2.6.
    #[test]
    fn many_weights_that_want_the_same_are_found_together() {
        let cost = |w: &Weights| -> f64 {
            let lambda = w.move_suppression.iter();
            let off: f64 = lambda.map(|l| (l / 3e-4).ln().powi(2)).sum();
            let q = w.tracking_weight.iter().map(|q| q.ln().powi(2));
            1.0 + off + q.sum::<f64>() + (w.disturbance_gain / 0.05).ln().powi(2)
        };
        let space = about(6, 3);
        let found = space.search(120, None, cost);
        assert!(found.cost < 1.05, "{}", found.cost);
        assert!(found.evaluations <= 120);
        assert_eq!(cost(&space.weights(&found.best)), found.cost);
    }

    /// One search for all: the optimum of each on plants that it will not meet again is not asked.
    #[test]
    fn tied_weights_stay_alike() {
        let space = SearchSpace {
            tied: true,
            ..about(6, 3)
        };
        let cost = |w: &Weights| -> f64 {
            let liked = (0..).zip(&w.move_suppression);
            let off: f64 = liked
                .map(|(i, l)| (l / 3e-4).ln().powi(2) + 0.1 * (l.ln() - f64::from(i)).powi(2))
                .sum();
            off + w.tracking_weight[1] + (w.disturbance_gain / 0.05).ln().powi(2)
        };
        let found = space.search(60, None, cost);
        let weights = space.weights(&found.best);
        let first = weights.move_suppression[0];
        assert!(
            weights
                .move_suppression
                .iter()
                .all(|l| (l / first - 1.0).abs() < 1e-12)
        );
        assert!(first < 0.1, "{first}: where it began");
        assert_eq!(weights.tracking_weight, [1.0; 3]);
        assert!(found.evaluations <= 60);
        assert_eq!(cost(&weights), found.cost);
    }

    #[test]
    fn a_gain_that_is_kept_and_iterations_reach_the_weights() {
        let space = SearchSpace {
            kept: Some(0.0),
            iterations: 1,
            ..about(1, 1)
        };
        let weights = space.weights(&[0.3, 0.01]);
        assert_eq!((weights.disturbance_gain, weights.iterations), (0.0, 1));
        assert_eq!(weights.tracking_weight, [1.0]);
    }
}
