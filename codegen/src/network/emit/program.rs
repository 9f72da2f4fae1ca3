//! The printed `src/network.rs`: shapes, state, predictions and derivatives.

use super::plan::{BLOCK, Plan};
use super::{HEADER, backward, forward};
use crate::network::{Cell, Op, Window};

pub(super) fn print(plan: &Plan<'_>) -> String {
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
/// What derivatives are taken with respect to: inputs, then the state before the call.
pub const VARIABLES: usize = INPUTS + STATE;
/// What derivatives are taken of: outputs, then the state after the call.
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
    } else if body.seed.is_some() {
        body.seeded()
    } else {
        body.stateless()
    };
    let text = [
        windows(plan),
        state_type(plan),
        derivatives,
        activations(plan),
        body.forward.clone(),
        body.backward.clone(),
    ]
    .concat();
    let uses = uses(plan, &text);
    format!("//! The network: its layers in turn, and their derivatives.\n//!\n//! {HEADER}\n\n{uses}\n{sizes}\n{text}")
        .trim_end()
        .to_string()
        + "\n"
}

/// The `use` lines for the kernels that the text names.
fn uses(plan: &Plan<'_>, text: &str) -> String {
    let words: std::collections::HashSet<&str> = text
        .split(|c: char| !c.is_alphanumeric() && c != '_')
        .collect();
    // A function is named where it is called; a field may have the same name.
    let is_named = |item: &str| {
        let called = [
            format!(" {item}("),
            format!(" {item}::<"),
            format!("({item}("),
        ];
        item.starts_with(char::is_uppercase) && words.contains(item)
            || called.iter().any(|call| text.contains(call.as_str()))
    };
    let mut lines = String::new();
    for (module, items) in super::kernels::ITEMS {
        let mut named: Vec<&str> = items
            .iter()
            .copied()
            .filter(|item| is_named(item))
            .collect();
        // rustfmt sorts types after functions.
        named.sort_by_key(|item| (item.starts_with(char::is_uppercase), *item));
        let list = named.join(", ");
        match named.as_slice() {
            [] => {}
            [one] => lines.push_str(&format!("use crate::{module}::{one};\n")),
            _ => lines.push_str(&format!("use crate::{module}::{{{list}}};\n")),
        }
    }
    let cells: Vec<&str> = ["gru", "lstm", "rnn"]
        .into_iter()
        .filter(|module| words.contains(module))
        .collect();
    match cells.as_slice() {
        [] => {}
        [one] => lines.push_str(&format!("use crate::layers::{one};\n")),
        _ => lines.push_str(&format!("use crate::layers::{{{}}};\n", cells.join(", "))),
    }
    if plan.network.parameters() > 0 {
        lines.push_str("use crate::weights;\n");
    }
    let mut sorted: Vec<&str> = lines.lines().collect();
    sorted.sort_unstable();
    sorted.into_iter().map(wrapped).collect()
}

/// A `use` line as rustfmt would break it.
fn wrapped(line: &str) -> String {
    const WIDTH: usize = 100;
    let parts = line.split_once('{').filter(|_| line.len() > WIDTH);
    let Some((path, list)) = parts else {
        return format!("{line}\n");
    };
    let mut rows = vec![String::from("   ")];
    for item in list.trim_end_matches("};").split(", ") {
        if rows
            .last()
            .is_some_and(|row| row.len() + item.len() + 2 > WIDTH)
        {
            rows.push("   ".into());
        }
        if let Some(row) = rows.last_mut() {
            row.push_str(&format!(" {item},"));
        }
    }
    format!("{path}{{\n{}\n}};\n", rows.join("\n"))
}

fn windows(plan: &Plan<'_>) -> String {
    let mut text = String::new();
    for (place, node) in plan.network.nodes.iter().enumerate() {
        let window = match &node.op {
            Op::Convolution(layer) => &layer.window,
            Op::Pool(layer) => &layer.window,
            _ => continue,
        };
        let two = |shape: &[usize]| match *shape {
            [columns, _] => [1, columns],
            [rows, columns, ..] => [rows, columns],
            _ => [0; 2],
        };
        let from = two(&plan.network.nodes[node.from[0]].shape);
        let name = forward::constant(plan, place, "_WINDOW");
        let Window {
            size,
            stride,
            dilation,
            before,
            ..
        } = window;
        text.push_str(&format!(
            "const {name}: Window = Window {{
    image: {from:?},
    output: {:?},
    size: {size:?},
    stride: {stride:?},
    dilation: {dilation:?},
    before: {before:?},
}};\n\n",
            two(&node.shape)
        ));
    }
    text
}

