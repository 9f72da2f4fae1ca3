//! The printed `src/weights.rs`: numbers that lie in flash.

use super::HEADER;
use super::forward::constant;
use super::plan::Plan;
use crate::emit::rust;
use crate::network::{Cell, Node, Op, Recurrent};

pub(super) fn print(plan: &Plan<'_>) -> String {
    let mut text = String::new();
    let mut used = std::collections::BTreeSet::new();
    for (place, node) in plan.network.nodes.iter().enumerate() {
        let from = node.from.first().map(|&from| &plan.network.nodes[from]);
        let item = |suffix: &str, doc: &str, kind: String, value: String| {
            let name = constant(plan, place, suffix);
            format!("\n/// {doc}\n#[rustfmt::skip]\npub static {name}: {kind} = {value};\n")
        };
        let name = &node.name.replace('`', "'");
        match &node.op {
            Op::Dense(layer) => {
                let (inputs, outputs) = (from.map_or(0, Node::len), node.len());
                let kind = format!("[[f32; {inputs}]; {outputs}]");
                let doc = format!("Layer `{name}`, a row for each output.");
                text += &item(
                    "_W",
                    &doc,
                    kind,
                    nested(&layer.weights, &[outputs, inputs], 0),
                );
                text += &item(
                    "_B",
                    &format!("Layer `{name}`, bias."),
                    format!("[f32; {outputs}]"),
                    nested(&layer.bias, &[outputs], 0),
                );
            }
            Op::Convolution(layer) => {
                let [rows, columns] = layer.window.size;
                let filters = layer.bias.len();
                let channels = layer.weights.len() / (filters * rows * columns);
                let kind = format!("[[[[f32; {channels}]; {columns}]; {rows}]; {filters}]");
                let doc = format!("Layer `{name}`: filters, rows, columns, channels.");
                text += &item(
                    "_W",
                    &doc,
                    kind,
                    nested(&layer.weights, &[filters, rows, columns, channels], 0),
                );
                text += &item(
                    "_B",
                    &format!("Layer `{name}`, bias."),
                    format!("[f32; {filters}]"),
                    nested(&layer.bias, &[filters], 0),
                );
            }
            Op::Scale { gain, offset } => {
                let kind = format!("[f32; {}]", gain.len());
                text += &item(
                    "_GAIN",
                    &format!("Layer `{name}`, gain."),
                    kind.clone(),
                    nested(gain, &[gain.len()], 0),
                );
                text += &item(
                    "_OFFSET",
                    &format!("Layer `{name}`, offset."),
                    kind,
                    nested(offset, &[offset.len()], 0),
                );
            }
            Op::Recurrent(layer) => {
                let (kind, value) = recurrent(layer);
                used.insert(kind.clone());
                let kind = format!("{kind}<{}, {}>", layer.inputs(), layer.units);
                text += &item("", &format!("Layer `{name}`."), kind, value);
            }
            _ => {}
        }
    }
    let uses: String = used
        .iter()
        .map(|kind| format!("use crate::layers::{}::{kind};\n", kind.to_lowercase()))
        .collect();
    let uses = if uses.is_empty() {
        uses
    } else {
        format!("\n{uses}")
    };
    format!("//! Weights and biases.\n//!\n//! {HEADER}\n{uses}{text}")
}

fn recurrent(layer: &Recurrent) -> (String, String) {
    let (units, inputs) = (layer.units, layer.inputs());
    let gates = layer.cell.gates();
    let shapes: [Vec<usize>; 3] = match layer.cell {
        Cell::Simple { .. } => [vec![units, inputs], vec![units, units], vec![units]],
        _ => [
            vec![gates, units, inputs],
            vec![gates, units, units],
            vec![gates, units],
        ],
    };
    let mut value = String::from("");
    for (name, values, shape) in [
        ("kernel", &layer.kernel, &shapes[0]),
        ("recurrent", &layer.recurrent, &shapes[1]),
        ("bias", &layer.bias, &shapes[2]),
    ] {
        value.push_str(&format!("    {name}: {},\n", nested(values, shape, 4)));
    }
    let kind = match layer.cell {
        Cell::Simple { .. } => "Rnn",
        Cell::Lstm { .. } => "Lstm",
        Cell::Gru { reset_after, .. } => {
            let inner = if reset_after {
                layer.inner_bias.clone()
            } else {
                vec![0.0; units]
            };
            value.push_str(&format!(
                "    inner_bias: {},\n",
                nested(&inner, &[units], 4)
            ));
            value.push_str(&format!("    reset_after: {reset_after},\n"));
            "Gru"
        }
    };
    (kind.into(), format!("{kind} {{\n{value}}}"))
}

/// Numbers as an array of arrays, at `indent` spaces.
fn nested(values: &[f32], shape: &[usize], indent: usize) -> String {
    match shape {
        [] => String::new(),
        [_] => rust::block(values.iter().copied().map(rust::float), indent, 12),
        [count, inner @ ..] => {
            let margin = " ".repeat(indent + 4);
            let rows: String = values
                .chunks(values.len() / count)
                .map(|row| format!("{margin}{},\n", nested(row, inner, indent + 4)))
                .collect();
            format!("[\n{rows}{}]", " ".repeat(indent))
        }
    }
}
