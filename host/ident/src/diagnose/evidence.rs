//! Evidence for one candidate against another, and its certainty (docs/explanation/diagnosis.md,
//! eq. 6 to 8).

use crate::diagnose::candidate::Candidate;
use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::residuals::Residuals;
use crate::order;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Sums of squares of one explanation, block by block, for both roles.
struct Book {
    fit: Vec<Vec<[f64; 2]>>,
    check: Vec<Vec<[f64; 2]>>,
    parameters: f64,
}

/// Everything that is needed to compare explanations of the same recordings.
pub(crate) struct Comparison {
    books: Vec<Book>,
    /// Variance of each sensor that arithmetic alone explains.
    floor: Vec<f64>,
    /// Independent samples a sample.
    share: f64,
    seed: u64,
}

impl Comparison {
    /// `spread` has one entry a sensor; memory is taken from the best explanation.
    pub fn new(candidates: &[Candidate], spread: &[f64], seed: u64) -> Self {
        let floor: Vec<f64> = spread
            .iter()
            .map(|s| (CONFIG.evidence.round_off * s).powi(2))
            .collect();
        let least = candidates.iter().min_by(|a, b| {
            let of = |c: &Candidate| -> f64 {
                (0..floor.len())
                    .map(|s| (c.check.rms(s).powi(2) + floor[s]).ln())
                    .sum()
            };
            of(a).total_cmp(&of(b))
        });
        let memory = least.map_or(1.0, |best| {
            best.check
                .correlation_time()
                .max(best.fit.correlation_time())
        });
        let samples = |residuals: &Residuals| -> usize {
            residuals
                .series
                .first()
                .map_or(0, |series| series.iter().map(Vec::len).sum::<usize>())
        };
        let books = candidates
            .iter()
            .map(|candidate| Book {
                fit: candidate
                    .fit
                    .blocks(block_length(samples(&candidate.fit), memory)),
                check: candidate
                    .check
                    .blocks(block_length(samples(&candidate.check), memory)),
                parameters: candidate.parameters() as f64,
            })
            .collect();
        Self {
            books,
            floor,
            share: 1.0 / memory,
            seed,
        }
    }

    /// Log evidence of each explanation (eq. 6): likelihood on both roles with one noise, a fine
    /// for parameters. A noise of its own for each role would reward whoever follows what it was
    /// fitted to.
    pub fn evidence(&self) -> Vec<f64> {
        (0..self.books.len())
            .map(|index| self.evidence_of(index, None))
            .collect()
    }

    /// Gain of each explanation over `reference` on the check recordings: log ratio of root mean
    /// squares summed over sensors, its mean and its first percentile under resampling (eq. 7).
    pub fn gain(&self, index: usize, reference: usize) -> Gain {
        let mut gains: Vec<f64> = self
            .resamplings()
            .map(|weights| {
                self.deviance(&self.books[reference].check, &weights.check)
                    - self.deviance(&self.books[index].check, &weights.check)
            })
            .collect();
        order::sort(&mut gains);
        Gain {
            low: gains.get(gains.len() / 100).copied().unwrap_or(0.0),
        }
    }

