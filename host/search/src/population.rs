//! Population search: the evolution strategy CMA-ES with elites, for objectives that have no
//! derivative or are flat in parts (docs/decisions/0109-population-search.md).
//!
//! N. Hansen, "The CMA evolution strategy: a tutorial", arXiv:1604.00772, with the default
//! constants there. Places lie in 0 to 1. A generation is drawn around a mean with a covariance
//! that learns the directions which helped (mutation), and its better half is averaged (crossover).
//! The best place of a run joins a generation as an elite, without another evaluation (Hansen,
//! "Injecting external solutions into CMA-ES", arXiv:1110.4181). The same seed gives the same
//! places.

use rayon::prelude::*;

/// Spread of a run that begins anywhere.
const ELSEWHERE: f64 = 0.25;
/// A search whose spread is below this has ended, and begins anew.
const CONVERGED: f64 = 1e-4;

/// Place and its cost.
pub type Scored = (Vec<f64>, f64);

/// Settings of a population search.
#[derive(Clone, Copy, Debug)]
pub struct Population<'a> {
    /// Evaluations that may be made.
    pub evaluations: usize,
    /// Standard deviation of the first generation, as a part of the searched range.
    pub spread: f64,
    /// Seed of the draws.
    pub seed: u64,
    /// Least standard deviation of each place, so that a setting of whole numbers is not stuck
    /// between two of them; 0: none.
    pub least: &'a [f64],
}

impl Population<'_> {
    /// The cheapest place found, from places whose costs are known; at least one. Places outside 0
    /// to 1 are the caller's to judge.
    pub fn search(&self, known: &[Scored], cost: impl Fn(&[f64]) -> f64 + Sync) -> Scored {
        let mut known: Vec<Scored> = known.to_vec();
        known.sort_by(|a, b| a.1.total_cmp(&b.1));
        let Some(first) = known.first().cloned() else {
            return (Vec::new(), f64::INFINITY);
        };
        let n = first.0.len();
        let mut best = first;
        let mut random = Random(self.seed);
        let (mut made, mut run) = (0, 0);
        while made < self.evaluations && n > 0 {
            // Each start in the order of its cost; then anywhere, each time with more draws.
            let (mean, spread) = match known.get(run) {
                Some(start) => (start.0.clone(), self.spread),
                None => ((0..n).map(|_| random.uniform()).collect(), ELSEWHERE),
            };
            let doublings = (run / known.len().max(1)).min(4);
            let size = (4 + (3.0 * (n as f64).ln()) as usize).max(6) << doublings;
            let mut strategy = Strategy::new(mean, spread, size, self.least);
            let mut elite = known.get(run).cloned();
            let (mut still, mut cheapest) = (0, f64::INFINITY);
            while made < self.evaluations {
                let count = size.min(self.evaluations - made);
                let drawn: Vec<Vec<f64>> = (0..count).map(|_| strategy.draw(&mut random)).collect();
                let costs: Vec<f64> = drawn.par_iter().map(|place| cost(place)).collect();
                made += count;
                let mut generation: Vec<Scored> = drawn.into_iter().zip(costs).collect();
                for scored in &generation {
                    if scored.1 < best.1 {
                        best = scored.clone();
                    }
                }
                let lowest = generation.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
                still = if lowest < cheapest { 0 } else { still + 1 };
                cheapest = cheapest.min(lowest);
                if count < size {
                    break;
                }
                let lowest = generation
                    .iter()
                    .min_by(|a, b| a.1.total_cmp(&b.1))
                    .cloned();
                generation.extend(elite.clone());
                strategy.learn(generation);
                elite = match (elite, lowest) {
                    (Some(old), Some(new)) if old.1 <= new.1 => Some(old),
                    (old, new) => new.or(old),
                };
                if strategy.sigma < CONVERGED || still > 10 + 30 * n / size {
                    break;
                }
            }
            run += 1;
        }
        best
    }
}

