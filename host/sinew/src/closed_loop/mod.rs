//! Controllers in closed loop with a simulated plant: the firmware on a board or on this computer,
//! and PID and RISE as baselines.

pub mod baseline;
pub mod benchmark;
pub mod channel_fault;
pub mod control_problem;
pub mod controller_result;
pub mod disturbance;
pub mod model_loop;
pub mod mpc;
pub mod perturbed_plant;
pub mod pid;
pub mod plant_program;
pub mod policy;
pub mod reference;
pub mod rise;
pub mod scenario;
pub mod setup;
pub mod transient;
