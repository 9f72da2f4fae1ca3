//! Fits of all devices, and the population that they are of.

use sinew_sim::{Plant, Rig};

use super::axes::{axis, device, known};
use super::parameters;
use crate::error::{Error, Result};
use crate::fit::{Fit, FitOptions, Progress, fit, require};
use crate::population::{Axis, Device, FEWEST, Fleet, Judged, Member, Population, members};
use crate::recording::Recording;

/// A device and its recordings.
#[derive(Debug, Clone)]
pub struct Recorded {
    /// Its name.
    pub name: String,
    /// Its recordings.
    pub recordings: Vec<Recording>,
}

/// A device after its fit.
#[derive(Debug, Clone)]
pub struct FittedDevice {
    /// Its name.
    pub name: String,
    /// Its fit.
    pub fit: Fit,
    /// Its place beside the other devices.
    pub judged: Judged,
}

/// Result of [`estimate`].
#[derive(Debug, Clone)]
pub struct FleetFit {
    /// The distribution, as a file has it.
    pub fleet: Fleet,
    /// The same in coordinates.
    pub population: Population,
    /// All devices, outliers among them, in their order.
    pub devices: Vec<FittedDevice>,
}

impl FleetFit {
    /// Sentence about each device that is not of the fleet.
    pub fn outliers(&self) -> Vec<String> {
        let outliers = self.devices.iter().filter_map(|device| {
            let axis = device.judged.outlier?;
            let off = match device.judged.deviations[axis] {
                Some(deviation) if deviation >= 0.0 => format!("{deviation:.1} deviations above"),
                Some(deviation) => format!("{:.1} deviations below", -deviation),
                None => "far from".into(),
            };
            let name = &self.fleet.axes[axis].name;
            Some(format!(
                "{} is not of this fleet: its {name} is {off} the others'",
                device.name
            ))
        });
        outliers.collect()
    }

    /// Sentence about the number of devices.
    pub fn said_of_few(&self) -> String {
        let Population { devices, .. } = self.population;
        let cost = 100.0 * (self.population.cost_of_few() - 1.0);
        match self.population.missing() {
            0 => format!("{devices} devices: the spread of a new one is {cost:.0} % wider for it"),
            more => {
                let little = if devices < FEW { " say little" } else { "" };
                format!(
                    "{devices} devices{little}: the spread of a new one is {cost:.0} % wider for \
                     it; {more} more would bring that to 25 %"
                )
            }
        }
    }
}

/// Number of devices below which they are said to say little.
const FEW: usize = 6;

/// Fits the rig to each device and estimates the population of their parameters. Devices that are
/// not of it are left out and named, unless `keep_outliers`. `progress` hears of each step, with
/// the number of the device.
///
/// # Errors
/// `Arguments` for fewer than three devices, for two of one name, and for a rig without a free
/// parameter; `Failed` for a parameter that fewer than three devices determine; as
/// [`fit`](crate::fit::fit) for each device.
pub fn estimate(
    rig: &Rig,
    devices: &[Recorded],
    keep_outliers: bool,
    progress: &mut dyn FnMut(usize, Progress),
) -> Result<FleetFit> {
    let plant = Plant::new(rig)?;
    let names = parameters(&plant);
    refuse(rig, &names, devices)?;
    let mut fits = Vec::with_capacity(devices.len());
    for (index, device) in devices.iter().enumerate() {
        let mut tell = |step| progress(index, step);
        fits.push(fit(
            rig,
            &device.recordings,
            &FitOptions::default(),
            &mut tell,
        )?);
    }
    let all: Vec<&Fit> = fits.iter().collect();
    for name in &names {
        let count = all.iter().filter(|fit| known(fit, name).is_some()).count();
        if count < FEWEST {
            let message = format!("{count} of {} devices determine `{name}`", devices.len());
            return Err(Error::failed(message)
                .expected(format!("at least {FEWEST}: a spread has to be seen"))
                .help(format!(
                    "record motions that show it, or make `{name}` a bare number in {}",
                    rig.file
                )));
        }
    }
    let axes: Vec<Axis> = names
        .iter()
        .filter_map(|name| axis(&plant, name, &all))
        .collect();
    let known_devices: Vec<Device> = fits.iter().map(|fit| device(fit, &axes)).collect();
    let (population, judged) = members(&known_devices, keep_outliers).ok_or_else(|| {
        Error::failed("the devices have no common distribution")
            .expected("fitted parameters with finite uncertainties")
    })?;
    let axes: Vec<Axis> = (axes.into_iter().zip(&population.mean))
        .map(|(axis, mean)| Axis {
            mean: axis.value(*mean),
            ..axis
        })
        .collect();
    let each = devices.iter().zip(fits).zip(judged);
    let devices: Vec<FittedDevice> = each
        .map(|((device, fit), judged)| FittedDevice {
            name: device.name.clone(),
            fit,
            judged,
        })
        .collect();
    Ok(FleetFit {
        fleet: Fleet {
            file: "fleet.toml".into(),
            rig: rig.name.clone(),
            covariance: population.covariance.clone(),
            of_mean: population.of_mean.clone(),
            widening: population.widening(),
            freedom: population.freedom(),
            members: devices.iter().map(|it| member(it, &axes)).collect(),
            axes,
        },
        population,
        devices,
    })
}

/// Entry of a device in the file.
fn member(device: &FittedDevice, axes: &[Axis]) -> Member {
    let values = axes.iter().filter_map(|axis| {
        let (value, _) = known(&device.fit, &axis.name)?;
        Some((axis.name.clone(), value))
    });
    let runs = device.fit.runs.iter();
    Member {
        name: device.name.clone(),
        recordings: runs.map(|run| run.recording.clone()).collect(),
        outlier: device.judged.outlier.map(|axis| axes[axis].name.clone()),
        values: values.collect(),
    }
}

/// Refuses what no population follows from, before any fit.
fn refuse(rig: &Rig, names: &[&str], devices: &[Recorded]) -> Result<()> {
    if names.is_empty() {
        let message = format!("{}: the rig has no free parameter", rig.file);
        return Err(Error::arguments(message)
            .expected("parameters in which the devices differ, as `{ value = ... }`"));
    }
    if devices.len() < FEWEST {
        let message = match devices.len() {
            1 => "one device is no fleet".into(),
            count => format!("{count} devices are no fleet"),
        };
        return Err(Error::arguments(message)
            .expected(format!("at least {FEWEST} devices"))
            .help("name each with --fit FILE, or --device NAME=FILE,FILE"));
    }
    let mut seen: Vec<&str> = Vec::new();
    for device in devices {
        if seen.contains(&device.name.as_str()) {
            return Err(
                Error::arguments(format!("two devices are called `{}`", device.name))
                    .help("name them apart: --device NAME=FILE,FILE"),
            );
        }
        seen.push(&device.name);
    }
    let recordings = devices.iter().flat_map(|device| &device.recordings);
    require(rig, recordings)
}
