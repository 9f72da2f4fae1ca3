//! The printed `src/network.rs`: shapes, state, predictions and derivatives.

mod body;
pub(super) mod layers;
mod seed;
mod seeded;
mod stateful;
mod stateless;
mod types;
mod uses;

use super::HEADER;
use super::plan::Plan;
use body::Body;
use seed::Seed;

/// Returns true if derivatives skip the units that a rectifier shuts.
pub(super) fn is_rectified(plan: &Plan<'_>) -> bool {
    Seed::of(plan).is_some_and(|seed| seed.rectified)
}

pub(super) fn print(plan: &Plan<'_>) -> String {
    text(plan, false)
}

/// As [`print()`], with `predict_in_layers` beside the rest.
pub(super) fn print_in_layers(plan: &Plan<'_>) -> String {
    text(plan, true)
}

fn text(plan: &Plan<'_>, in_layers: bool) -> String {
    let network = plan.network;
    let (inputs, outputs, state) = (network.inputs(), network.outputs(), network.state());
    let sizes = if state > 0 {
        format!(
            "/// Numbers that a call is given.
pub const INPUTS: usize = {inputs};
/// Numbers that a call gives.
pub const OUTPUTS: usize = {outputs};
/// Numbers that are kept from one call to the next.
pub const STATE: usize = {state};
/// Variables of the derivatives: inputs, then the hidden state before the call.
pub const VARIABLES: usize = INPUTS + STATE;
/// Differentiated results: outputs, then the hidden state after the call.
pub const RESULTS: usize = OUTPUTS + STATE;
"
        )
    } else {
        format!(
            "/// Numbers that a call is given.
pub const INPUTS: usize = {inputs};
/// Numbers that a call gives.
pub const OUTPUTS: usize = {outputs};
"
        )
    };
    let body = Body::new(plan);
    let derivatives = if state > 0 {
        body.stateful()
    } else if let Some(seed) = &body.seed {
        body.seeded(seed)
    } else {
        body.stateless()
    };
    let text = [
        types::windows(plan),
        types::state(plan),
        derivatives,
        types::activations(plan),
        body.forward.clone(),
        body.backward.clone(),
        if in_layers {
            format!("\n{}", layers::print(plan, &types::bytes(plan)))
        } else {
            String::new()
        },
    ]
    .concat();
    let uses = uses::print(plan, &text);
    format!("//! The network: its layers in turn, and their derivatives.\n//!\n//! {HEADER}\n\n{uses}\n{sizes}\n{text}")
        .trim_end()
        .to_string()
        + "\n"
}

const JACOBIAN: &str = "/// The outputs, to the same bits as [`predict`], and their exact derivatives: `jacobian[i][r]` is
/// d output `r` / d input `i`.
";

const CURVATURE: &str = "/// Second-order terms: `h[i][j]` is the second derivative of `sum of weights[r] output_r` with respect to
/// inputs `i` and `j`. Cost: `INPUTS` passes forward and backward on dual numbers.
";

const ROWS: &str = "/// Results that one pass backward differentiates.
const ROWS: usize = 0;

";

const ALONG: &str = "/// Numbers with derivatives along the one at `i`, if it is among them.
fn along<const LEN: usize>(values: &[f32; LEN], i: usize) -> [Dual; LEN] {
    let mut dual = values.map(Dual::constant);
    if let Some(dual) = dual.get_mut(i) {
        dual.tangent = 1.0;
    }
    dual
}

";
