#![doc = include_str!("../README.md")]
//!
//! # Reference
//!
//! Wiring of a rig to its board: a file, its check, its picture, and the sources made from it.
//!
//! A [`Wiring`] names for each signal of a controller the pin, what reads or drives it, and the
//! physical values of the converter's ends. [`check`] holds it against the signals and the pins of
//! a [`Board`]; [`sources`] prints what the firmware is compiled with. The file's keys:
//! `docs/reference/wiring.md`.

mod board;
mod boards;
mod check;
mod checked;
mod file;
mod nrf52840;
mod picture;
mod propose;
mod signals;
mod sources;
mod stm32f446;
mod table;
mod units;

pub use board::{Board, Decoder, Pin, Units, Use};
pub use boards::{UnknownBoard, board};
pub use check::check;
pub use checked::Checked;
pub use file::{ActuatorBy, ActuatorWire, Fault, SensorBy, SensorWire, Wiring};
pub use picture::picture;
pub use propose::propose;
pub use signals::{Signal, Signals};
pub use sources::{SourceFile, sources};
pub use table::table;