fn state_type(plan: &Plan<'_>) -> String {
    if !plan.is_stateful() {
        return String::new();
    }
    let fields = plan.state();
    let list = |print: &dyn Fn(&str, usize) -> String| -> String {
        fields
            .iter()
            .map(|(name, length)| print(name, *length))
            .collect()
    };
    let declared = list(&|name, length| {
        format!("    /// Of layer `{name}`.\n    pub {name}: [T; {length}],\n")
    });
    let zeros = list(&|name, length| format!("            {name}: [zero; {length}],\n"));
    let narrow = list(&|name, _| format!("            {name}: self.{name}.map(N::constant),\n"));
    let _ = narrow;
    format!(
        "/// What the network remembers from one call to the next. The numbers are `f32` but inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<T = f32> {{
{declared}}}

impl State {{
    /// At rest.
    pub const fn new() -> Self {{
        Self::filled(0.0)
    }}
}}

impl Default for State {{
    fn default() -> Self {{
        Self::new()
    }}
}}

impl<T: Copy> State<T> {{
    const fn filled(zero: T) -> Self {{
        Self {{
{zeros}        }}
    }}
}}

"
    )
}

fn activations(plan: &Plan<'_>) -> String {
    let mut fields: Vec<(String, String, String)> = Vec::new();
    for (place, node) in plan.buffers() {
        let name = &plan.names[place];
        let length = node.len();
        fields.push((
            name.clone(),
            format!("[N; {length}]"),
            format!("[N::ZERO; {length}]"),
        ));
        if let Op::Recurrent(layer) = &node.op {
            let module = match layer.cell {
                Cell::Simple { .. } => "rnn",
                Cell::Gru { .. } => "gru",
                Cell::Lstm { .. } => "lstm",
            };
            let (kind, zero) = (
                format!("{module}::Step<N, {}>", layer.units),
                format!("{module}::Step::ZERO"),
            );
            fields.push(if layer.streaming {
                (format!("{name}_step"), kind, zero)
            } else {
                let from = &plan.network.nodes[node.from[0]];
                let steps = from.len() / layer.inputs();
                (
                    format!("{name}_steps"),
                    format!("[{kind}; {steps}]"),
                    format!("[{zero}; {steps}]"),
                )
            });
        }
    }
    let declared: String = fields
        .iter()
        .map(|(name, kind, _)| format!("    {name}: {kind},\n"))
        .collect();
    let zeros: String = fields
        .iter()
        .map(|(name, _, zero)| format!("        {name}: {zero},\n"))
        .collect();
    format!(
        "/// What the layers give.
struct Activations<N> {{
{declared}}}

impl<N: Number> Activations<N> {{
    const ZERO: Self = Self {{
{zeros}    }};
}}

"
    )
}

/// The functions.
struct Body<'a> {
    plan: &'a Plan<'a>,
    /// The dense layer at the end and its activation in place, whose adjoints are had from its weights.
    seed: Option<usize>,
    forward: String,
    backward: String,
    /// Arguments of `backward` between activations and adjoints.
    given: &'static str,
}

/// Whether the text uses the variable.
fn mentions(text: &str, word: &str) -> bool {
    text.split(|c: char| !c.is_alphanumeric() && c != '_')
        .any(|found| found == word)
}

impl<'a> Body<'a> {
    fn new(plan: &'a Plan<'a>) -> Self {
        let network = plan.network;
        let last = network.nodes.len() - 1;
        let stateful = plan.is_stateful();
        let seed = seed(plan).filter(|_| !stateful && network.outputs() <= BLOCK);
        let begin = seed.map_or(last, |dense| network.nodes[dense].from[0]);
        let statements = forward::print(plan);
        let state = if stateful { "state: &State<N>, " } else { "" };
        let forward = format!(
            "/// The layers in turn. All predictions go through this one copy: their bits are the same, and flash
/// holds it once.
#[inline(never)]
fn forward<N: Number>(x: &[N; INPUTS], {state}a: &mut Activations<N>) {{
{statements}}}

"
        );
        // With nothing between the input and the seed there is nothing to do.
        let statements = if plan.buffer[begin] == 0 {
            String::new()
        } else {
            backward::print(plan, begin)
        };
        let given = if mentions(&statements, "x") {
            "x, "
        } else {
            ""
        };
        let x = if given.is_empty() {
            ""
        } else {
            "\n    x: &[N; INPUTS],"
        };
        let own = backward::adjoint(plan, begin);
        let length = network.nodes[begin].len();
        let statements_need_mut = statements.contains(&format!("&mut {own})"))
            || statements.contains(&format!("        &mut {own},"));
        let mutable = if statements_need_mut { "mut " } else { "" };
        let state = if stateful {
            "\n    t_state: &mut State<[N; R]>,"
        } else {
            ""
        };
        let length = if begin == last {
            "OUTPUTS".to_string()
        } else {
            length.to_string()
        };
        let backward = if plan.buffer[begin] == 0 {
            String::new()
        } else {
            let a = if mentions(&statements, "a") {
                "a"
            } else {
                "_a"
            };
            format!(
                "/// The layers from the last to the first: adjoints of what they give to adjoints of the input, for `R`
/// results at once.
#[inline(always)]
fn backward<N: Number, const R: usize>(
    {a}: &Activations<N>,{x}
    {mutable}{own}: [[N; R]; {length}],{state}
    t_x: &mut [[N; R]; INPUTS],
) {{
{statements}}}
"
            )
        };
        Self {
            plan,
            seed,
            forward,
            backward,
            given,
        }
    }

