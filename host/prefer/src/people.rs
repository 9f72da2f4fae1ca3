//! Several people, and answers that no feature explains.

use crate::answer::Answer;
use crate::belief::Belief;
use crate::candidates::Candidates;
use crate::error::Error;

/// Evidence that two people want different things.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence {
    /// Logarithm of the odds of two utilities against one for both, at even odds before.
    pub log_odds: f64,
}

impl Evidence {
    /// True if two utilities explain the answers better than one does.
    pub fn apart(&self) -> bool {
        self.log_odds > 0.0
    }
}

/// Evidence of two utilities for the answers of two people (docs/explanation/preferences.md,
/// eq. 4).
///
/// # Errors
/// An answer about a candidate that is not there, or about one and the same.
pub fn two_people(
    candidates: &Candidates,
    one: &[Answer],
    other: &[Answer],
    seed: u64,
) -> Result<Evidence, Error> {
    let alone = evidence(candidates, &[], other, seed)?;
    let after = evidence(candidates, one, other, seed)?;
    Ok(Evidence {
        log_odds: alone - after,
    })
}

/// Answers that were expected beforehand: of each, asked after those before it, the probability
/// that it was given.
///
/// # Errors
/// An answer about a candidate that is not there, or about one and the same.
pub fn predicted(
    candidates: &Candidates,
    answers: &[Answer],
    seed: u64,
) -> Result<Vec<f64>, Error> {
    let of = |k: usize| expected(candidates, &answers[..k], answers[k], seed);
    (0..answers.len()).map(of).collect()
}

/// Logarithm of the probability of answers after others that are known.
fn evidence(
    candidates: &Candidates,
    known: &[Answer],
    answers: &[Answer],
    seed: u64,
) -> Result<f64, Error> {
    let mut before = known.to_vec();
    let mut sum = 0.0;
    for answer in answers {
        sum += expected(candidates, &before, *answer, seed)?.ln();
        before.push(*answer);
    }
    Ok(sum)
}

fn expected(
    candidates: &Candidates,
    before: &[Answer],
    answer: Answer,
    seed: u64,
) -> Result<f64, Error> {
    candidates.holds(&[answer])?;
    let belief = Belief::after(candidates, before, seed)?;
    let all = belief.samples.iter().map(|u| answer.probability(u));
    Ok(all.sum::<f64>() / belief.samples.len() as f64)
}
