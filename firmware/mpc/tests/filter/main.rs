//! The filter against a Kalman filter in double precision, and its rules: gate, gaps, bounds,
//! freeze, late readings, no drift without excitation.

#[path = "../common/mod.rs"]
mod common;
mod hostile;
mod late;
mod linear;
mod precision;
mod reference;
mod rules;
mod start;