/// State of CMA-ES.
struct Strategy<'a> {
    mean: Vec<f64>,
    sigma: f64,
    /// Covariance, its eigenvectors (columns) and the roots of its eigenvalues.
    covariance: Vec<Vec<f64>>,
    vectors: Vec<Vec<f64>>,
    roots: Vec<f64>,
    path_sigma: Vec<f64>,
    path: Vec<f64>,
    weights: Vec<f64>,
    generation: i32,
    least: &'a [f64],
}

impl<'a> Strategy<'a> {
    fn new(mean: Vec<f64>, sigma: f64, size: usize, least: &'a [f64]) -> Self {
        let n = mean.len();
        let parents = size / 2;
        let half = (size as f64 + 1.0) / 2.0;
        let raw: Vec<f64> = (1..=parents).map(|i| half.ln() - (i as f64).ln()).collect();
        let sum: f64 = raw.iter().sum();
        Self {
            sigma,
            covariance: identity(n),
            vectors: identity(n),
            roots: vec![1.0; n],
            path_sigma: vec![0.0; n],
            path: vec![0.0; n],
            weights: raw.iter().map(|w| w / sum).collect(),
            generation: 0,
            mean,
            least,
        }
    }

    /// Standard deviation of a place as it is drawn.
    fn deviation(&self, i: usize) -> f64 {
        self.sigma * self.covariance[i][i].sqrt()
    }

    fn draw(&self, random: &mut Random) -> Vec<f64> {
        let n = self.mean.len();
        let z: Vec<f64> = (0..n).map(|_| random.normal()).collect();
        (0..n)
            .map(|i| {
                let step: f64 = (0..n)
                    .map(|j| self.vectors[i][j] * self.roots[j] * z[j])
                    .sum();
                let least = self.least.get(i).copied().unwrap_or(0.0);
                let more = (least * least - self.deviation(i).powi(2)).max(0.0).sqrt();
                let extra = if more > 0.0 {
                    more * random.normal()
                } else {
                    0.0
                };
                self.mean[i] + self.sigma * step + extra
            })
            .collect()
    }

