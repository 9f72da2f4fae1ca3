//! Devices whose statistics are those that were released: a search without derivatives
//! (docs/explanation/sharing.md, eq. 9 to 11).

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_ident::noise::gaussian;
use sinew_search::Population;

use crate::budget::Budget;
use crate::region::clip;
use crate::statistics::{Release, expected_error, means};

/// Evaluations of the search, a variable.
const EVALUATIONS: usize = 250;
/// Range of the logarithm of a deviation along an axis, in units of the radius.
const DEVIATION: [f64; 2] = [-5.3, 0.0];
/// Spread of the first generation, as a part of the range.
const SPREAD: f64 = 0.05;

/// Synthetic devices.
#[derive(Clone, Debug, PartialEq)]
pub struct Shared {
    /// Place of each in the region.
    pub places: Vec<Vec<f64>>,
    /// Distance of their statistics from those that were released, in standard deviations of the
    /// noise (root mean square).
    pub distance: f64,
}

/// Fewest devices with which the expected error of each mean is at most `tolerance`, in units of
/// the radius.
pub fn enough(size: usize, budget: &Budget, tolerance: f64) -> usize {
    (expected_error(size, 1, budget) / tolerance).ceil() as usize
}

/// Finds `count` devices whose statistics are nearest to a release. It sees the release alone, so
/// it costs no privacy. The same seed gives the same devices.
pub fn synthesise(release: &Release, count: usize, seed: u64) -> Shared {
    let wanted = release.means();
    let draws = draws(count, release.size, seed);
    // Noise never vanishes; without this a search could not tell how near is near.
    let deviation = release.deviation().max(f64::MIN_POSITIVE);
    let distance = |variables: &[f64]| -> f64 {
        let found = means(&places(variables, &draws, release.size));
        let squares = found
            .iter()
            .zip(&wanted)
            .map(|(a, b)| ((a - b) / deviation).powi(2));
        (squares.sum::<f64>() / wanted.len() as f64).sqrt()
    };
    let start = start(&wanted, release.size);
    let known = [(start.clone(), distance(&start))];
    let search = Population {
        evaluations: EVALUATIONS * start.len(),
        spread: SPREAD,
        seed,
        least: &[],
    };
    let within = |at: &[f64]| {
        // The further outside, the worse, so that the search finds back.
        let outside: f64 = at.iter().map(|x| (x - x.clamp(0.0, 1.0)).abs()).sum();
        distance(at) + 1e3 * outside
    };
    let (found, distance) = search.search(&known, within);
    Shared {
        places: places(&found, &draws, release.size),
        distance,
    }
}

/// Normal draws whose mean is zero and whose covariance is the identity, exactly where there are
/// enough of them (eq. 10).
fn draws(count: usize, size: usize, seed: u64) -> Vec<DVector<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut all = DMatrix::from_fn(count, size, |_, _| gaussian(&mut random));
    for mut column in all.column_iter_mut() {
        let mean = column.mean();
        column.add_scalar_mut(-mean);
    }
    let covariance = all.transpose() * &all / count.max(1) as f64;
    if let Some(factor) = (count > size).then(|| covariance.cholesky()).flatten() {
        let white = factor.l().solve_lower_triangular(&all.transpose());
        if let Some(white) = white {
            all = white.transpose();
        }
    }
    all.row_iter().map(|row| row.transpose()).collect()
}

/// Places of the variables of the search, 0 to 1: the mean, the logarithms of the diagonal of a
/// triangular factor and what is below it.
fn places(variables: &[f64], draws: &[DVector<f64>], size: usize) -> Vec<Vec<f64>> {
    let signed = |x: f64| 2.0 * x - 1.0;
    let mean = DVector::from_fn(size, |i, _| signed(variables[i]));
    let mut factor = DMatrix::zeros(size, size);
    let mut k = size;
    for row in 0..size {
        for column in 0..=row {
            factor[(row, column)] = if row == column {
                (DEVIATION[0] + (DEVIATION[1] - DEVIATION[0]) * variables[k]).exp()
            } else {
                signed(variables[k])
            };
            k += 1;
        }
    }
    let place = |draw: &DVector<f64>| {
        let mut place: Vec<f64> = (&mean + &factor * draw).iter().copied().collect();
        clip(&mut place);
        place
    };
    draws.iter().map(place).collect()
}

/// Variables of the released moments as they stand: noise may have left no covariance, so its
/// eigenvalues are held at those of the least deviation.
fn start(wanted: &[f64], size: usize) -> Vec<f64> {
    let mut mean: Vec<f64> = wanted[..size].to_vec();
    clip(&mut mean);
    let mut covariance = DMatrix::zeros(size, size);
    let mut k = size;
    for row in 0..size {
        for column in 0..=row {
            let weight = if row == column {
                std::f64::consts::SQRT_2
            } else {
                1.0
            };
            let value = wanted[k] * weight - wanted[row] * wanted[column];
            covariance[(row, column)] = value;
            covariance[(column, row)] = value;
            k += 1;
        }
    }
    let mut eigen = covariance.symmetric_eigen();
    let least = (2.0 * DEVIATION[0]).exp() * 4.0;
    eigen
        .eigenvalues
        .apply(|value| *value = value.clamp(least, 1.0));
    let factor = eigen.recompose().cholesky().map(|it| it.l());
    let factor = factor.unwrap_or_else(|| DMatrix::identity(size, size) * least.sqrt());
    let place = |x: f64| (0.5 * (x + 1.0)).clamp(0.0, 1.0);
    let mut variables: Vec<f64> = mean.into_iter().map(place).collect();
    for row in 0..size {
        for column in 0..=row {
            let value = factor[(row, column)];
            variables.push(if row == column {
                ((value.ln() - DEVIATION[0]) / (DEVIATION[1] - DEVIATION[0])).clamp(0.0, 1.0)
            } else {
                place(value)
            });
        }
    }
    variables
}
