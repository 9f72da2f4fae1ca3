//! The printed `tests/golden.rs`: the crate against the program that the network came from.

use super::HEADER;
use crate::Network;
use crate::literal;

pub(super) fn print(network: &Network) -> String {
    let library = network.name.replace('-', "_");
    let vectors: String = network
        .golden
        .iter()
        .map(|golden| {
            let x = literal::block(golden.x.iter().copied().map(literal::float), 8, 2);
            let y = literal::block(golden.y.iter().copied().map(literal::double), 8, 2);
            format!("    (\n        &{x},\n        &{y},\n    ),\n")
        })
        .collect();
    let (uses, call) = if network.state() > 0 {
        (
            "INPUTS, OUTPUTS, State, predict",
            "        let mut state = State::new();
        let mut found = [0.0; OUTPUTS];
        for x in x.chunks_exact(INPUTS) {
            let x: &[f32; INPUTS] = x.try_into().expect(\"chunks have this length\");
            found = predict(&mut state, x);
        }
",
        )
    } else {
        (
            "INPUTS, OUTPUTS, predict",
            "        let x: &[f32; INPUTS] = (*x).try_into().expect(\"as many numbers as inputs\");
        let found: [f32; OUTPUTS] = predict(x);
",
        )
    };
    format!(
        "//! The outputs are those of the program that the network came from, or of the network in double precision.
//!
//! {HEADER}

use {library}::{{{uses}}};

/// Inputs of calls in turn, from rest, and the outputs after the last.
#[rustfmt::skip]
const GOLDEN: &[(&[f32], &[f64])] = &[
{vectors}];

#[test]
fn outputs_are_those_of_the_framework() {{
    let values = GOLDEN.iter().flat_map(|(_, y)| y.iter().copied());
    let low = values.clone().fold(f64::INFINITY, f64::min);
    let high = values.fold(f64::NEG_INFINITY, f64::max);
    for (x, expected) in GOLDEN {{
{call}        for (found, expected) in found.iter().zip(*expected) {{
            let error = (f64::from(*found) - expected).abs();
            let limit = 1e-5 * (high - low) + 1e-6 * high.abs().max(low.abs());
            assert!(error <= limit, \"{{found}} where {{expected}} was expected\");
        }}
    }}
}}
"
    )
}
