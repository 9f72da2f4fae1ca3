//! The emitted `Cargo.toml`.

use super::{EmitOptions, HEADER};
use crate::spec::ModelSpec;

pub(super) fn print(spec: &ModelSpec, options: &EmitOptions) -> String {
    let name = &spec.name;
    let library = name.replace('-', "_");
    let [device, mpc] =
        ["device", "mpc"].map(|part| toml::Value::from(format!("{}/{part}", options.firmware)));
    format!(
        r#"# {HEADER}

[package]
name = "sinew-model-{name}"
description = "The network of {name} and the controller built on it"
version = "0.1.0"
edition = "2024"
rust-version = "1.87"
publish = false

[lib]
name = "sinew_model_{library}"

[dependencies]
sinew-device = {{ path = {device} }}
sinew-mpc = {{ path = {mpc} }}

# A workspace of its own: boards, which are workspaces too, and tests depend on it by path.
[workspace]
"#
    )
}
