//! CMA-ES with full covariance (Hansen 2016, "The CMA Evolution Strategy: A Tutorial",
//! arXiv:1604.00772, figure 6), its default parameters.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_ident::noise::gaussian;

/// Lowers `cost` from `mean` on with `evaluations`; `project` brings a point inside the limits.
/// Returns the lowest cost and its point. A point outside is judged at its projection, plus its
/// squared distance from it.
pub fn minimise(
    mean: Vec<f64>,
    mut sigma: f64,
    evaluations: usize,
    seed: u64,
    project: &dyn Fn(&mut [f64]),
    cost: &dyn Fn(&[f64]) -> f64,
) -> (f64, Vec<f64>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let count = mean.len();
    let n = count as f64;
    let lambda = 4 + (3.0 * n.ln()) as usize;
    let mu = lambda / 2;
    let raw: Vec<f64> = (0..mu)
        .map(|i| ((lambda as f64 + 1.0) / 2.0).ln() - (i as f64 + 1.0).ln())
        .collect();
    let sum: f64 = raw.iter().sum();
    let weights: Vec<f64> = raw.iter().map(|w| w / sum).collect();
    let effective = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
    let c_sigma = (effective + 2.0) / (n + effective + 5.0);
    let d_sigma = 1.0 + 2.0 * (((effective - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma;
    let c_c = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n);
    let c_1 = 2.0 / ((n + 1.3).powi(2) + effective);
    let c_mu = (2.0 * (effective - 2.0 + 1.0 / effective) / ((n + 2.0).powi(2) + effective))
        .min(1.0 - c_1);
    let chi = n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));

    let mut mean = DVector::from_vec(mean);
    let mut covariance = DMatrix::<f64>::identity(count, count);
    let mut path_sigma = DVector::zeros(count);
    let mut path_c = DVector::zeros(count);
    let mut best = (f64::INFINITY, mean.as_slice().to_vec());
    let mut used = 0;
    let mut generation = 0;
    while used + lambda <= evaluations {
        generation += 1;
        let eigen = SymmetricEigen::new(covariance.clone());
        let lengths = eigen.eigenvalues.map(|value| value.max(1e-20).sqrt());
        let axes = &eigen.eigenvectors;
        let mut drawn: Vec<(f64, DVector<f64>)> = (0..lambda)
            .map(|_| {
                let z = DVector::from_fn(count, |_, _| gaussian(&mut random));
                let y = axes * z.component_mul(&lengths);
                let point = &mean + &y * sigma;
                let mut inside = point.as_slice().to_vec();
                project(&mut inside);
                let outside: f64 = (inside.iter().zip(&point))
                    .map(|(a, b)| (a - b) * (a - b))
                    .sum();
                let here = cost(&inside);
                if here < best.0 {
                    best = (here, inside);
                }
                (here + outside / n, y)
            })
            .collect();
        used += lambda;
        drawn.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut step = DVector::zeros(count);
        for (weight, (_, y)) in weights.iter().zip(&drawn) {
            step += y * *weight;
        }
        mean += &step * sigma;
        let whitened = axes * (axes.tr_mul(&step)).component_div(&lengths);
        path_sigma = path_sigma * (1.0 - c_sigma)
            + whitened * (c_sigma * (2.0 - c_sigma) * effective).sqrt();
        let length = path_sigma.norm();
        let decay = (1.0 - (1.0 - c_sigma).powi(2 * generation)).sqrt();
        let hold = f64::from(u8::from(length / decay < (1.4 + 2.0 / (n + 1.0)) * chi));
        path_c = path_c * (1.0 - c_c) + &step * (hold * (c_c * (2.0 - c_c) * effective).sqrt());
        let lost = (1.0 - hold) * c_c * (2.0 - c_c);
        covariance *= 1.0 - c_1 - c_mu + c_1 * lost;
        covariance += &path_c * path_c.transpose() * c_1;
        for (weight, (_, y)) in weights.iter().zip(&drawn) {
            covariance += y * y.transpose() * (c_mu * weight);
        }
        sigma *= ((c_sigma / d_sigma) * (length / chi - 1.0)).exp();
    }
    best
}
