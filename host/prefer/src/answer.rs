//! Answers of a person, and their probability.

/// Difference of utility below which a person says "alike" about half of the time
/// (docs/explanation/preferences.md, eq. 2).
const THRESHOLD: f64 = 0.2;

/// Probability of an answer that has nothing to do with what the person wants.
const SLIP: f64 = 0.05;

/// One of the three answers to "which of these two is better?".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// The first one is better.
    First,
    /// The second one is better.
    Second,
    /// Neither is.
    Alike,
}

impl Choice {
    /// All of them.
    pub(crate) const ALL: [Self; 3] = [Self::First, Self::Second, Self::Alike];
}

/// An answer: two candidates by index, and the choice between them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Index of the first candidate.
    pub first: usize,
    /// Index of the second one.
    pub second: usize,
    /// The choice.
    pub choice: Choice,
}

impl Answer {
    /// Probability of the answer, given the utilities of all candidates.
    pub(crate) fn probability(&self, utilities: &[f64]) -> f64 {
        probability(self.choice, utilities[self.first] - utilities[self.second])
    }
}

/// Probability of a choice, given by how much the first candidate is better: Rao and Kupper's
/// model with ties, and a slip (docs/explanation/preferences.md, eq. 2).
pub(crate) fn probability(choice: Choice, difference: f64) -> f64 {
    let logistic = |x: f64| 1.0 / (1.0 + (-x).exp());
    let first = logistic(difference - THRESHOLD);
    let second = logistic(-difference - THRESHOLD);
    let meant = match choice {
        Choice::First => first,
        Choice::Second => second,
        Choice::Alike => 1.0 - first - second,
    };
    (1.0 - SLIP) * meant + SLIP / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_of_the_three_answers_sum_to_one() {
        for difference in [-30.0, -1.0, 0.0, 0.3, 700.0] {
            let sum: f64 = Choice::ALL.map(|c| probability(c, difference)).iter().sum();
            assert!((sum - 1.0).abs() < 1e-12, "{difference}: {sum}");
        }
    }

    #[test]
    fn no_answer_is_impossible() {
        assert!(probability(Choice::Second, 1e6) > 0.01);
        assert!(probability(Choice::First, 3.0) > 0.9);
    }
}
