//! The integrator: fixed sub-steps of classical Runge-Kutta, cut exactly where a body stops,
//! sticks, breaks away or turns round (docs/explanation/plant.md, eq. 18 to 21).

mod dynamics;
mod event;
mod event_handling;
mod event_location;
pub(crate) mod exact;
mod initial_modes;
pub(crate) mod input_chain;
mod interval;
mod least_constraint;
mod linear;
mod modes;
mod plain;
mod rate;
mod runge_kutta;
mod signal;
mod stepper;
mod sticking;
mod stiction_set;
mod substep;

pub use stepper::Stepper;
