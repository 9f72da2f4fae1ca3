//! Search for controller settings: one optimiser, one objective and one budget for every
//! controller.

pub mod control_table;
mod cost_to_go;
pub(crate) mod firmware;
pub mod gradient;
pub mod objective;
pub mod optimise;
pub mod search_space;
pub mod shape;
pub mod tune;
