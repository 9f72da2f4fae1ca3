//! `sinew fleet`: the distribution of a fleet from recordings of each device
//! (docs/explanation/identification.md, eq. 18 to 26).

mod axes;
mod found;
pub mod json;
mod one_second;
pub mod page;
#[cfg(test)]
mod tests;

pub use found::{FittedDevice, FleetFit, Recorded, estimate};
pub use one_second::{OneSecond, one_second};

use sinew_sim::{Plant, Rig};

use crate::error::Result;
use crate::fit::stages::fitted_slots;
use crate::population::Fleet;

/// Names of the free parameters of a rig that tell one device from another: not those of a start,
/// and not those that differ by recording.
pub fn parameters(plant: &Plant) -> Vec<&str> {
    let slots = fitted_slots(plant).into_iter();
    slots
        .map(|slot| plant.parameters()[slot].name.as_str())
        .collect()
}

/// Refuses a fleet whose parameters are not the rig's free ones.
///
/// # Errors
/// `File`, as [`Fleet::is_of`]; `Rig` for a rig that cannot be compiled.
pub fn is_of(fleet: &Fleet, rig: &Rig) -> Result<()> {
    let plant = Plant::new(rig)?;
    fleet.is_of(&rig.file, &parameters(&plant))
}
