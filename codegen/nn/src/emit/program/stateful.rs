//! A network that remembers: its state moves on, and derivatives are by the state too.

use super::body::Body;
use super::{ALONG, ROWS};
use crate::emit::plan::BLOCK;

impl Body<'_> {
    pub(super) fn stateful(&self) -> String {
        let given = self.given;
        let given_dual = if given.is_empty() { "" } else { "&x, " };
        let fields = self.plan.state();
        let chain = |start: &str, prefix: &str| {
            let more: String = fields
                .iter()
                .map(|(name, _)| format!(".chain({prefix}.{name})"))
                .collect();
            format!("{start}{more}")
        };
        let after: String = self
            .plan
            .recurrent()
            .filter(|(_, layer)| layer.streaming)
            .map(|(place, layer)| {
                let name = &self.plan.names[place];
                let cell = format!("    state.{name}_cell = a.{name}_step.cell;\n");
                let cell = if layer.cell.vectors() == 2 {
                    cell
                } else {
                    String::new()
                };
                format!("    state.{name} = a.{name}_step.state;\n{cell}")
            })
            .collect();
        let seeds = chain("t_y.iter_mut()", "&mut t_state");
        let results = chain("t_x.iter()", "&t_state");
        let mut start = String::from("INPUTS");
        let duals: String = fields
            .iter()
            .map(|(name, length)| {
                let line =
                    format!("        {name}: along(&state.{name}, i.wrapping_sub({start})),\n");
                start.push_str(&format!(" + {length}"));
                line
            })
            .collect();
        let weighted: String = chain("t_y.iter_mut()", "&mut t_state");
        format!(
            "/// The outputs for inputs `x`; the state moves on.
pub fn predict(state: &mut State, x: &[f32; INPUTS]) -> [f32; OUTPUTS] {{
    let mut a = Activations::ZERO;
    forward(x, state, &mut a);
{after}    {result}
}}

/// The outputs, to the same bits as [`predict`], and the exact derivatives of outputs and new state
/// with respect to inputs and state: `jacobian[v][r]` is d result `r` / d variable `v`. The state
/// moves on.
pub fn predict_with_jacobian(
    state: &mut State,
    x: &[f32; INPUTS],
    jacobian: &mut [[f32; RESULTS]; VARIABLES],
) -> [f32; OUTPUTS] {{
    let mut a = Activations::ZERO;
    forward(x, state, &mut a);
    for first in (0..RESULTS).step_by(ROWS) {{
        let mut t_y = [[0.0; ROWS]; OUTPUTS];
        let mut t_state = State::filled([0.0; ROWS]);
        let seeds = {seeds};
        for (k, seed) in seeds.skip(first).take(ROWS).enumerate() {{
            if let Some(own) = seed.get_mut(k) {{
                *own = 1.0;
            }}
        }}
        let mut t_x = [[0.0; ROWS]; INPUTS];
        backward(&a, {given}t_y, &mut t_state, &mut t_x);
        for (row, t) in jacobian.iter_mut().zip({results}) {{
            for (place, t) in row.iter_mut().skip(first).zip(t) {{
                *place = *t;
            }}
        }}
    }}
{after}    {result}
}}

/// Second-order terms: `h[i][j]` is the second derivative of `sum of weights[r] result_r` with
/// respect to variables `i` and `j`. The state stays. Cost: `VARIABLES` passes forward and backward
/// on dual numbers.
pub fn curvature(
    state: &State,
    x: &[f32; INPUTS],
    weights: &[f32; RESULTS],
    h: &mut [[f32; VARIABLES]; VARIABLES],
) {{
    for (i, row) in h.iter_mut().enumerate() {{
        let x = along(x, i);
        let state = state_along(state, i);
        let mut a = Activations::ZERO;
        forward(&x, &state, &mut a);
        let mut t_y = [[Dual::ZERO; 1]; OUTPUTS];
        let mut t_state = State::filled([Dual::ZERO; 1]);
        for (t, weight) in {weighted}.zip(weights) {{
            *t = [Dual::constant(*weight)];
        }}
        let mut t_x = [[Dual::ZERO; 1]; INPUTS];
        backward(&a, {given_dual}t_y, &mut t_state, &mut t_x);
        for (place, [t]) in row.iter_mut().zip({results}) {{
            *place = t.tangent;
        }}
    }}
}}

/// The state as numbers with derivatives along variable `i`.
fn state_along(state: &State, i: usize) -> State<Dual> {{
    State {{
{duals}    }}
}}

{ROWS}{ALONG}",
            result = self.result(),
        )
        .replace(
            "const ROWS: usize = 0",
            &format!("const ROWS: usize = {BLOCK}"),
        )
    }
}
