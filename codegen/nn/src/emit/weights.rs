//! The printed `src/weights.rs`: numbers that lie in flash.

use super::forward::constant;
use super::plan::Plan;
use super::{HEADER, Weights};
use crate::literal;
use crate::{Cell, Node, Op, Recurrent, quantise};

pub(super) fn print(plan: &Plan<'_>, weights: Weights) -> String {
    let mut text = String::new();
    let mut used = std::collections::BTreeSet::new();
    for (place, node) in plan.network.nodes.iter().enumerate() {
        let from = node.from.first().map(|&from| &plan.network.nodes[from]);
        let mut item = |suffix: &str, doc: &str, kind: String, value: String| {
            let name = constant(plan, place, suffix);
            text +=
                &format!("\n/// {doc}\n#[rustfmt::skip]\npub static {name}: {kind} = {value};\n");
        };
        let vector = |values: &[f32]| {
            let kind = format!("[f32; {}]", values.len());
            (kind, nested(values, &[values.len()], 0, literal::float))
        };
        let name = &node.name.replace('`', "'");
        let (matrix, shape, bias) = match &node.op {
            Op::Dense(layer) => {
                let shape = vec![node.len(), from.map_or(0, Node::len)];
                (&layer.weights, shape, &layer.bias)
            }
            Op::Convolution(layer) => {
                let [rows, columns] = layer.window.size;
                let filters = layer.bias.len();
                let channels = layer.weights.len() / (filters * rows * columns);
                let shape = vec![filters, rows, columns, channels];
                (&layer.weights, shape, &layer.bias)
            }
            Op::Scale { gain, offset } => {
                for (suffix, what, values) in
                    [("_GAIN", "gain", gain), ("_OFFSET", "offset", offset)]
                {
                    let (kind, value) = vector(values);
                    item(suffix, &format!("Layer `{name}`, {what}."), kind, value);
                }
                continue;
            }
            Op::Select(selection) => {
                // The largest is the place of no value.
                let number = |place: &Option<usize>| place.map_or(u16::MAX, |place| place as u16);
                let places: Vec<u16> = selection.places.iter().map(number).collect();
                let kind = format!("[u16; {}]", places.len());
                let value = nested(&places, &[places.len()], 0, |place| place.to_string());
                item("_PLACES", &format!("Layer `{name}`, places."), kind, value);
                continue;
            }
            Op::Recurrent(layer) => {
                let (own, kind, value) = recurrent(layer, weights);
                used.insert(format!("{}::{own}", own.to_lowercase()));
                item("", &format!("Layer `{name}`."), kind, value);
                continue;
            }
            _ => continue,
        };
        let axes = match node.op {
            Op::Dense(_) => ", a row for each output.",
            _ => ": filters, rows, columns, channels.",
        };
        let (kind, value) = rows(matrix, &shape, weights, 0);
        item("_W", &format!("Layer `{name}`{axes}"), kind, value);
        let (kind, value) = vector(bias);
        item("_B", &format!("Layer `{name}`, bias."), kind, value);
    }
    if text.contains("Int8 {") {
        used.insert("rows::Int8".into());
    }
    let uses: String = used
        .iter()
        .map(|path| format!("use crate::layers::{path};\n"))
        .collect();
    let uses = if uses.is_empty() {
        uses
    } else {
        format!("\n{uses}")
    };
    format!("//! Weights and biases.\n//!\n//! {HEADER}\n{uses}{text}")
}

/// Type and value of a matrix at `indent` spaces; the first axis of the shape counts its rows.
fn rows(values: &[f32], shape: &[usize], weights: Weights, indent: usize) -> (String, String) {
    let kind = |number: &str| {
        let inner = shape.iter().skip(1).rev();
        inner.fold(number.to_string(), |kind, length| {
            format!("[{kind}; {length}]")
        })
    };
    let count = shape.first().copied().unwrap_or(1);
    if weights == Weights::Float32 {
        let kind = format!("[{}; {count}]", kind("f32"));
        return (kind, nested(values, shape, indent, literal::float));
    }
    let rows = values.chunks(values.len() / count).map(quantise::row);
    let (integers, scales): (Vec<Vec<i8>>, Vec<f32>) = rows.unzip();
    let margin = " ".repeat(indent);
    let value = format!(
        "Int8 {{\n{margin}    rows: {},\n{margin}    scale: {},\n{margin}}}",
        nested(&integers.concat(), shape, indent + 4, |q| q.to_string()),
        nested(&scales, &[count], indent + 4, literal::float),
    );
    (format!("Int8<{}, {count}>", kind("i8")), value)
}

/// Name of a recurrent layer's type, the type and the value.
pub fn recurrent(layer: &Recurrent, weights: Weights) -> (&'static str, String, String) {
    let (units, inputs) = (layer.units, layer.inputs());
    let gates = layer.cell.gates();
    let single = matches!(layer.cell, Cell::Simple { .. });
    let mut value = String::new();
    let mut kinds = Vec::new();
    for (name, values, length) in [
        ("kernel", &layer.kernel, inputs),
        ("recurrent", &layer.recurrent, units),
    ] {
        let indent = if single { 4 } else { 8 };
        let gate = |values| rows(values, &[units, length], weights, indent);
        let matrices: Vec<(String, String)> = values.chunks(units * length).map(gate).collect();
        kinds.push(matrices[0].0.clone());
        let list: String = matrices
            .iter()
            .map(|(_, value)| format!("        {value},\n"))
            .collect();
        value += &match matrices.as_slice() {
            [(_, one)] if single => format!("    {name}: {one},\n"),
            _ => format!("    {name}: [\n{list}    ],\n"),
        };
    }
    let shape = if single {
        vec![units]
    } else {
        vec![gates, units]
    };
    let bias = nested(&layer.bias, &shape, 4, literal::float);
    value += &format!("    bias: {bias},\n");
    let own = match layer.cell {
        Cell::Simple { .. } => "Rnn",
        Cell::Lstm { .. } => "Lstm",
        Cell::Gru { reset_after, .. } => {
            let inner = if reset_after {
                layer.inner_bias.clone()
            } else {
                vec![0.0; units]
            };
            let inner = nested(&inner, &[units], 4, literal::float);
            value += &format!("    inner_bias: {inner},\n    reset_after: {reset_after},\n");
            "Gru"
        }
    };
    let kind = format!("{own}<{}, {units}>", kinds.join(", "));
    (own, kind, format!("{own} {{\n{value}}}"))
}

/// Numbers as an array of arrays, at `indent` spaces.
fn nested<T: Copy>(values: &[T], shape: &[usize], indent: usize, print: fn(T) -> String) -> String {
    match shape {
        [] => String::new(),
        [_] => literal::block(values.iter().copied().map(print), indent, 12),
        [count, inner @ ..] => {
            let margin = " ".repeat(indent + 4);
            let rows: String = values
                .chunks(values.len() / count)
                .map(|row| format!("{margin}{},\n", nested(row, inner, indent + 4, print)))
                .collect();
            format!("[\n{rows}{}]", " ".repeat(indent))
        }
    }
}
