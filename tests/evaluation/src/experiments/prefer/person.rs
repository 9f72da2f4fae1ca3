//! Simulated people, most of whom want something that no weighted sum of features says.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sinew_prefer::{Answer, Choice};

/// Share of the distance from the median candidate to the best one below which two are alike.
const ALIKE: f64 = 0.02;

/// A person with a utility of each candidate, and a share of answers that slip.
pub struct Person {
    /// Utility of each candidate.
    utilities: Vec<f64>,
    slips: f64,
    random: ChaCha8Rng,
}

/// Kinds of utility.
pub const KINDS: [&str; 4] = ["weighted", "threshold", "lexicographic", "worst"];

impl Person {
    /// Draws a person of a kind, who judges features of which less is better.
    pub fn new(kind: usize, features: &[Vec<f64>], slips: f64, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let z = standardised(features);
        let count = z[0].len();
        let weights: Vec<f64> = (0..count)
            .map(|_| (-(1.0 - random.random::<f64>()).ln()).powi(2))
            .collect();
        let first = random.random_range(0..count);
        let second = (first + random.random_range(1..count)) % count;
        let sum = |row: &[f64]| -> f64 { row.iter().zip(&weights).map(|(z, w)| -w * z).sum() };
        let mut column: Vec<f64> = z.iter().map(|row| row[first]).collect();
        column.sort_by(f64::total_cmp);
        // Between a fifth and three fifths of the candidates stay below the threshold.
        let share = 0.2 + 0.4 * random.random::<f64>();
        let limit = column[(share * (column.len() - 1) as f64) as usize];
        let utilities = z.iter().map(|row| match kind {
            0 => sum(row),
            1 => -row[second] - if row[first] > limit { 6.0 } else { 0.0 },
            2 => -(row[first] / 0.7).floor() - 0.1 * row[second],
            _ => {
                let weighted = row.iter().zip(&weights).map(|(z, w)| w.sqrt() * z);
                -weighted.fold(f64::MIN, f64::max)
            }
        });
        let utilities = utilities.collect();
        Self {
            utilities,
            slips,
            random,
        }
    }

    /// Distance of the utility from the median candidate to the best one.
    fn distance(&self) -> f64 {
        let mut sorted = self.utilities.clone();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() - 1] - sorted[sorted.len() / 2]
    }

    /// The person's answer about two candidates.
    pub fn answer(&mut self, first: usize, second: usize) -> Answer {
        let difference = self.utilities[first] - self.utilities[second];
        let better = if difference.abs() < ALIKE * self.distance() {
            Choice::Alike
        } else if (difference > 0.0) != (self.random.random::<f64>() < self.slips) {
            Choice::First
        } else {
            Choice::Second
        };
        Answer {
            first,
            second,
            choice: better,
        }
    }

    /// Loss of utility by a candidate, as a share of the distance from the median one to the best.
    pub fn regret(&self, candidate: usize) -> f64 {
        let most = self.utilities.iter().copied().fold(f64::MIN, f64::max);
        (most - self.utilities[candidate]) / self.distance().max(1e-12)
    }
}

/// Each feature with mean 0 and spread 1.
fn standardised(features: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let (count, width) = (features.len(), features[0].len());
    let mut all = vec![vec![0.0; width]; count];
    for feature in 0..width {
        let mean = features.iter().map(|row| row[feature]).sum::<f64>() / count as f64;
        let squares: f64 = features
            .iter()
            .map(|row| (row[feature] - mean).powi(2))
            .sum();
        let spread = (squares / count as f64).sqrt().max(1e-12);
        for (row, of) in all.iter_mut().zip(features) {
            row[feature] = (of[feature] - mean) / spread;
        }
    }
    all
}
