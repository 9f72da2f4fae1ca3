//! Choice of the next pair.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::answer::{Answer, Choice, probability};
use crate::belief::{Belief, best};

/// Candidates of the best expected utility, and as many of the best odds, that a pair is made of.
const LIKELY: usize = 8;

/// Share of the distance from the median candidate to the best one that an answer must be expected
/// to gain; below it, further answers change nothing.
const WORTH_ASKING: f64 = 0.002;

/// A pair to ask about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Question {
    /// Index of the first candidate.
    pub first: usize,
    /// Index of the second one.
    pub second: usize,
    /// Expected gain of utility by the answer, as a share of the distance from the median candidate
    /// to the best one (docs/explanation/preferences.md, eq. 3).
    pub gain: f64,
}

impl Question {
    /// True if the answer is expected to change which candidate wins.
    pub fn is_worth_asking(&self) -> bool {
        self.gain >= WORTH_ASKING
    }
}

/// The question whose answer is expected to gain most, of pairs that were not asked before; `None`
/// where all likely ones were.
pub fn next(belief: &Belief, asked: &[Answer]) -> Option<Question> {
    let likely = likely(belief);
    let expected = belief.expected();
    let now = expected[best(&expected)];
    let distance = belief.distance();
    let mut found: Option<Question> = None;
    for (k, &second) in likely.iter().enumerate() {
        for &first in &likely[..k] {
            if !is_new(asked, first, second) {
                continue;
            }
            let rise = after(belief, first, second) - now;
            let gain = if distance > 0.0 { rise / distance } else { 0.0 };
            if found.is_none_or(|best| gain > best.gain) {
                found = Some(Question {
                    first,
                    second,
                    gain,
                });
            }
        }
    }
    found
}

/// Any pair that was not asked before; a baseline for [`next`].
pub fn random(candidates: usize, asked: &[Answer], seed: u64) -> Option<(usize, usize)> {
    let pairs = (0..candidates).flat_map(|a| (0..a).map(move |b| (b, a)));
    let pairs: Vec<(usize, usize)> = pairs.filter(|(a, b)| is_new(asked, *a, *b)).collect();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (!pairs.is_empty()).then(|| pairs[random.random_range(0..pairs.len())])
}

fn is_new(asked: &[Answer], a: usize, b: usize) -> bool {
    let pair = |answer: &Answer| [answer.first, answer.second];
    !asked
        .iter()
        .any(|answer| pair(answer) == [a, b] || pair(answer) == [b, a])
}

/// Candidates that are likely the best: by expected utility and by odds.
fn likely(belief: &Belief) -> Vec<usize> {
    let first = |by: &[f64]| {
        let mut order: Vec<usize> = (0..by.len()).collect();
        order.sort_by(|a, b| by[*b].total_cmp(&by[*a]));
        order.truncate(LIKELY);
        order
    };
    let mut all = first(&belief.expected());
    for one in first(&belief.odds()) {
        if !all.contains(&one) {
            all.push(one);
        }
    }
    all
}

/// Expected utility of the winner after an answer about a pair.
fn after(belief: &Belief, first: usize, second: usize) -> f64 {
    let count = belief.samples.len() as f64;
    let of = |choice: Choice| {
        let mut sums = vec![0.0; belief.samples[0].len()];
        for sample in &belief.samples {
            let weight = probability(choice, sample[first] - sample[second]) / count;
            for (sum, u) in sums.iter_mut().zip(sample) {
                *sum += weight * u;
            }
        }
        // The probability of the answer times the winner's utility given it.
        sums[best(&sums)]
    };
    Choice::ALL.into_iter().map(of).sum()
}
