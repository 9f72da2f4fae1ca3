//! Controllers side by side on one plant, and the search for their best settings.

pub mod closed_loop;
pub mod disturbance;
pub mod feedback;
pub mod mpc;
pub mod objective;
pub mod optimise;
pub mod pid;
pub mod plant_program;
pub mod reference;
pub mod rise;
pub mod transient;
