//! Belief about the utilities of all candidates after some answers.

use crate::answer::Answer;
use crate::candidates::Candidates;
use crate::error::Error;
use crate::sampling::samples;

/// The candidate of the largest expected utility.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Winner {
    /// Its index.
    pub index: usize,
    /// Probability that it is the person's best one.
    pub odds: f64,
    /// Expected loss of utility to the person's best one, as a share of the distance from the
    /// median candidate to the best one.
    pub regret: f64,
}

/// Utilities of all candidates, as samples of their posterior.
#[derive(Clone, Debug)]
pub struct Belief {
    /// `[sample][candidate]`.
    pub(crate) samples: Vec<Vec<f64>>,
}

impl Belief {
    /// The belief after some answers.
    ///
    /// # Errors
    /// An answer about a candidate that is not there, or about one and the same.
    pub fn after(candidates: &Candidates, answers: &[Answer], seed: u64) -> Result<Self, Error> {
        candidates.holds(answers)?;
        Ok(Self {
            samples: samples(candidates, answers, seed),
        })
    }

    /// Expected utility of each candidate.
    pub fn expected(&self) -> Vec<f64> {
        let count = self.samples.len() as f64;
        let mut sum = vec![0.0; self.samples[0].len()];
        for sample in &self.samples {
            for (sum, u) in sum.iter_mut().zip(sample) {
                *sum += u / count;
            }
        }
        sum
    }

    /// Probability of each candidate to be the best one.
    pub fn odds(&self) -> Vec<f64> {
        let mut odds = vec![0.0; self.samples[0].len()];
        for sample in &self.samples {
            odds[best(sample)] += 1.0 / self.samples.len() as f64;
        }
        odds
    }

    /// Expected distance of utility from the median candidate to the best one.
    pub(crate) fn distance(&self) -> f64 {
        let of = |sample: &Vec<f64>| sample[best(sample)] - median(sample);
        self.samples.iter().map(of).sum::<f64>() / self.samples.len() as f64
    }

    /// The candidate of the largest expected utility.
    pub fn winner(&self) -> Winner {
        let index = best(&self.expected());
        let share = |sample: &Vec<f64>| {
            let most = sample[best(sample)];
            let distance = most - median(sample);
            if distance > 0.0 {
                ((most - sample[index]) / distance).min(2.0)
            } else {
                0.0
            }
        };
        let regret: f64 = self.samples.iter().map(share).sum();
        Winner {
            index,
            odds: self.odds()[index],
            regret: regret / self.samples.len() as f64,
        }
    }
}

/// Index of the largest value.
pub(crate) fn best(values: &[f64]) -> usize {
    let order = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
    (0..values.len()).max_by(order).unwrap_or(0)
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}
