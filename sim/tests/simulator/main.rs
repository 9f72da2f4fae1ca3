//! The simulator, put to the test: one program, so that what they share is compiled and linked
//! once.

mod broken_rigs;
mod closed_forms;
mod complex;
mod derivatives;
mod dry_tendons;
mod dual;
mod emps;
mod energy;
mod every_kind;
mod exact;
mod foreign;
mod geometry;
mod geometry_refusals;
mod hasel;
mod imposed;
mod inputs;
mod laws;
mod mechanisms;
mod order;
mod passive;
mod past;
mod per_recording;
mod refusals;
mod rig_text;
mod signals;
