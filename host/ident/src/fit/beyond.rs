//! Values beyond the bounds that fitted parameters rest at.
//!
//! A bound that excludes the truth makes a sound plant model look as if it lacked physics. Where a
//! parameter rests at a bound of the rig's owner, the rig is fitted once more without it.

use sinew_sim::Plant;

use super::bounds::{bounds, reached};
use super::score::{SensorError, relative};
use super::stages::Found;
use crate::error::Result;

/// Fit without the bounds that parameters rest at. It explains the recordings better.
#[derive(Debug, Clone, PartialEq)]
pub struct BeyondBounds {
    /// Parameters that left their bounds.
    pub parameters: Vec<BeyondBound>,
    /// Free-run error without these bounds, one entry a sensor.
    pub sensors: Vec<SensorError>,
}

/// One parameter that a bound keeps from a better value, SI.
#[derive(Debug, Clone, PartialEq)]
pub struct BeyondBound {
    /// Its name, such as `spring.stiffness`.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The bound.
    pub bound: f64,
    /// Its fitted value without the bound.
    pub value: f64,
}

/// Largest error without the bounds, as a part of another model's, that is as little as that.
const AS_LITTLE: f64 = 1.05;

impl BeyondBounds {
    /// Tells whether this fit leaves as little as another model does of the same recordings.
    pub(crate) fn leaves_as_little_as(&self, other: &[SensorError]) -> bool {
        relative(&self.sensors) <= AS_LITTLE * relative(other)
    }
}

/// Largest error without the bounds, as a part of the error within them, that is worth a word.
const WORTH_A_WORD: f64 = 0.8;

/// Fits without the bounds that parameters rest at, with `run` of the slots that are released.
/// `None` where none rests at a bound, or nothing is gained.
///
/// # Errors
/// As those of `errors_at`, the errors with these values of the parameters; those of `run` mean
/// that nothing is gained.
pub(super) fn beyond(
    plant: &Plant,
    errors_at: &dyn Fn(&[f64]) -> Result<Vec<SensorError>>,
    (found, within): (&Found, &[SensorError]),
    run: &mut dyn FnMut(&[usize]) -> Result<Found>,
) -> Result<Option<BeyondBounds>> {
    let known = plant.parameters();
    let resting_at = |values: &[f64]| -> Vec<(usize, f64)> {
        let fitted = found.slots.iter().filter(|slot| !found.held.contains(slot));
        let resting = fitted.filter_map(|&slot| Some((slot, reached(&known[slot], values[slot])?)));
        resting.collect()
    };
    let mut resting = resting_at(&found.values);
    if resting.is_empty() {
        return Ok(None);
    }
    // One bound keeps a parameter from the next: those that are met on the way go as well.
    let free = loop {
        let slots: Vec<usize> = resting.iter().map(|(slot, _)| *slot).collect();
        let Ok(free) = run(&slots) else {
            return Ok(None);
        };
        let met = resting_at(&free.values).into_iter();
        let met: Vec<(usize, f64)> = met.filter(|(slot, _)| !slots.contains(slot)).collect();
        if met.is_empty() {
            break free;
        }
        resting.extend(met);
    };
    let sensors = errors_at(&free.values)?;
    let better = relative(&sensors) <= WORTH_A_WORD * relative(within);
    let left = |&(slot, bound): &(usize, f64)| {
        let [low, high] = bounds(&known[slot]);
        let value = free.values[slot];
        (value < low || value > high).then(|| BeyondBound {
            name: known[slot].name.clone(),
            unit: known[slot].unit.clone(),
            bound,
            value,
        })
    };
    let parameters: Vec<BeyondBound> = resting.iter().filter_map(left).collect();
    Ok((better && !parameters.is_empty()).then_some(BeyondBounds {
        parameters,
        sensors,
    }))
}
