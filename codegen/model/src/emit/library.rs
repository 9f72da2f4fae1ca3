//! The emitted `src/lib.rs`: what the model is, in words, and what its crate exports.

use super::HEADER;
use crate::spec::{ModelSpec, Role};
use sinew_nn::literal;

pub(super) fn print(spec: &ModelSpec) -> String {
    let name = &spec.name;
    let inputs = literal::count(spec.inputs.len(), "input");
    let outputs = literal::count(spec.outputs.len(), "output");
    let channels = literal::count(spec.channels.len(), "sensor channel");
    let hidden = match spec.hidden_state_len() {
        0 => String::new(),
        n => format!(" Hidden state: {}.", literal::count(n, "value")),
    };
    let (modules, of_layers, of_numbers) = match spec.hidden_state_len() {
        0 => ("", "", ""),
        _ => (
            "\n// The kernels of `layers` find it here.\nuse sinew_mpc::math;\n",
            "pub mod layers;\n",
            "pub mod number;\n",
        ),
    };
    let parameters = literal::count(spec.parameters(), "parameter");
    let signals = signals(spec);
    let layers = layers(spec);
    let horizon = spec.control.horizon;
    let (of_value, cost_to_go) = match &spec.control.value {
        None => ("", String::new()),
        Some(value) => (
            "mod value;\n",
            format!(
                "; a cost-to-go of {} at {}",
                literal::count(value.rows, "row"),
                literal::count(value.points.len(), "point")
            ),
        ),
    };
    let (of_sensor, sensed) = match &spec.soft_sensor {
        None => ("", ""),
        Some(sensor) => (
            "pub mod soft_sensor;\n",
            match sensor.watch {
                None => "; a soft sensor of the outputs",
                Some(_) => "; a soft sensor of the outputs, its channels watched",
            },
        ),
    };
    let beside = cost_to_go + sensed;
    let control_horizon = spec.control.control_horizon;
    let blocks = literal::count(spec.control.blocks().len(), "block");
    let period_ms = spec.period_s * 1e3;
    format!(
        "//! The model `{name}`: {inputs}, {outputs}, {channels}, a step every {period_ms:.3} ms.
//!
//! {HEADER}
//!
//! | signal | unit | physical value of model 0 | of one model unit |
//! |---|---|---|---|
{signals}//!
//! Network, {parameters}: {layers}.{hidden}
//! Controller: {horizon} steps predicted, {control_horizon} decided in {blocks}{beside}.
#![no_std]
#![forbid(unsafe_code)]
#![warn(missing_docs)]
// A trained weight may come near pi or ln 2 by chance.
#![allow(clippy::approx_constant)]

pub mod control;
pub mod golden;
{of_layers}mod network;
{of_numbers}{of_sensor}{of_value}{modules}
pub use control::{{Controller, IDENTITY, Session, controller, session}};
pub use network::Network;
"
    )
}

fn signals(spec: &ModelSpec) -> String {
    let mut text = String::new();
    for role in Role::ALL {
        for (index, signal) in spec.signals(role).iter().enumerate() {
            text.push_str(&format!(
                "//! | {role} {index}: `{}` | {} | {:?} | {:?} |\n",
                signal.name, signal.unit, signal.offset, signal.span
            ));
        }
    }
    text
}

fn layers(spec: &ModelSpec) -> String {
    let layers: Vec<String> = spec.layers.iter().map(ToString::to_string).collect();
    let beside = match spec.skip {
        Some(_) => "; a skip connection",
        None => "",
    };
    layers.join("; ") + beside
}
