//! The C interface: a crate in `c/` that is a static library, and its header.

use super::{File, HEADER, file};
use crate::Network;

/// The name of the library, whatever the network's.
pub const LIBRARY: &str = "sinew_network";

/// The crate's files.
pub(super) fn files(network: &Network) -> Vec<File> {
    vec![
        file("c/Cargo.toml", manifest(network)),
        file("c/src/lib.rs", library(network)),
        file(&format!("c/{LIBRARY}.h"), header(network)),
    ]
}

fn manifest(network: &Network) -> String {
    let name = &network.name;
    format!(
        "# {HEADER}

[package]
name = \"{name}-c\"
description = \"The network {name} for C\"
version = \"0.1.0\"
edition = \"2024\"
rust-version = \"1.85\"
publish = false

[lib]
name = \"{LIBRARY}\"
crate-type = [\"staticlib\"]
test = false
doctest = false

[dependencies]
{name} = {{ path = \"..\" }}

[profile.release]
lto = \"fat\"
codegen-units = 1
panic = \"abort\"

[workspace]
"
    )
}

fn library(network: &Network) -> String {
    let crate_name = network.name.replace('-', "_");
    let (uses, state, predict, jacobian, reset, results, variables) = if network.state() > 0 {
        (
            "INPUTS, OUTPUTS, RESULTS, State, VARIABLES, predict, predict_with_jacobian",
            "\n/// What the network remembers. Calls are made from one thread, and not from an interrupt during another.\nstatic mut STATE: State = State::new();\n",
            "    // SAFETY: see STATE.\n    let state = unsafe { &mut *(&raw mut STATE) };\n    *y = predict(state, x);\n",
            "    // SAFETY: see STATE.\n    let state = unsafe { &mut *(&raw mut STATE) };\n    *y = predict_with_jacobian(state, x, jacobian);\n",
            "    // SAFETY: see STATE.\n    unsafe { STATE = State::new() };\n",
            "RESULTS",
            "VARIABLES",
        )
    } else {
        (
            "INPUTS, OUTPUTS, predict, predict_with_jacobian",
            "",
            "    *y = predict(x);\n",
            "    *y = predict_with_jacobian(x, jacobian);\n",
            "",
            "OUTPUTS",
            "INPUTS",
        )
    };
    format!(
        "//! The network `{}` for C: `{LIBRARY}.h` says what is expected.
//!
//! {HEADER}
#![no_std]

use core::panic::PanicInfo;

use {crate_name}::{{{uses}}};
{state}
/// The outputs.
///
/// # Safety
/// `x` is read as `INPUTS` floats, `y` written as `OUTPUTS`; they do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern \"C\" fn sinew_predict(x: *const f32, y: *mut f32) {{
    // SAFETY: what the caller promises.
    let (x, y) = unsafe {{ (&*x.cast::<[f32; INPUTS]>(), &mut *y.cast::<[f32; OUTPUTS]>()) }};
{predict}}}

/// The outputs and their derivatives.
///
/// # Safety
/// As [`sinew_predict`]; `jacobian` is written as `{variables}` rows of `{results}` floats.
#[unsafe(no_mangle)]
pub unsafe extern \"C\" fn sinew_predict_with_jacobian(x: *const f32, y: *mut f32, jacobian: *mut f32) {{
    // SAFETY: what the caller promises.
    let (x, y) = unsafe {{ (&*x.cast::<[f32; INPUTS]>(), &mut *y.cast::<[f32; OUTPUTS]>()) }};
    // SAFETY: as above.
    let jacobian = unsafe {{ &mut *jacobian.cast::<[[f32; {results}]; {variables}]>() }};
{jacobian}}}

/// Forgets all state.
#[unsafe(no_mangle)]
pub extern \"C\" fn sinew_reset() {{
{reset}}}

/// Nothing here panics; the language asks for it.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {{
    loop {{}}
}}
",
        network.name
    )
}

fn header(network: &Network) -> String {
    let (inputs, outputs, state) = (network.inputs(), network.outputs(), network.state());
    let name = &network.name;
    format!(
        "/* The network `{name}`: {HEADER} */
#ifndef SINEW_NETWORK_H
#define SINEW_NETWORK_H

#define SINEW_INPUTS {inputs}
#define SINEW_OUTPUTS {outputs}
#define SINEW_STATE {state} /* numbers kept from one call to the next */

#ifdef __cplusplus
extern \"C\" {{
#endif

/* Outputs y for inputs x, in the units of the network; x and y do not overlap. Not reentrant where
   SINEW_STATE is not 0. */
void sinew_predict(const float *x, float *y);

/* The same, and derivatives: jacobian[v * R + r] is d result r / d variable v. Variables are the inputs, then
   the state before the call; results the outputs, then the state after it; R their number. */
void sinew_predict_with_jacobian(const float *x, float *y, float *jacobian);

/* Forgets all state. */
void sinew_reset(void);

#ifdef __cplusplus
}}
#endif

#endif
"
    )
}
