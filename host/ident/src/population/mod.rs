//! Distribution of the parameters of a population of devices: estimated from devices that are each
//! known to an uncertainty of their own, kept in a file, and drawn from
//! (docs/explanation/identification.md, eq. 18 to 23).

mod draw;
mod estimate;
mod file;
mod outliers;
mod student;
#[cfg(test)]
mod tests;

pub use draw::Draws;
pub use estimate::{Device, FEWEST, Population, population};
pub use file::{Axis, Fleet, Member, Scale};
pub use outliers::{Judged, members};
