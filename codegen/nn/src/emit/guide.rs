//! The printed `README.md` and `examples/predict.rs`: how a program calls the network.

use super::{HEADER, LIBRARY};
use crate::{Network, summary};

/// `examples/predict.rs`.
pub(super) fn example(network: &Network) -> String {
    format!(
        "//! Outputs of the network, in the units that it was trained in.
//!
//! {HEADER}

{}",
        calls(network)
    )
}

/// `README.md`.
pub(super) fn readme(network: &Network, c_abi: bool) -> String {
    let name = &network.name;
    let table = summary::table(network);
    let golden = if network.golden.is_empty() {
        "The file of the network brought no vectors to test it by; `sinew verify` compares it with \
         its framework."
    } else {
        "`cargo test` compares the outputs with those of the program that the network came from."
    };
    let c = if c_abi {
        format!("\nFor C: `c/` builds the library `{LIBRARY}` with its header.\n")
    } else {
        String::new()
    };
    format!(
        "# {name}

<!-- {HEADER} -->

A network as a `no_std` crate, without heap and without dependencies.

```text
{}
```

In `Cargo.toml` of the program:

```toml
[dependencies]
{name} = {{ path = \"path/to/this/folder\" }}
```

In its source; `cargo run --example predict` runs the same:

```rust
{}```

`predict_with_jacobian` gives the derivatives of the outputs too, `curvature` second derivatives.
Arrays are flat, the last axis running fastest; `cargo doc --open` has every type.
{golden}
{c}",
        table.trim_end(),
        calls(network)
    )
}

fn calls(network: &Network) -> String {
    let library = network.name.replace('-', "_");
    if network.state() > 0 {
        format!(
            "use {library}::{{INPUTS, OUTPUTS, State, predict}};

fn main() {{
    // At rest; a call for each sample moves it on.
    let mut state = State::new();
    let x = [0.1_f32; INPUTS];
    for sample in 0..3 {{
        let y: [f32; OUTPUTS] = predict(&mut state, &x);
        println!(\"sample {{sample}}: y = {{y:?}}\");
    }}
}}
"
        )
    } else {
        format!(
            "use {library}::{{INPUTS, OUTPUTS, predict}};

fn main() {{
    let x = [0.1_f32; INPUTS];
    let y: [f32; OUTPUTS] = predict(&x);
    println!(\"y = {{y:?}}\");
}}
"
        )
    }
}
