//! The printed `Cargo.toml` and `src/lib.rs`.

use super::HEADER;
use crate::{Network, summary};

pub(super) fn manifest(network: &Network) -> String {
    let name = &network.name;
    format!(
        "# {HEADER}

[package]
name = \"{name}\"
description = \"The network {name}\"
version = \"0.1.0\"
edition = \"2024\"
rust-version = \"1.85\"
publish = false

[dependencies]
"
    )
}

pub(super) fn print(network: &Network) -> String {
    let name = &network.name;
    let table: String = summary::table(network)
        .lines()
        .map(|line| format!("//! {line}").trim_end().to_string() + "\n")
        .collect();
    let (calls, items) = if network.state() > 0 {
        (
            "[`predict`] gives the outputs and moves the [`State`] on",
            "INPUTS, OUTPUTS, RESULTS, STATE, State, VARIABLES, curvature, predict, predict_with_jacobian",
        )
    } else {
        (
            "[`predict`] gives the outputs",
            "INPUTS, OUTPUTS, curvature, predict, predict_with_jacobian",
        )
    };
    let items = if items.len() > 70 {
        "\n    INPUTS, OUTPUTS, RESULTS, STATE, State, VARIABLES, curvature, predict, predict_with_jacobian,\n".to_string()
    } else {
        items.to_string()
    };
    let weights = if network.has_tables() {
        "mod weights;\n"
    } else {
        ""
    };
    format!(
        "//! The network `{name}`.
//!
//! {HEADER}
//!
//! {calls}, [`predict_with_jacobian`] also their
//! derivatives, [`curvature`] second derivatives. Arrays are flat, the last axis running fastest.
//!
//! ```text
{table}//! ```
#![no_std]
#![forbid(unsafe_code)]
#![warn(missing_docs)]
// A trained weight may come near pi or ln 2 by chance.
#![allow(clippy::approx_constant)]

pub mod layers;
pub mod math;
mod network;
pub mod number;
{weights}
pub use network::{{{items}}};
"
    )
}
