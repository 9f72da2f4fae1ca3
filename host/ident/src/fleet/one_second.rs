//! Worth of the first second of a new device (docs/explanation/identification.md, eq. 26).

use nalgebra::{DMatrix, DVector};
use sinew_sim::Rig;

use super::axes::device;
use super::{FleetFit, Recorded};
use crate::error::{Kind, Result};
use crate::fit::{FitOptions, fit};
use crate::order;
use crate::population::Device;
use crate::recording::Recording;

/// Length of a first second.
const SECOND: f64 = 1.0;

/// Standard deviations of the coordinates of a device that is not of the estimate.
#[derive(Clone, Debug, PartialEq)]
pub struct OneSecond {
    /// Without any recording: those of the fleet.
    pub fleet: Vec<f64>,
    /// After one second without the fleet, the median of the devices; infinite where most do not
    /// show it within a second.
    pub alone: Vec<f64>,
    /// After one second with the fleet, the median of the devices.
    pub both: Vec<f64>,
}

/// Fits the first second of each device, outliers left out, without the fleet and adds what the
/// fleet knows to its precision (eq. 26). A second that cannot be fitted, as of few rows, shows
/// nothing. `progress` hears of each fit.
///
/// # Errors
/// The user has stopped it.
pub fn one_second(
    rig: &Rig,
    devices: &[Recorded],
    found: &FleetFit,
    mut progress: impl FnMut(usize),
) -> Result<OneSecond> {
    let of_new = found.fleet.of_a_new_device();
    let size = found.fleet.axes.len();
    // Without any spread of the devices there is nothing to learn from a recording.
    let known = of_new.clone().try_inverse();
    let (mut alone, mut both) = (vec![Vec::new(); size], vec![Vec::new(); size]);
    let members = found.devices.iter().zip(devices).enumerate();
    for (k, (_, recorded)) in members.filter(|(_, (it, _))| it.judged.outlier.is_none()) {
        progress(k);
        let Some(recording) = recorded.recordings.first() else {
            continue;
        };
        let short = first_second(recording)?;
        let own = match fit(rig, &[short], &FitOptions::default(), &mut |_| {}) {
            Ok(fitted) => device(&fitted, &found.fleet.axes),
            Err(error) if matches!(error.kind(), Kind::Interrupted) => return Err(error),
            Err(_) => Device {
                at: DVector::zeros(size),
                precision: DMatrix::zeros(size, size),
            },
        };
        let together = known.as_ref().and_then(|known| {
            let precision: DMatrix<f64> = known + &own.precision;
            precision.try_inverse()
        });
        for j in 0..size {
            alone[j].push(own.variance(j).map_or(f64::INFINITY, f64::sqrt));
            both[j].push(together.as_ref().map_or(0.0, |it| it[(j, j)].sqrt()));
        }
    }
    Ok(OneSecond {
        fleet: (0..size).map(|j| of_new[(j, j)].sqrt()).collect(),
        alone: alone.into_iter().map(median).collect(),
        both: both.into_iter().map(median).collect(),
    })
}

/// The rows of the first second of a recording, all where it is shorter.
fn first_second(recording: &Recording) -> Result<Recording> {
    let t = recording.t();
    let end = t.partition_point(|time| *time <= t[0] + SECOND);
    recording.rows(0..end)
}

fn median(mut values: Vec<f64>) -> f64 {
    order::sort(&mut values);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