    fn result(&self) -> String {
        let last = self.plan.network.nodes.len() - 1;
        self.plan.value(last)
    }

    fn predict(&self) -> String {
        format!(
            "/// The outputs for inputs `x`.
pub fn predict(x: &[f32; INPUTS]) -> [f32; OUTPUTS] {{
    let mut a = Activations::ZERO;
    forward(x, &mut a);
    {}
}}

",
            self.result()
        )
    }

    /// A network that ends in a dense layer with few outputs: its weights are the adjoints to begin with.
    fn seeded(&self) -> String {
        let plan = self.plan;
        let dense = self.seed.unwrap_or(0);
        let begin = plan.network.nodes[dense].from[0];
        let weights = format!("&weights::{}", forward::constant(plan, dense, "_W"));
        let length = plan.network.nodes[begin].len();
        let given = self.given;
        let last = plan.network.nodes.len() - 1;
        let slopes = match plan.network.nodes[last].op {
            Op::Activation(g) if last != dense => {
                let y = plan.borrowed(last);
                let g = forward::activation(g);
                Some((g, y))
            }
            _ => None,
        };
        let direct = plan.buffer[begin] == 0;
        let (declare, target, go) = if direct {
            (String::new(), "jacobian".to_string(), String::new())
        } else {
            (
                format!("    let mut t = [[0.0; OUTPUTS]; {length}];\n"),
                "&mut t".to_string(),
                format!("    backward(&a, {given}t, jacobian);\n"),
            )
        };
        let seed = match &slopes {
            Some((g, y)) => forward::call(
                4,
                "dense_seed_activated",
                &[weights.clone(), g.clone(), y.clone(), target.clone()],
            ),
            None => forward::call(4, "dense_seed", &[weights.clone(), target.clone()]),
        };
        let scaled = match &slopes {
            Some((g, y)) => {
                let y = y.trim_start_matches('&');
                format!("        activate_back({g}, &{y}, &{y}, &mut t_y);\n")
            }
            None => String::new(),
        };
        let mutable = if slopes.is_some() { "mut " } else { "" };
        let (declare_dual, target_dual, go_dual) = if direct {
            (String::new(), "&mut t_x", String::new())
        } else {
            (
                format!("        let mut t = [[Dual::ZERO; 1]; {length}];\n"),
                "&mut t",
                format!(
                    "        backward(&a, {}t, &mut t_x);\n",
                    if given.is_empty() { "" } else { "&x, " }
                ),
            )
        };
        format!(
            "{}{JACOBIAN}pub fn predict_with_jacobian(
    x: &[f32; INPUTS],
    jacobian: &mut [[f32; OUTPUTS]; INPUTS],
) -> [f32; OUTPUTS] {{
    let mut a = Activations::ZERO;
    forward(x, &mut a);
{declare}{seed}{go}    {}
}}

{CURVATURE}pub fn curvature(x: &[f32; INPUTS], weights: &[f32; OUTPUTS], h: &mut [[f32; INPUTS]; INPUTS]) {{
    for (i, row) in h.iter_mut().enumerate() {{
        let x = along(x, i);
        let mut a = Activations::ZERO;
        forward(&x, &mut a);
        let {mutable}t_y = weights.map(|weight| [Dual::constant(weight)]);
{scaled}{declare_dual}{}        let mut t_x = [[Dual::ZERO; 1]; INPUTS];
{go_dual}        *row = t_x.map(|[t]| t.tangent);
    }}
}}

{ALONG}",
            self.predict(),
            self.result(),
            if direct {
                String::new()
            } else {
                forward::call(
                    8,
                    "dense_back",
                    &[weights.clone(), "&t_y".into(), target_dual.into()],
                )
            },
        )
        .replace(
            "        let mut t_x = [[Dual::ZERO; 1]; INPUTS];\n        *row",
            &format!(
                "        let mut t_x = [[Dual::ZERO; 1]; INPUTS];\n{}        *row",
                forward::call(
                    8,
                    "dense_back",
                    &[weights, "&t_y".into(), "&mut t_x".into()]
                )
            ),
        )
    }

    fn stateless(&self) -> String {
        let given = self.given;
        let given_dual = if given.is_empty() { "" } else { "&x, " };
        format!(
            "{}{JACOBIAN}pub fn predict_with_jacobian(
    x: &[f32; INPUTS],
    jacobian: &mut [[f32; OUTPUTS]; INPUTS],
) -> [f32; OUTPUTS] {{
    let mut a = Activations::ZERO;
    forward(x, &mut a);
    for first in (0..OUTPUTS).step_by(ROWS) {{
        let mut seed = [[0.0; ROWS]; OUTPUTS];
        for (k, seed) in seed.iter_mut().skip(first).take(ROWS).enumerate() {{
            if let Some(own) = seed.get_mut(k) {{
                *own = 1.0;
            }}
        }}
        let mut t_x = [[0.0; ROWS]; INPUTS];
        backward(&a, {given}seed, &mut t_x);
        for (row, t) in jacobian.iter_mut().zip(&t_x) {{
            for (place, t) in row.iter_mut().skip(first).zip(t) {{
                *place = *t;
            }}
        }}
    }}
    {}
}}

{CURVATURE}pub fn curvature(x: &[f32; INPUTS], weights: &[f32; OUTPUTS], h: &mut [[f32; INPUTS]; INPUTS]) {{
    for (i, row) in h.iter_mut().enumerate() {{
        let x = along(x, i);
        let mut a = Activations::ZERO;
        forward(&x, &mut a);
        let seed = weights.map(|weight| [Dual::constant(weight)]);
        let mut t_x = [[Dual::ZERO; 1]; INPUTS];
        backward(&a, {given_dual}seed, &mut t_x);
        *row = t_x.map(|[t]| t.tangent);
    }}
}}

{ROWS}{ALONG}",
            self.predict(),
            self.result(),
        )
        .replace(
            "const ROWS: usize = 0",
            &format!(
                "const ROWS: usize = {}",
                BLOCK.min(self.plan.network.outputs())
            ),
        )
    }

    fn stateful(&self) -> String {
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

/// The outputs, to the same bits as [`predict`], and the exact derivatives of outputs and new state with
/// respect to inputs and state: `jacobian[v][r]` is d result `r` / d variable `v`. The state moves on.
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

/// Second-order terms: `h[i][j]` is the second derivative of `sum of weights[r] result_r` with respect to
/// variables `i` and `j`. The state stays. Cost: `VARIABLES` passes forward and backward on dual numbers.
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
        .replace("const ROWS: usize = 0", &format!("const ROWS: usize = {BLOCK}"))
    }
}

