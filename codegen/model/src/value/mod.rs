//! Rows of the cost-to-go of `[control] terminal = "value"` (docs/explanation/controller.md,
//! eq. 4d): Riccati recursions of the model, linearised at rest at each operating point.

mod linear;
mod matrix;
mod points;
mod rest;
mod riccati;
mod rows;

pub use points::{along, on_motions};
pub use rows::{PointRows, ValueRows, rows};
