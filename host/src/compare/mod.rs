//! Controllers side by side on one plant, and the search for their best settings.

pub mod closed_loop;
pub mod mpc;
pub mod optimise;
pub mod pid;
pub mod reference;