/// The dense layer at the end of a network, perhaps with an activation in its place.
fn seed(plan: &Plan<'_>) -> Option<usize> {
    let last = plan.network.nodes.len() - 1;
    let node = &plan.network.nodes[last];
    let dense = match node.op {
        Op::Dense(_) => last,
        Op::Activation(_) if plan.is_in_place(last) => node.from[0],
        _ => return None,
    };
    let from = plan.network.nodes[dense].from.first()?;
    // Read by others too, its adjoints would have more than one source.
    let readers = plan.network.nodes.iter().flat_map(|node| &node.from);
    let alone = readers
        .filter(|&&read| plan.buffer[read] == plan.buffer[*from])
        .count()
        == 1
        || plan.buffer[*from] != *from;
    let alone = alone && single(plan, *from);
    (matches!(plan.network.nodes[dense].op, Op::Dense(_)) && alone).then_some(dense)
}

/// Whether the values of a node's buffer are read, at their end, by one layer only.
fn single(plan: &Plan<'_>, node: usize) -> bool {
    let buffer = plan.buffer[node];
    let outside = plan
        .network
        .nodes
        .iter()
        .enumerate()
        .filter(|(place, reader)| {
            plan.buffer[*place] != buffer
                && reader.from.iter().any(|&from| plan.buffer[from] == buffer)
        });
    outside.count() == 1
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
