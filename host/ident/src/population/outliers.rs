//! Devices that are not of a population (docs/explanation/identification.md, eq. 23).

use super::estimate::{Device, FEWEST, Population, population};
use super::student::exceeding;

/// Chance that any device of a sound fleet is called an outlier.
const FALSE_ALARM: f64 = 0.05;

/// Most devices that may be outliers, as a part of all: beyond that it is two fleets.
const MOST: f64 = 0.25;

/// Judgement of one device by the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// Deviation of each coordinate from the other members' mean, in standard deviations; `None`
    /// where the device or the others do not show it.
    pub deviations: Vec<Option<f64>>,
    /// Coordinate by which it is not of the fleet.
    pub outlier: Option<usize>,
}

/// Population of the devices that belong to it, and the judgement of each device. Outliers are
/// left out one by one, the farthest first; with `all`, none is.
///
/// `None` as [`population`].
pub fn members(devices: &[Device], all: bool) -> Option<(Population, Vec<Judged>)> {
    let mut inside = vec![true; devices.len()];
    let mut outliers = vec![None; devices.len()];
    let most = (MOST * devices.len() as f64) as usize;
    for _ in 0..most {
        let judged = inside.iter().filter(|inside| **inside).count();
        if all || judged <= FEWEST {
            break;
        }
        let found = (0..devices.len())
            .filter(|&d| inside[d])
            .filter_map(|d| Some((d, farthest(&deviations(devices, &inside, d))?)));
        let Some((device, (axis, deviation))) = found.max_by(|a, b| a.1.1.total_cmp(&b.1.1)) else {
            break;
        };
        // A deviation from `judged - 1` others.
        let chance = exceeding(deviation, judged - 2);
        let trials = (judged * devices[device].at.len()) as f64;
        let rest: Vec<&Device> = others(devices, &inside, device).collect();
        if chance * trials >= FALSE_ALARM || population(&rest).is_none() {
            break;
        }
        inside[device] = false;
        outliers[device] = Some(axis);
    }
    let within: Vec<&Device> = others(devices, &inside, devices.len()).collect();
    let judged = outliers.into_iter().enumerate().map(|(d, outlier)| Judged {
        deviations: deviations(devices, &inside, d),
        outlier,
    });
    Some((population(&within)?, judged.collect()))
}

/// The members but one.
fn others<'a>(
    devices: &'a [Device],
    inside: &'a [bool],
    but: usize,
) -> impl Iterator<Item = &'a Device> {
    let members = devices.iter().zip(inside).enumerate();
    members
        .filter(move |(other, (_, inside))| **inside && *other != but)
        .map(|(_, (device, _))| device)
}

/// Deviations of a device from the population of the other members.
fn deviations(devices: &[Device], inside: &[bool], of: usize) -> Vec<Option<f64>> {
    let rest: Vec<&Device> = others(devices, inside, of).collect();
    let device = &devices[of];
    let Some(others) = population(&rest) else {
        return vec![None; device.at.len()];
    };
    let deviation = |axis: usize| {
        let spread = others.covariance[(axis, axis)] + others.of_mean[(axis, axis)];
        let variance = spread + device.variance(axis)?;
        Some((device.at[axis] - others.mean[axis]) / variance.sqrt())
    };
    (0..device.at.len()).map(deviation).collect()
}

/// Coordinate with the largest deviation, and its size.
fn farthest(deviations: &[Option<f64>]) -> Option<(usize, f64)> {
    let known = deviations.iter().enumerate();
    let known = known.filter_map(|(axis, it)| Some((axis, it.as_ref()?.abs())));
    known.max_by(|a, b| a.1.total_cmp(&b.1))
}