    /// Probability of each candidate: mean over resamplings of their shares of the evidence (eq.
    /// 8).
    pub fn probabilities(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.books.len()];
        let mut count = 0.0;
        for weights in self.resamplings() {
            let evidence: Vec<f64> = (0..self.books.len())
                .map(|index| self.evidence_of(index, Some(&weights)))
                .collect();
            let best = evidence.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let shares: Vec<f64> = evidence.iter().map(|e| (e - best).exp()).collect();
            let total: f64 = shares.iter().sum();
            for (sum, share) in sums.iter_mut().zip(shares) {
                *sum += share / total;
            }
            count += 1.0;
        }
        sums.iter().map(|sum| sum / count).collect()
    }

    fn evidence_of(&self, index: usize, weights: Option<&Weights>) -> f64 {
        let book = &self.books[index];
        let samples: f64 = [&book.fit, &book.check]
            .into_iter()
            .flatten()
            .flatten()
            .map(|block| block[1])
            .sum();
        let fine = 0.5 * book.parameters * (samples * self.share).max(2.0).ln();
        let sensors = book.fit.iter().zip(&book.check).zip(&self.floor);
        let deviance: f64 = sensors
            .map(|((fit, check), floor)| {
                let fit = sums(fit, weights.map(|w| &w.fit[..]));
                let check = sums(check, weights.map(|w| &w.check[..]));
                let (squares, count) = (fit[0] + check[0], fit[1] + check[1]);
                0.5 * count * self.share * log_mean(squares, count, *floor)
            })
            .sum();
        -deviance - fine
    }

    /// Half the log variance of the residuals of one role, summed over sensors.
    fn deviance(&self, blocks: &[Vec<[f64; 2]>], weights: &[f64]) -> f64 {
        let sensors = blocks.iter().zip(&self.floor);
        sensors
            .map(|(blocks, floor)| {
                let [squares, count] = sums(blocks, Some(weights));
                0.5 * log_mean(squares, count, *floor)
            })
            .sum()
    }

    fn resamplings(&self) -> impl Iterator<Item = Weights> + '_ {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let blocks = |role: &Vec<Vec<[f64; 2]>>| role.iter().map(Vec::len).max().unwrap_or(0);
        let counts = self
            .books
            .first()
            .map_or((0, 0), |book| (blocks(&book.fit), blocks(&book.check)));
        (0..CONFIG.evidence.resamplings).map(move |_| Weights {
            fit: draw(&mut random, counts.0),
            check: draw(&mut random, counts.1),
        })
    }
}

/// Squares and counts of weighted blocks.
fn sums(blocks: &[[f64; 2]], weights: Option<&[f64]>) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for (index, block) in blocks.iter().enumerate() {
        let weight = weights.map_or(1.0, |weights| weights[index]);
        sums[0] += weight * block[0];
        sums[1] += weight * block[1];
    }
    sums
}

/// Logarithm of a mean square; nothing where nothing was counted.
fn log_mean(squares: f64, count: f64, floor: f64) -> f64 {
    if count == 0.0 {
        return 0.0;
    }
    (squares / count + floor).max(f64::MIN_POSITIVE).ln()
}

/// Number of times that each block was drawn.
struct Weights {
    fit: Vec<f64>,
    check: Vec<f64>,
}

/// Gain of a candidate on the check recordings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gain {
    /// First percentile, under resampling, of the log ratio of root mean squares.
    pub low: f64,
}

fn draw(random: &mut ChaCha8Rng, count: usize) -> Vec<f64> {
    let mut weights = vec![0.0; count];
    for _ in 0..count {
        weights[random.random_range(0..count)] += 1.0;
    }
    weights
}

/// Rows a block: five times the residuals' memory, but no fewer than 12 blocks and no more than
/// 100.
fn block_length(samples: usize, memory: f64) -> usize {
    ((5.0 * memory) as usize).clamp((samples / 100).max(1), (samples / 12).max(1))
}

/// Distance of two candidates' predictions of the check recordings, in units of the noise:
/// the largest of the sensors (eq. 10).
pub(crate) fn apart(a: &Candidate, b: &Candidate, case: &Case) -> f64 {
    let of_sensor = |sensor: usize| {
        let (mut squares, mut count) = (0.0, 0.0);
        let pairs = a.check.series[sensor].iter().zip(&b.check.series[sensor]);
        for (a, b) in pairs.flat_map(|(a, b)| a.iter().zip(b)) {
            squares += (a - b).powi(2);
            count += 1.0;
        }
        let scale = case.check.noise[sensor] + 1e-4 * case.check.spread[sensor];
        (squares / f64::max(count, 1.0)).sqrt() / scale
    };
    (0..a.check.series.len()).map(of_sensor).fold(0.0, f64::max)
}
