//! The predictive controller's weights as a search sees them: first tied together, then each of its own.

use sinew_codegen::spec::ControlSpec;

use crate::compare::mpc::Weights;
use crate::compare::optimise::{Budget, Found, Range, search};

const GAIN: Range = Range::logarithmic(1e-3, 1.0);
const MOVE_SUPPRESSION: Range = Range::logarithmic(1e-8, 1e2);
const TRACKING_WEIGHT: Range = Range::logarithmic(1e-3, 1e3);

/// Where a search begins beside the model's own weights: gain of the disturbance estimate and move suppression.
const STARTS: [(f64, f64); 2] = [(0.1, 1e-2), (0.3, 1e-5)];

/// Part of the evaluations that the tied search takes.
const TIED: f64 = 1.0 / 3.0;

/// What is searched: the gain of the disturbance estimate, Lambda, and Q but for the first output's, which is 1: only ratios
/// count.
pub struct Searched {
    gain: f64,
    move_suppression: Vec<f64>,
    tracking_weight: Vec<f64>,
    iterations: u8,
    /// The gain that is not searched.
    kept: Option<f64>,
    /// All of Lambda moves by one factor, and Q stays, to the end.
    tied: bool,
}

impl Searched {
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
            tied,
        }
    }

    /// The weights at a place of the search.
    pub fn weights(&self, at: &[f64]) -> Weights {
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

    /// The cheapest weights within a budget of evaluations. Where there are several inputs or outputs, a third of it goes to
    /// the gain and to a factor of all of Lambda: a simplex in as many dimensions as there are weights takes more
    /// evaluations to shape itself than anybody grants it, and ends with inputs that are damped differently for no reason.
    pub fn search(&self, evaluations: usize, cost: impl Fn(&Weights) -> f64 + Sync) -> Found {
        let (inputs, outputs) = (self.move_suppression.len(), self.tracking_weight.len());
        let mut ranges = vec![GAIN];
        ranges.extend(vec![MOVE_SUPPRESSION; inputs]);
        ranges.extend(vec![TRACKING_WEIGHT; outputs.saturating_sub(1)]);
        let own = self.place(self.gain, self.move_suppression.clone());
        let others = STARTS.map(|(gain, lambda)| self.place(gain, vec![lambda; inputs]));
        let of_place = |at: &[f64]| cost(&self.weights(at));
        if ranges.len() == 2 {
            let starts: Vec<Vec<f64>> = std::iter::once(own).chain(others).collect();
            return search(&ranges, &starts, Budget::Evaluations(evaluations), of_place);
        }
        let mean = self.mean();
        let starts: Vec<Vec<f64>> = std::iter::once((self.gain, mean))
            .chain(STARTS)
            .map(|(gain, lambda)| vec![gain, lambda])
            .collect();
        let share = match self.tied {
            true => evaluations,
            false => (TIED * evaluations as f64) as usize,
        };
        let tied = search(
            &[GAIN, MOVE_SUPPRESSION],
            &starts,
            Budget::Evaluations(share),
            |at| of_place(&self.untied(at)),
        );
        if self.tied {
            return Found {
                start: self.untied(&tied.start),
                best: self.untied(&tied.best),
                ..tied
            };
        }
        let rest = evaluations.saturating_sub(tied.evaluations);
        let starts = [self.untied(&tied.best), own];
        let found = search(&ranges, &starts, Budget::Evaluations(rest), of_place);
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

    /// The place of a gain and of a mean move suppression, each input's in proportion to the model's own.
    fn untied(&self, at: &[f64]) -> Vec<f64> {
        let factor = at[1] / self.mean();
        let own = self.move_suppression.iter();
        let own = own.map(|l| factor * l.max(MOVE_SUPPRESSION.low)).collect();
        self.place(at[0], own)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn about(inputs: usize, outputs: usize) -> Searched {
        Searched {
            gain: 0.2,
            move_suppression: vec![0.5; inputs],
            tracking_weight: vec![1.0; outputs],
            iterations: 2,
            kept: None,
            tied: false,
        }
    }

    /// Six inputs that want the same and three outputs: on 120 evaluations a search of all nine at once ends at
    /// 2.6.
    #[test]
    fn many_weights_that_want_the_same_are_found_together() {
        let cost = |w: &Weights| -> f64 {
            let lambda = w.move_suppression.iter();
            let off: f64 = lambda.map(|l| (l / 3e-4).ln().powi(2)).sum();
            let q = w.tracking_weight.iter().map(|q| q.ln().powi(2));
            1.0 + off + q.sum::<f64>() + (w.disturbance_gain / 0.05).ln().powi(2)
        };
        let searched = about(6, 3);
        let found = searched.search(120, cost);
        assert!(found.cost < 1.05, "{}", found.cost);
        assert!(found.evaluations <= 120);
        assert_eq!(cost(&searched.weights(&found.best)), found.cost);
    }

    /// What each would like of its own, on plants that it will not meet again, is not asked.
    #[test]
    fn tied_weights_stay_alike() {
        let searched = Searched {
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
        let found = searched.search(60, cost);
        let weights = searched.weights(&found.best);
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
        let searched = Searched {
            kept: Some(0.0),
            iterations: 1,
            ..about(1, 1)
        };
        let weights = searched.weights(&[0.3, 0.01]);
        assert_eq!((weights.disturbance_gain, weights.iterations), (0.0, 1));
        assert_eq!(weights.tracking_weight, [1.0]);
    }
}
