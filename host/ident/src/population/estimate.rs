//! Mean and covariance of a population from devices that are known to an uncertainty of their own
//! (docs/explanation/identification.md, eq. 19 to 22).

use nalgebra::{DMatrix, DVector};

/// Fewest devices of a population.
pub const FEWEST: usize = 3;

/// Fewest degrees of freedom of the tails: with fewer a draw has no finite variance.
const LEAST_FREEDOM: f64 = 3.0;

/// Factor of the spread that few devices cost at most, for the devices to count as enough.
const ENOUGH: f64 = 1.25;

/// Most steps of the search.
const STEPS: usize = 1000;

/// Change of each entry of the covariance, as a part of its axes' deviations, below which the
/// search ends.
const CONVERGED: f64 = 1e-6;

/// Coordinates of one device and the inverse of the covariance of their errors: zero along
/// directions that its recordings do not show.
#[derive(Clone, Debug)]
pub struct Device {
    /// Coordinates, one a parameter.
    pub at: DVector<f64>,
    /// Precision of the coordinates.
    pub precision: DMatrix<f64>,
}

impl Device {
    /// Variance of a coordinate's error by itself; `None` where the device does not show it.
    pub fn variance(&self, axis: usize) -> Option<f64> {
        let shown: Vec<usize> = self.shown().collect();
        let place = shown.iter().position(|it| *it == axis)?;
        let part = self.precision.select_rows(&shown).select_columns(&shown);
        Some(part.try_inverse()?[(place, place)])
    }

    /// Coordinates that the device shows.
    pub fn shown(&self) -> impl Iterator<Item = usize> {
        (0..self.at.len()).filter(|&j| self.precision[(j, j)] > 0.0)
    }
}

/// Distribution of a population's coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Population {
    /// Mean.
    pub mean: DVector<f64>,
    /// Covariance of the devices about the mean, their own uncertainties taken out.
    pub covariance: DMatrix<f64>,
    /// Covariance of the error of the mean.
    pub of_mean: DMatrix<f64>,
    /// Number of devices that it was estimated from.
    pub devices: usize,
    /// Part of the correlations that was taken away for few devices.
    pub shrinkage: f64,
}

impl Population {
    /// Covariance of a device that is not among those of the estimate: that of the devices and of
    /// the error of their mean, widened for few devices (eq. 22).
    pub fn of_a_new_device(&self) -> DMatrix<f64> {
        (&self.covariance + &self.of_mean) * self.widening()
    }

    /// Degrees of freedom of the tails of a new device's distribution (eq. 22).
    pub fn freedom(&self) -> usize {
        freedom(self.devices, self.effective()) as usize
    }

    /// Factor of the covariance of a new device that the unknown covariance costs (eq. 22).
    pub fn widening(&self) -> f64 {
        widening(self.devices, self.effective())
    }

    /// Factor of the spread of a new device that few devices cost.
    pub fn cost_of_few(&self) -> f64 {
        cost_of_few(self.devices, self.effective())
    }

    /// Devices that are missing until few devices cost no more than a quarter of the spread.
    pub fn missing(&self) -> usize {
        let enough = |more: &usize| cost_of_few(self.devices + more, self.effective()) <= ENOUGH;
        (0..).find(enough).unwrap_or(0)
    }

    /// Parameters that the covariance has to be known for: all of them, or one where the
    /// correlations are gone.
    fn effective(&self) -> f64 {
        1.0 + (self.mean.len() as f64 - 1.0) * (1.0 - self.shrinkage)
    }
}

fn freedom(devices: usize, effective: f64) -> f64 {
    (devices as f64 - effective).max(LEAST_FREEDOM)
}

fn widening(devices: usize, effective: f64) -> f64 {
    (devices as f64 - 1.0) / (freedom(devices, effective) - 2.0)
}

fn cost_of_few(devices: usize, effective: f64) -> f64 {
    ((1.0 + 1.0 / devices as f64) * widening(devices, effective)).sqrt()
}

