//! Other people's physics judges the simulator. What they wrote lies in `tests/foreign`, with the
//! programs that wrote it.

mod finger;
mod foam;
mod laws;
mod learned;
mod mass_spring_damper;
mod mujoco;
mod mujoco_rests;
pub mod recording;
