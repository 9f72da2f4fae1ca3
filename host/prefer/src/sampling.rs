//! Samples of the posterior of all utilities by elliptical slices (Murray, Adams, MacKay, 2010):
//! exact for a Gaussian prior and any likelihood, without a setting.

use std::f64::consts::TAU;

use nalgebra::DVector;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::answer::Answer;
use crate::candidates::Candidates;

/// Samples that are kept.
const KEPT: usize = 500;

/// Steps before the first one that is kept.
const BURNED: usize = 300;

/// Steps from one that is kept to the next.
const THINNED: usize = 4;

/// Narrowings of a slice after which a step stays where it is; a slice that holds the last sample
/// is found in a dozen.
const MOST: usize = 100;

/// Samples of the utilities, `[sample][candidate]`, given the answers.
pub(crate) fn samples(candidates: &Candidates, answers: &[Answer], seed: u64) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let prior = |random: &mut ChaCha8Rng| {
        let draws = (0..candidates.len()).map(|_| gaussian(random));
        candidates.factor() * DVector::from_iterator(candidates.len(), draws)
    };
    let mean = candidates.mean();
    let likelihood = |f: &DVector<f64>| -> f64 {
        let difference = |answer: &Answer| {
            let at = |i: usize| mean[i] + f[i];
            crate::answer::probability(answer.choice, at(answer.first) - at(answer.second))
        };
        answers.iter().map(|answer| difference(answer).ln()).sum()
    };
    let mut at = prior(&mut random);
    let mut level = likelihood(&at);
    let mut kept = Vec::with_capacity(KEPT);
    for step in 0..BURNED + KEPT * THINNED {
        let other = prior(&mut random);
        let least = level + random.random::<f64>().max(f64::MIN_POSITIVE).ln();
        let mut angle = TAU * random.random::<f64>();
        let (mut low, mut high) = (angle - TAU, angle);
        for _ in 0..MOST {
            let to = &at * angle.cos() + &other * angle.sin();
            let found = likelihood(&to);
            if found > least {
                (at, level) = (to, found);
                break;
            }
            if angle < 0.0 {
                low = angle;
            } else {
                high = angle;
            }
            angle = low + (high - low) * random.random::<f64>();
        }
        if step >= BURNED && (step - BURNED).is_multiple_of(THINNED) {
            kept.push((mean + &at).iter().copied().collect());
        }
    }
    kept
}

/// A draw of the standard normal distribution, by Box and Muller.
fn gaussian(random: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * (1.0 - random.random::<f64>()).ln()).sqrt();
    radius * (TAU * random.random::<f64>()).cos()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::Choice;

    /// Two candidates and one answer: the posterior of their difference by quadrature.
    #[test]
    fn samples_have_the_posterior_that_quadrature_has() {
        let candidates = Candidates::new(&[vec![1.0], vec![2.0]]).unwrap();
        let answer = Answer {
            first: 1,
            second: 0,
            choice: Choice::First,
        };
        let (l, m) = (candidates.factor(), candidates.mean());
        let row = l.row(1) - l.row(0);
        let (mean, sigma) = (m[1] - m[0], row.norm());
        let weights = (-4000..4000).map(|i| {
            let x = mean + sigma * f64::from(i) / 500.0;
            let density = (-((x - mean) / sigma).powi(2) / 2.0).exp();
            (x, density * crate::answer::probability(Choice::First, x))
        });
        let (sum, first) = weights.fold((0.0, 0.0), |(s, f), (x, w)| (s + w, f + w * x));
        let exact = first / sum;
        let mut all = Vec::new();
        for seed in 0..8 {
            all.extend(samples(&candidates, &[answer], seed));
        }
        let differences = all.iter().map(|u| u[1] - u[0]);
        let found = differences.sum::<f64>() / all.len() as f64;
        assert!(
            (found - exact).abs() < 0.1 * sigma,
            "{found}, exactly {exact}"
        );
    }

    #[test]
    fn one_seed_gives_the_same_samples() {
        let candidates = Candidates::new(&[vec![1.0], vec![2.0], vec![0.5]]).unwrap();
        assert_eq!(samples(&candidates, &[], 3), samples(&candidates, &[], 3));
        assert_ne!(samples(&candidates, &[], 3), samples(&candidates, &[], 4));
    }
}