/// Population of devices; `None` where fewer than [`FEWEST`] show some coordinate.
///
/// Restricted maximum likelihood of `at_d ~ N(mean, covariance + precision_d^-1)` by expectation
/// and maximisation. Without uncertainties it is the sample covariance.
pub fn population(devices: &[&Device]) -> Option<Population> {
    let size = devices.first()?.at.len();
    let enough = |axis: usize| {
        let showing = devices.iter().filter(|it| it.precision[(axis, axis)] > 0.0);
        showing.count() >= FEWEST
    };
    if !(0..size).all(enough) {
        return None;
    }
    let mut covariance = DMatrix::from_diagonal(&DVector::from_fn(size, |axis, _| {
        first_variance(devices, axis)
    }));
    for _ in 0..STEPS {
        let next = step(devices, &covariance)?;
        let done = alike(&next, &covariance);
        covariance = next;
        if done {
            break;
        }
    }
    let shrinkage = shrinkage(&covariance, devices.len());
    for row in 0..size {
        for column in (0..size).filter(|&column| column != row) {
            covariance[(row, column)] *= 1.0 - shrinkage;
        }
    }
    let weights = Weights::new(devices, &covariance)?;
    Some(Population {
        mean: weights.mean,
        of_mean: weights.of_mean,
        covariance,
        devices: devices.len(),
        shrinkage,
    })
}

/// True of two covariances that differ by little in units of the deviations of their axes.
fn alike(a: &DMatrix<f64>, b: &DMatrix<f64>) -> bool {
    let size = |row: usize, column: usize| (b[(row, row)] * b[(column, column)]).sqrt();
    let places = (0..a.nrows()).flat_map(|row| (0..=row).map(move |column| (row, column)));
    let mut differences = places.map(|at| ((a[at] - b[at]).abs(), size(at.0, at.1)));
    differences.all(|(difference, size)| difference <= CONVERGED * size)
}

/// Variance of a coordinate over the devices that show it; never zero.
fn first_variance(devices: &[&Device], axis: usize) -> f64 {
    let shown = devices.iter().filter(|it| it.precision[(axis, axis)] > 0.0);
    let shown: Vec<f64> = shown.map(|it| it.at[axis]).collect();
    let mean = shown.iter().sum::<f64>() / shown.len() as f64;
    let squares: f64 = shown.iter().map(|it| (it - mean).powi(2)).sum();
    let smallest = f64::EPSILON * (1.0 + mean * mean);
    (squares / (shown.len() as f64 - 1.0)).max(smallest)
}

/// Weight of each device in the mean, and the mean.
struct Weights {
    /// Inverse covariance of each device's coordinates about the mean.
    each: Vec<DMatrix<f64>>,
    mean: DVector<f64>,
    of_mean: DMatrix<f64>,
}

impl Weights {
    fn new(devices: &[&Device], covariance: &DMatrix<f64>) -> Option<Self> {
        let size = covariance.nrows();
        let mut each = Vec::with_capacity(devices.len());
        let (mut sum, mut of_all) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for device in devices {
            let mixed = DMatrix::identity(size, size) + covariance * &device.precision;
            let weight = symmetric(&device.precision * mixed.try_inverse()?);
            of_all += &weight * &device.at;
            sum += &weight;
            each.push(weight);
        }
        let of_mean = symmetric(sum.try_inverse()?);
        Some(Self {
            mean: &of_mean * of_all,
            of_mean,
            each,
        })
    }
}

/// One step of the search (eq. 20).
fn step(devices: &[&Device], covariance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let Weights {
        each,
        mean,
        of_mean,
    } = Weights::new(devices, covariance)?;
    let size = covariance.nrows();
    let mut sum = DMatrix::zeros(size, size);
    for (device, weight) in devices.iter().zip(&each) {
        let known = weight - weight * &of_mean * weight;
        let deviation = covariance * (weight * (&device.at - &mean));
        sum += &deviation * deviation.transpose() + covariance - covariance * known * covariance;
    }
    Some(symmetric(sum / devices.len() as f64))
}

/// Part of the correlations that chance explains (eq. 21): their variance over their square, as
/// Schäfer and Strimmer (2005) shrink them.
fn shrinkage(covariance: &DMatrix<f64>, devices: usize) -> f64 {
    let (mut chance, mut squares) = (0.0, 0.0);
    for row in 0..covariance.nrows() {
        for column in 0..row {
            let size = (covariance[(row, row)] * covariance[(column, column)]).sqrt();
            let correlation = covariance[(row, column)] / size;
            if correlation.is_finite() {
                let square = (correlation * correlation).min(1.0);
                chance += (1.0 - square).powi(2) / (devices as f64 - 1.0);
                squares += square;
            }
        }
    }
    if chance > 0.0 {
        (chance / squares).min(1.0)
    } else {
        0.0
    }
}

fn symmetric(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let transposed = matrix.transpose();
    (matrix + transposed) * 0.5
}
