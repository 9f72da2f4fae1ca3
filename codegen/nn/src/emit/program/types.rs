//! The printed types and constants: windows, state, activations.

use crate::emit::forward;
use crate::emit::plan::Plan;
use crate::{Cell, Op, Window};

/// The constants of every window that moves over an input.
pub(super) fn windows(plan: &Plan<'_>) -> String {
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

/// The type of what is remembered from call to call; nothing where there is none.
pub(super) fn state(plan: &Plan<'_>) -> String {
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

/// A field of the layers' values: the layer, its name, its type and its first value.
struct Field {
    place: usize,
    name: String,
    kind: String,
    zero: String,
}

/// The fields of the layers' values, in order.
fn fields(plan: &Plan<'_>) -> Vec<Field> {
    let mut fields = Vec::new();
    for (place, node) in plan.buffers() {
        let name = &plan.names[place];
        let length = node.len();
        fields.push(Field {
            place,
            name: name.clone(),
            kind: format!("[N; {length}]"),
            zero: format!("[N::ZERO; {length}]"),
        });
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
            let (name, kind, zero) = if layer.streaming {
                (format!("{name}_step"), kind, zero)
            } else {
                let from = &plan.network.nodes[node.from[0]];
                let steps = from.len() / layer.inputs();
                (
                    format!("{name}_steps"),
                    format!("[{kind}; {steps}]"),
                    format!("[{zero}; {steps}]"),
                )
            };
            fields.push(Field {
                place,
                name,
                kind,
                zero,
            });
        }
    }
    fields
}

/// Bytes of the values and the state of each node, as expressions of the printed program.
pub(super) fn bytes(plan: &Plan<'_>) -> Vec<String> {
    let fields = fields(plan);
    let of = |place: usize| {
        let own = fields.iter().filter(|field| field.place == place);
        let mut terms: Vec<String> = own
            .map(|field| {
                let kind = field.kind.replace("[N;", "[f32;").replace("<N,", "<f32,");
                format!("size_of::<{kind}>()")
            })
            .collect();
        if let Op::Recurrent(layer) = &plan.network.nodes[place].op
            && layer.streaming
        {
            terms.push((4 * layer.units * layer.cell.vectors()).to_string());
        }
        if terms.is_empty() {
            return "0".to_string();
        }
        terms.join(" + ")
    };
    (0..plan.network.nodes.len()).map(of).collect()
}

/// The type of what the layers give.
pub(super) fn activations(plan: &Plan<'_>) -> String {
    let fields = fields(plan);
    let declared: String = fields
        .iter()
        .map(|field| format!("    {}: {},\n", field.name, field.kind))
        .collect();
    let zeros: String = fields
        .iter()
        .map(|field| format!("        {}: {},\n", field.name, field.zero))
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
