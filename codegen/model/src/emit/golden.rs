//! The emitted `src/golden.rs`: inputs, and what double precision makes of them.

use super::{EmitOptions, HEADER};
use crate::evaluate;
use crate::spec::{Golden, ModelSpec};
use sinew_nn::literal;

pub(super) fn print(spec: &ModelSpec, options: &EmitOptions) -> String {
    let supplied = spec.golden.len();
    let others = drawn(spec, options);
    let drawn = others.len();
    let count = supplied + drawn;
    let length = spec.point_len();
    let outputs = spec.predicted_len();
    let vectors: String = spec
        .golden
        .iter()
        .chain(&others)
        .map(|g| vector(spec, g))
        .collect();
    let seed = options.golden_seed;
    let (hidden, fields) = match spec.hidden_state_len() {
        0 => ("", String::new()),
        n => (
            ", hidden state",
            format!(
                "    /// Hidden state afterwards.
    pub hidden_state: [f64; {n}],
    /// A row for each of these, the columns of `jacobian`.
    pub hidden_state_jacobian: [[f64; {length}]; {n}],
"
            ),
        ),
    };
    format!(
        "//! Golden vectors: what the network gives in double precision, for tests.
//!
//! {HEADER}
//! Vectors that came with the model: {supplied}. Inputs drawn from seed {seed}: {drawn}.

/// One input, the output that belongs to it and its derivatives, in model units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Golden {{
    /// Regressor, flattened: u(k), u(k-1) .., y(k), y(k-1) .., channels{hidden}.
    pub x: [f32; {length}],
    /// y(k+1).
    pub y: [f64; {outputs}],
    /// A row for each output, a column for each value of `x`, channels included.
    pub jacobian: [[f64; {length}]; {outputs}],
{fields}}}

/// The vectors. Nothing in a controller refers to them, so they take no flash.
#[rustfmt::skip]
pub static GOLDEN: [Golden; {count}] = [
{vectors}];
"
    )
}

fn vector(spec: &ModelSpec, golden: &Golden) -> String {
    let x: Vec<f64> = golden.x.iter().copied().map(f64::from).collect();
    let at = evaluate::predict_with_jacobian(spec, &x);
    let jacobian = at.jacobian;
    let doubles = |values: Vec<f64>| values.into_iter().map(literal::double).collect::<Vec<_>>();
    let hidden_state = match spec.hidden_state_len() {
        0 => String::new(),
        _ => format!(
            "        hidden_state: {},
        hidden_state_jacobian: {},
",
            literal::block(doubles(at.hidden_state), 8, 8),
            literal::matrix(at.hidden_state_jacobian.into_iter().map(doubles), 8),
        ),
    };
    format!(
        "    Golden {{
        x: {},
        y: {},
        jacobian: {},
{hidden_state}    }},
",
        literal::block(golden.x.iter().copied().map(literal::float), 8, 4),
        literal::block(doubles(golden.y.clone()), 8, 4),
        literal::matrix(jacobian.into_iter().map(doubles), 8),
    )
}

/// Vectors with inputs drawn evenly from -1 to 1, the range that scaling aims at.
fn drawn(spec: &ModelSpec, options: &EmitOptions) -> Vec<Golden> {
    let mut state = options.golden_seed;
    (0..options.golden_vectors)
        .map(|_| {
            let x: Vec<f32> = (0..spec.point_len()).map(|_| uniform(&mut state)).collect();
            let wide: Vec<f64> = x.iter().copied().map(f64::from).collect();
            Golden {
                x,
                y: evaluate::predict(spec, &wide),
            }
        })
        .collect()
}

/// The next number of SplitMix64 (Steele, Lea and Flood, 2014), its upper 24 bits as -1 to 1: few
/// enough to be exact in f32.
pub(super) fn uniform(state: &mut u64) -> f32 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    (z >> 40) as f32 * (2.0 / 16_777_216.0) - 1.0
}
