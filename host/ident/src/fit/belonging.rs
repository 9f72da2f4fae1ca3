//! Prior of a device of a fleet: Student's t of its parameters' coordinates
//! (docs/explanation/identification.md, eq. 24 and 25).

use nalgebra::{DMatrix, DVector};

use crate::population::{Axis, Fleet};

/// Prior of the fitted parameters of a device that is of a fleet.
#[derive(Clone, Debug)]
pub(crate) struct Belonging {
    /// One entry a fitted parameter.
    axes: Vec<Axis>,
    mean: DVector<f64>,
    /// Inverse of the scale matrix of Student's t.
    precision: DMatrix<f64>,
    freedom: f64,
}

/// Part of a parameter's own variance that is added to it, so that a fleet whose devices are all
/// alike along some direction has a prior, too.
const RIDGE: f64 = 1e-6;

impl Belonging {
    /// Prior of the parameters with these names; `None` without a parameter, or for one that the
    /// fleet does not have.
    pub fn new(fleet: &Fleet, names: &[&str]) -> Option<Self> {
        let place = |name: &&str| fleet.axes.iter().position(|axis| axis.name == *name);
        let places: Vec<usize> = names.iter().map(place).collect::<Option<_>>()?;
        let freedom = fleet.freedom as f64;
        let covariance = fleet.of_a_new_device() * ((freedom - 2.0) / freedom);
        let mut own = covariance.select_rows(&places).select_columns(&places);
        let largest = own.diagonal().amax();
        for j in 0..own.nrows() {
            own[(j, j)] += RIDGE * own[(j, j)] + 1e-12 * largest;
        }
        Some(Self {
            axes: places.iter().map(|&j| fleet.axes[j].clone()).collect(),
            mean: fleet.mean().select_rows(&places),
            precision: own.cholesky()?.inverse(),
            freedom,
        })
    }

    /// Means, SI.
    pub fn means(&self) -> impl Iterator<Item = f64> {
        self.axes.iter().map(|axis| axis.mean)
    }

    fn distance(&self, values: &[f64]) -> DVector<f64> {
        let at = self.axes.iter().zip(values);
        let at = at.map(|(axis, value)| axis.coordinate(*value));
        DVector::from_iterator(values.len(), at) - &self.mean
    }

    /// Squared distance from the mean, in units of the scale matrix.
    fn square(&self, distance: &DVector<f64>) -> f64 {
        distance.dot(&(&self.precision * distance))
    }

    /// Cost of values, SI, zero at the mean; infinite for a value of the wrong sign.
    pub fn cost(&self, values: &[f64]) -> f64 {
        let distance = self.distance(values);
        if distance.iter().any(|it| !it.is_finite()) {
            return f64::INFINITY;
        }
        let square = self.square(&distance);
        0.5 * (self.freedom + values.len() as f64) * (square / self.freedom).ln_1p()
    }

    /// Gradient of the cost by `z = value / scale`, and a curvature that is never too small along
    /// it: that of the normal distribution which touches Student's t here and lies above it.
    pub fn linearised(&self, values: &[f64], scale: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let distance = self.distance(values);
        let count = values.len();
        if distance.iter().any(|it| !it.is_finite()) {
            return (DVector::zeros(count), DMatrix::zeros(count, count));
        }
        let square = self.square(&distance);
        let weight = (self.freedom + count as f64) / (self.freedom + square);
        let slopes = DVector::from_fn(count, |j, _| self.axes[j].slope(values[j]) * scale[j]);
        let pull = &self.precision * distance * weight;
        let slopes_of = DMatrix::from_diagonal(&slopes);
        let curvature = &slopes_of * &self.precision * &slopes_of * weight;
        (pull.component_mul(&slopes), curvature)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::population::Scale;

    fn fleet() -> Fleet {
        let axis = |name: &str, scale, mean| Axis {
            name: name.into(),
            unit: String::new(),
            scale,
            mean,
        };
        Fleet {
            file: "fleet.toml".into(),
            rig: "r".into(),
            axes: vec![
                axis("a", Scale::Log, 2.0),
                axis("b", Scale::Linear, 0.5),
                axis("c", Scale::Log, -3.0),
            ],
            covariance: DMatrix::from_row_slice(
                3,
                3,
                &[0.04, 0.01, 0.0, 0.01, 0.09, 0.02, 0.0, 0.02, 0.05],
            ),
            of_mean: DMatrix::zeros(3, 3),
            widening: 1.5,
            freedom: 6,
            members: Vec::new(),
        }
    }

    #[test]
    fn the_gradient_is_that_of_the_cost() {
        let prior = Belonging::new(&fleet(), &["c", "a", "b"]).unwrap();
        let (values, scale) = ([-2.4, 2.9, 0.1], [3.0, 2.0, 0.5]);
        let (gradient, _) = prior.linearised(&values, &scale);
        for j in 0..3 {
            let moved = |step: f64| {
                let mut values = values;
                values[j] += step * scale[j];
                prior.cost(&values)
            };
            let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!(difference.abs() > 0.1, "nothing to compare");
            let off = (gradient[j] / difference - 1.0).abs();
            assert!(off < 1e-6, "{j}: {} {difference}", gradient[j]);
        }
        assert_eq!(prior.cost(&[-3.0, 2.0, 0.5]), 0.0);
        assert_eq!(prior.cost(&[3.0, 2.0, 0.5]), f64::INFINITY);
    }

    #[test]
    fn far_away_the_prior_lets_go() {
        let prior = Belonging::new(&fleet(), &["b"]).unwrap();
        let pull = |value: f64| prior.linearised(&[value], &[1.0]).0[0];
        assert!(pull(1.0) > pull(0.6));
        assert!(pull(50.0) < pull(1.5), "{} {}", pull(50.0), pull(1.5));
        assert!(Belonging::new(&fleet(), &["b", "d"]).is_none());
    }
}
