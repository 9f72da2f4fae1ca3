//! `sinew-fleet-fit/1`: the result of [`estimate`](super::estimate) for programs.

use nalgebra::DMatrix;
use serde_json::{Map, Value, json};

use super::{FittedDevice, FleetFit};
use crate::population::{Axis, Scale};

/// Format of the document.
pub const FORMAT: &str = "sinew-fleet-fit/1";

/// Result of a fit of a fleet as JSON, SI. A number that is not finite is null.
pub fn json(found: &FleetFit) -> Value {
    let (fleet, population) = (&found.fleet, &found.population);
    let parameter = |(j, axis): (usize, &Axis)| {
        let of_new = fleet.of_a_new_device()[(j, j)].sqrt();
        let value = json!({
            "mean": axis.mean, "unit": axis.unit,
            "scale": match axis.scale { Scale::Log => "log", Scale::Linear => "linear" },
            "deviation": population.covariance[(j, j)].sqrt(),
            "deviation_of_mean": population.of_mean[(j, j)].sqrt(),
            "deviation_of_a_new_device": of_new,
        });
        (axis.name.clone(), value)
    };
    let rows = |matrix: &DMatrix<f64>| -> Vec<Vec<f64>> {
        let rows = matrix.row_iter();
        rows.map(|row| row.iter().copied().collect()).collect()
    };
    let device = |(device, member): (&FittedDevice, &crate::population::Member)| {
        let deviations = fleet.axes.iter().zip(&device.judged.deviations);
        let deviations = deviations.map(|(axis, it)| (axis.name.clone(), json!(it)));
        let values = member.values.iter();
        let signals = device.fit.sensors.iter();
        json!({
            "name": device.name,
            "recordings": member.recordings,
            "outlier": member.outlier,
            "values": values.map(|(name, it)| (name.clone(), json!(it))).collect::<Map<_, _>>(),
            "deviations": deviations.collect::<Map<_, _>>(),
            "explained": signals.clone().all(|sensor| sensor.is_explained()),
            "rms": signals.map(|sensor| {
                let rms = Some(sensor.rms).filter(|rms| rms.is_finite());
                (sensor.signal.clone(), json!(rms))
            }).collect::<Map<_, _>>(),
        })
    };
    let each = found.devices.iter().zip(&fleet.members);
    json!({
        "format": FORMAT,
        "rig": fleet.rig,
        "parameters": fleet.axes.iter().enumerate().map(parameter).collect::<Map<_, _>>(),
        "covariance": rows(&fleet.covariance),
        "covariance_of_mean": rows(&fleet.of_mean),
        "shrinkage": population.shrinkage,
        "widening": fleet.widening,
        "freedom": fleet.freedom,
        "devices_missing": population.missing(),
        "devices": each.map(device).collect::<Vec<_>>(),
    })
}
