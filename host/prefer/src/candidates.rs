//! Candidates: what is compared, described by features of which less is better.

use nalgebra::{DMatrix, DVector};

use crate::answer::Answer;
use crate::error::Error;

/// Mean of the weight of a feature: people want less of each
/// (docs/explanation/preferences.md, eq. 1).
const WEIGHT: f64 = 0.6;

/// Spread of those weights among people.
const WEIGHT_SPREAD: f64 = 1.0;

/// Spread of what a weighted sum cannot say: thresholds, and one thing before the other.
const BEYOND: f64 = 2.5;

/// Length over which that changes, in spreads of the features.
const LENGTH: f64 = 0.7;

/// Candidates with their features, and the prior of their utilities.
#[derive(Clone, Debug)]
pub struct Candidates {
    mean: DVector<f64>,
    /// Factor of the prior covariance.
    factor: DMatrix<f64>,
}

impl Candidates {
    /// Takes one row of features a candidate. Less of a feature is better; its size and unit do not
    /// matter, and features without negative numbers are compared by their ratios.
    ///
    /// # Errors
    /// Fewer than two candidates, rows of different lengths, numbers that are not finite.
    pub fn new(features: &[Vec<f64>]) -> Result<Self, Error> {
        let count = features.len();
        if count < 2 {
            return Err(Error::TooFew(count));
        }
        let expected = features[0].len();
        let sound = |row: &Vec<f64>| row.len() == expected && row.iter().all(|v| v.is_finite());
        if let Some(candidate) = features.iter().position(|row| !sound(row)) {
            return Err(Error::Features {
                candidate,
                expected,
            });
        }
        let mut z = DMatrix::zeros(count, expected);
        for feature in 0..expected {
            let column: Vec<f64> = features.iter().map(|row| row[feature]).collect();
            z.set_column(feature, &DVector::from_vec(standardised(&column)));
        }
        let mean = -WEIGHT * z.column_sum();
        let mut covariance = WEIGHT_SPREAD.powi(2) * &z * z.transpose();
        let scale = LENGTH.powi(2) * expected.max(1) as f64;
        for a in 0..count {
            for b in 0..count {
                let apart = (z.row(a) - z.row(b)).norm_squared() / scale;
                covariance[(a, b)] += BEYOND.powi(2) * (-apart / 2.0).exp();
            }
            // Candidates that are alike in every feature may still differ a little.
            covariance[(a, a)] += 1e-4;
        }
        let factor = covariance.cholesky().ok_or(Error::Features {
            candidate: 0,
            expected,
        })?;
        Ok(Self {
            mean,
            factor: factor.unpack(),
        })
    }

    /// Number of candidates.
    pub fn len(&self) -> usize {
        self.mean.len()
    }

    /// True if there are none; never the case.
    pub fn is_empty(&self) -> bool {
        self.mean.is_empty()
    }

    /// Prior mean of the utilities.
    pub(crate) const fn mean(&self) -> &DVector<f64> {
        &self.mean
    }

    /// Factor L of the prior covariance L Lᵀ.
    pub(crate) const fn factor(&self) -> &DMatrix<f64> {
        &self.factor
    }

    /// # Errors
    /// An answer about a candidate that is not there, or about one and the same.
    pub(crate) fn holds(&self, answers: &[Answer]) -> Result<(), Error> {
        let candidates = self.len();
        let sound =
            |a: &Answer| a.first < candidates && a.second < candidates && a.first != a.second;
        match answers.iter().position(|answer| !sound(answer)) {
            Some(answer) => Err(Error::Pair { answer, candidates }),
            None => Ok(()),
        }
    }
}

/// Share of its median that is added to a feature before its logarithm is taken: a person does not
/// tell what is small from what is nothing.
const FLOOR: f64 = 0.05;

/// A column with mean 0 and spread 1: logarithms where none is negative, as a person sees twice as
/// much rather than a millimetre more. A column that is constant says nothing.
fn standardised(column: &[f64]) -> Vec<f64> {
    let mut sorted = column.to_vec();
    sorted.sort_by(f64::total_cmp);
    let floor = FLOOR * sorted[sorted.len() / 2];
    let ratios = sorted[0] >= 0.0 && floor > 0.0;
    let of = |v: &f64| if ratios { (v + floor).ln() } else { *v };
    let values: Vec<f64> = column.iter().map(of).collect();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    let spread = (squares / count).sqrt();
    let size = values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    let constant = spread <= 1e-9 * size.max(1e-300);
    let scaled = |v: f64| if constant { 0.0 } else { (v - mean) / spread };
    values.into_iter().map(scaled).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::Choice;

    #[test]
    fn units_of_a_feature_do_not_matter() {
        let rows = |scale: f64| vec![vec![1.0 * scale], vec![3.0 * scale], vec![2.0 * scale]];
        let [a, b] = [1.0, 1e-3].map(|s| Candidates::new(&rows(s)).unwrap());
        assert!((a.mean() - b.mean()).norm() < 1e-9);
        assert!((a.factor() - b.factor()).norm() < 1e-9);
    }

    #[test]
    fn unsound_candidates_and_answers_are_refused() {
        assert_eq!(Candidates::new(&[vec![1.0]]).unwrap_err(), Error::TooFew(1));
        let bad = |row: Vec<f64>| Candidates::new(&[vec![1.0], row]).unwrap_err();
        let expected = Error::Features {
            candidate: 1,
            expected: 1,
        };
        assert_eq!(bad(vec![]), expected);
        assert_eq!(bad(vec![f64::NAN]), expected);
        let two = Candidates::new(&[vec![1.0], vec![1.0]]).unwrap();
        let answer = |first, second| Answer {
            first,
            second,
            choice: Choice::Alike,
        };
        assert!(two.holds(&[answer(0, 1)]).is_ok());
        assert!(two.holds(&[answer(0, 2)]).is_err());
        assert!(two.holds(&[answer(1, 1)]).is_err());
    }
}