    /// Moves mean, covariance and spread towards the better half.
    fn learn(&mut self, mut generation: Vec<Scored>) {
        let n = self.mean.len();
        let size = n as f64;
        generation.sort_by(|a, b| a.1.total_cmp(&b.1));
        let effective = 1.0 / self.weights.iter().map(|w| w * w).sum::<f64>();
        let c_sigma = (effective + 2.0) / (size + effective + 5.0);
        let damping =
            1.0 + 2.0 * (((effective - 1.0) / (size + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma;
        let c_path = (4.0 + effective / size) / (size + 4.0 + 2.0 * effective / size);
        let c_one = 2.0 / ((size + 1.3).powi(2) + effective);
        let c_rank = (1.0 - c_one)
            .min(2.0 * (effective - 2.0 + 1.0 / effective) / ((size + 2.0).powi(2) + effective));
        let expected = size.sqrt() * (1.0 - 1.0 / (4.0 * size) + 1.0 / (21.0 * size * size));

        // Steps of the parents in units of sigma; elites from afar count as far as draws reach.
        let steps: Vec<Vec<f64>> = generation
            .iter()
            .take(self.weights.len())
            .map(|(place, _)| {
                let step: Vec<f64> = (0..n)
                    .map(|i| (place[i] - self.mean[i]) / self.sigma)
                    .collect();
                let length = self
                    .whitened(&step)
                    .iter()
                    .map(|v| v * v)
                    .sum::<f64>()
                    .sqrt();
                let most = size.sqrt() + 2.0 * size / (size + 2.0);
                let share = if length > most { most / length } else { 1.0 };
                step.iter().map(|v| v * share).collect()
            })
            .collect();
        let moved: Vec<f64> = (0..n)
            .map(|i| steps.iter().zip(&self.weights).map(|(s, w)| w * s[i]).sum())
            .collect();
        for (mean, step) in self.mean.iter_mut().zip(&moved) {
            // The mean stays where there is something to find.
            *mean = (*mean + self.sigma * step).clamp(0.0, 1.0);
        }
        let white = self.whitened(&moved);
        let keep = (c_sigma * (2.0 - c_sigma) * effective).sqrt();
        for (path, step) in self.path_sigma.iter_mut().zip(&white) {
            *path = (1.0 - c_sigma) * *path + keep * step;
        }
        self.generation += 1;
        let length = self.path_sigma.iter().map(|v| v * v).sum::<f64>().sqrt();
        let unbiased = (1.0 - (1.0 - c_sigma).powi(2 * self.generation)).sqrt();
        let long = length / unbiased > (1.4 + 2.0 / (size + 1.0)) * expected;
        let keep = if long {
            0.0
        } else {
            (c_path * (2.0 - c_path) * effective).sqrt()
        };
        for (path, step) in self.path.iter_mut().zip(&moved) {
            *path = (1.0 - c_path) * *path + keep * step;
        }
        let lost = if long {
            c_one * c_path * (2.0 - c_path)
        } else {
            0.0
        };
        for i in 0..n {
            for j in 0..n {
                let rank: f64 = steps
                    .iter()
                    .zip(&self.weights)
                    .map(|(s, w)| w * s[i] * s[j])
                    .sum();
                let old = self.covariance[i][j];
                self.covariance[i][j] = (1.0 - c_one - c_rank + lost) * old
                    + c_one * self.path[i] * self.path[j]
                    + c_rank * rank;
            }
        }
        let growth = (c_sigma / damping * (length / expected - 1.0)).min(1.0);
        self.sigma = (self.sigma * growth.exp()).min(1.0);
        (self.vectors, self.roots) = eigen(&self.covariance);
    }

    /// `C^(-1/2) v`.
    fn whitened(&self, v: &[f64]) -> Vec<f64> {
        let n = v.len();
        let inner: Vec<f64> = (0..n)
            .map(|j| (0..n).map(|i| self.vectors[i][j] * v[i]).sum::<f64>() / self.roots[j])
            .collect();
        (0..n)
            .map(|i| (0..n).map(|j| self.vectors[i][j] * inner[j]).sum())
            .collect()
    }
}

fn identity(n: usize) -> Vec<Vec<f64>> {
    (0..n)
        .map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect())
        .collect()
}

/// Eigenvectors (columns) of a symmetric matrix and the roots of its eigenvalues, which are held
/// positive; by Jacobi's rotations.
fn eigen(matrix: &[Vec<f64>]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let n = matrix.len();
    let mut a = matrix.to_vec();
    let mut vectors = identity(n);
    for _ in 0..30 {
        let off: f64 = (0..n)
            .flat_map(|i| (0..i).map(move |j| (i, j)))
            .map(|(i, j)| a[i][j] * a[i][j])
            .sum();
        let diagonal: f64 = (0..n).map(|i| a[i][i] * a[i][i]).sum();
        if off <= 1e-28 * diagonal {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for row in &mut a {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                let (above, below) = a.split_at_mut(q);
                for (x, y) in above[p].iter_mut().zip(&mut below[0]) {
                    (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
                }
                for row in &mut vectors {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
            }
        }
    }
    let largest = (0..n).map(|i| a[i][i]).fold(0.0, f64::max);
    let floor = (1e-14 * largest).max(f64::MIN_POSITIVE);
    let roots = (0..n).map(|i| a[i][i].max(floor).sqrt()).collect();
    (vectors, roots)
}

/// SplitMix64, and normal numbers from it.
struct Random(u64);

impl Random {
    /// Uniform in 0 to 1, without 0.
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 + f64::EPSILON / 4.0
    }

    /// Normal with deviation 1 (Box and Muller).
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search(
        n: usize,
        evaluations: usize,
        seed: u64,
        cost: impl Fn(&[f64]) -> f64 + Sync,
    ) -> Scored {
        let start = vec![0.8; n];
        let known = [(start.clone(), cost(&start))];
        let population = Population {
            evaluations,
            spread: 0.2,
            seed,
            least: &[],
        };
        population.search(&known, cost)
    }

    #[test]
    fn eigenvectors_rebuild_the_matrix() {
        let matrix = [[4.0, 1.0, -0.5], [1.0, 3.0, 0.25], [-0.5, 0.25, 0.01]];
        // A positive part is asked for; this one is indefinite, so shift it.
        let shifted: Vec<Vec<f64>> = (0..3)
            .map(|i| {
                (0..3)
                    .map(|j| matrix[i][j] + f64::from(u8::from(i == j)))
                    .collect()
            })
            .collect();
        let (vectors, roots) = eigen(&shifted);
        for i in 0..3 {
            for j in 0..3 {
                let rebuilt: f64 = (0..3)
                    .map(|k| vectors[i][k] * roots[k].powi(2) * vectors[j][k])
                    .sum();
                assert!(
                    (rebuilt - shifted[i][j]).abs() < 1e-12,
                    "{i}, {j}: {rebuilt}"
                );
            }
        }
    }

    #[test]
    fn a_sphere_an_ellipsoid_and_a_curved_valley_are_followed_to_their_end() {
        let sphere = |x: &[f64]| x.iter().map(|x| (x - 0.3).powi(2)).sum::<f64>();
        assert!(search(6, 900, 1, sphere).1 < 1e-8);
        // A million between the axes, which are turned by half a right angle.
        let ellipsoid = |x: &[f64]| {
            let (a, b) = (x[0] + x[1] - 0.9, x[0] - x[1] + 0.1);
            a * a + 1e6 * b * b
        };
        assert!(search(2, 900, 2, ellipsoid).1 < 1e-6);
        // Rosenbrock's in -2 to 2.
        let valley = |x: &[f64]| {
            let x: Vec<f64> = x.iter().map(|x| 4.0 * x - 2.0).collect();
            let parts = x.windows(2);
            parts
                .map(|w| 100.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).powi(2))
                .sum::<f64>()
        };
        assert!(search(4, 4000, 3, valley).1 < 1e-6);
    }

    #[test]
    fn a_deep_valley_beside_a_broad_one_is_found_by_a_run_that_begins_elsewhere() {
        // A simplex from 0.8 ends at a cost of 1.
        let cost = |x: &[f64]| {
            let to = |place: f64| x.iter().map(|x| (x - place).powi(2)).sum::<f64>().sqrt();
            (1.0 + to(0.9)).min(10.0 * to(0.2))
        };
        let found = (0..10).filter(|seed| search(2, 1500, *seed, cost).1 < 1e-2);
        let count = found.count();
        assert!(count >= 8, "{count} of 10");
    }

    #[test]
    fn the_same_seed_gives_the_same_place_and_the_budget_is_kept() {
        let made = std::sync::atomic::AtomicUsize::new(0);
        let cost = |x: &[f64]| {
            made.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            x.iter().map(|x| (x - 0.7).abs().sqrt()).sum::<f64>()
        };
        let one = search(5, 123, 7, cost);
        assert_eq!(made.into_inner(), 1 + 123);
        let cost = |x: &[f64]| x.iter().map(|x| (x - 0.7).abs().sqrt()).sum::<f64>();
        assert_eq!(one, search(5, 123, 7, cost));
        assert_ne!(one, search(5, 123, 8, cost));
        assert!(one.1 <= cost(&[0.8; 5]));
        assert_eq!(search(5, 0, 7, cost).0, vec![0.8; 5]);
    }

    #[test]
    fn costs_that_are_not_numbers_are_never_chosen() {
        let cost = |x: &[f64]| if x[0] < 0.5 { f64::NAN } else { x[0] + x[1] };
        let found = search(2, 200, 9, cost);
        assert!((found.0[0] - 0.5).abs() < 0.05, "{found:?}");
    }
}
