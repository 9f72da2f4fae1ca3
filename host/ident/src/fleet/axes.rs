//! Coordinates of fitted devices.

use nalgebra::{DMatrix, DVector};
use sinew_sim::{Parameter, Plant};

use crate::fit::{Covariance, Fit};
use crate::population::{Axis, Device, Scale};

/// Standard deviation, as a part of the value, up to which a value keeps its sign for certain.
const CERTAIN: f64 = 0.3;

/// Fitted value of a parameter and the variance of its error; `None` where the device's recordings
/// do not determine it.
pub(super) fn known(fit: &Fit, name: &str) -> Option<(f64, f64)> {
    let Covariance { names, rows } = &fit.covariance;
    let place = names.iter().position(|other| other == name)?;
    let parameter = fit.parameters.iter().find(|p| p.name == name)?;
    Some((parameter.value, rows[place][place]))
}

/// Axis of a parameter over the devices that determine it. Its mean has their sign; the value is
/// for the population to say.
///
/// The scale is that of logarithms where no device can have another sign.
pub(super) fn axis(plant: &Plant, name: &str, fits: &[&Fit]) -> Option<Axis> {
    let parameter: &Parameter = &plant.parameters()[plant.slot(name)?];
    let known: Vec<(f64, f64)> = fits.iter().filter_map(|fit| known(fit, name)).collect();
    let sign = known.first()?.0.signum();
    let one_sign = known.iter().all(|(value, _)| value * sign > 0.0);
    let certain = |(value, variance): &(f64, f64)| variance.sqrt() <= CERTAIN * value.abs();
    let logarithm = one_sign && (parameter.non_negative || known.iter().all(certain));
    Some(Axis {
        name: parameter.name.clone(),
        unit: parameter.unit.clone(),
        scale: if logarithm { Scale::Log } else { Scale::Linear },
        mean: sign,
    })
}

/// Coordinates of a device and their precision: zero for what its recordings do not determine.
pub(super) fn device(fit: &Fit, axes: &[Axis]) -> Device {
    let mut at = DVector::zeros(axes.len());
    let mut precision = DMatrix::zeros(axes.len(), axes.len());
    let (mut places, mut slopes) = (Vec::new(), Vec::new());
    for (j, axis) in axes.iter().enumerate() {
        if let Some((value, _)) = known(fit, &axis.name) {
            at[j] = axis.coordinate(value);
            places.push(j);
            slopes.push(axis.slope(value));
        }
    }
    let Covariance { names, rows } = &fit.covariance;
    let own = places.iter().map(|&j| {
        let name = &axes[j].name;
        names.iter().position(|other| other == name).unwrap_or(0)
    });
    let own: Vec<usize> = own.collect();
    let covariance = DMatrix::from_fn(own.len(), own.len(), |row, column| {
        rows[own[row]][own[column]] * slopes[row] * slopes[column]
    });
    // A covariance that rounding has spoilt: each parameter by itself.
    let inverse = covariance.clone().cholesky().map_or_else(
        || DMatrix::from_diagonal(&covariance.diagonal().map(|it| it.recip())),
        |factor| factor.inverse(),
    );
    for (row, &to_row) in places.iter().enumerate() {
        for (column, &to_column) in places.iter().enumerate() {
            precision[(to_row, to_column)] = inverse[(row, column)];
        }
    }
    Device { at, precision }
}
