//! Draws of a new device.

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use crate::noise::gaussian;

/// Student's t in several coordinates, to draw from.
#[derive(Clone, Debug)]
pub struct Draws {
    mean: DVector<f64>,
    /// A matrix whose product with its transpose is the covariance.
    root: DMatrix<f64>,
    freedom: usize,
}

impl Draws {
    /// Draws of this mean, covariance (it may be singular) and degrees of freedom (more than 2).
    pub fn new(mean: DVector<f64>, covariance: DMatrix<f64>, freedom: usize) -> Self {
        let eigen = covariance.symmetric_eigen();
        let sizes = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
        Self {
            mean,
            root: eigen.eigenvectors * DMatrix::from_diagonal(&sizes),
            freedom,
        }
    }

    /// Coordinates of one device: a normal deviate over the root of a chi-squared one, scaled to
    /// the covariance.
    pub fn draw(&self, random: &mut ChaCha8Rng) -> DVector<f64> {
        let normal = DVector::from_fn(self.mean.len(), |_, _| gaussian(random));
        let chi: f64 = (0..self.freedom).map(|_| gaussian(random).powi(2)).sum();
        let scale = ((self.freedom as f64 - 2.0) / chi).sqrt();
        &self.mean + &self.root * normal * scale
    }
}
