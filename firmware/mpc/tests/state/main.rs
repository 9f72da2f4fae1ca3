//! The loop that knows its state: derivatives, limits, gaps, and a mass with dry friction beside a
//! PID that was tuned on the very plant.

#[path = "../common/mod.rs"]
mod common;
mod derivatives;
mod mass;
mod network;
mod plant;
mod rules;
mod tracking;
mod tuned_pid;
