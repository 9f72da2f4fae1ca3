//! The body of `forward`: the layers in turn.

use super::plan::Plan;
use crate::literal;
use crate::{Activation, Cell, Op, PoolKind, Recurrent};

/// A call as rustfmt would lay it out, at `indent` spaces.
pub(super) fn call(indent: usize, function: &str, arguments: &[String]) -> String {
    const CALL_WIDTH: usize = 60;
    const WIDTH: usize = 100;
    let margin = " ".repeat(indent);
    let line = arguments.join(", ");
    if line.len() <= CALL_WIDTH && indent + function.len() + line.len() + 3 <= WIDTH {
        return format!("{margin}{function}({line});\n");
    }
    let lines: String = arguments
        .iter()
        .map(|a| format!("{margin}    {a},\n"))
        .collect();
    format!("{margin}{function}(\n{lines}{margin});\n")
}

/// An activation as a value of its type.
pub(super) fn activation(g: Activation) -> String {
    let float = literal::float;
    match g {
        Activation::Linear => "Linear".into(),
        Activation::Relu => "Relu".into(),
        Activation::LeakyRelu { alpha } => format!("LeakyRelu {{ alpha: {} }}", float(alpha)),
        Activation::Elu { alpha, scale } => {
            format!("Elu {{ alpha: {}, scale: {} }}", float(alpha), float(scale))
        }
        Activation::Gelu => "Gelu".into(),
        Activation::GeluTanh => "GeluTanh".into(),
        Activation::Softplus => "Softplus".into(),
        Activation::Softsign => "Softsign".into(),
        Activation::Swish => "Swish".into(),
        Activation::HardSigmoid { alpha, beta } => {
            format!(
                "HardSigmoid {{ alpha: {}, beta: {} }}",
                float(alpha),
                float(beta)
            )
        }
        Activation::Clip { low, high } => {
            format!("Clip {{ low: {}, high: {} }}", float(low), float(high))
        }
        Activation::Sigmoid => "Sigmoid".into(),
        Activation::Tanh => "Tanh".into(),
        Activation::Exponential => "Exponential".into(),
        Activation::Logarithm => "Logarithm".into(),
        Activation::Root => "Root".into(),
        Activation::Reciprocal => "Reciprocal".into(),
    }
}

/// A layer's weights as a path: `weights::DENSE_1_W`.
pub(super) fn constant(plan: &Plan<'_>, node: usize, suffix: &str) -> String {
    format!("{}{suffix}", plan.names[node].to_uppercase())
}

/// The statements.
pub(super) fn print(plan: &Plan<'_>) -> String {
    let nodes = plan.network.nodes.iter().enumerate().skip(1);
    nodes.map(|(place, _)| statement(plan, place)).collect()
}

/// The statement of one layer; nothing where it has nothing to do.
pub(super) fn statement(plan: &Plan<'_>, place: usize) -> String {
    let node = &plan.network.nodes[place];
    let from = node.from[0];
    let weights = |suffix| format!("&weights::{}", constant(plan, place, suffix));
    let window = || format!("&{}", constant(plan, place, "_WINDOW"));
    let x = plan.borrowed(from);
    let y = format!("&mut a.{}", plan.names[plan.buffer[place]]);
    let channels = plan.network.nodes[from].shape.last().copied().unwrap_or(1);
    // Named, not left as `_`: compilers before 1.89 do not infer lengths beside others.
    let (before, after) = (plan.network.nodes[from].len(), node.len());
    match &node.op {
        Op::Input => String::new(),
        Op::Dense(_) => call(4, "dense", &[weights("_W"), weights("_B"), x, y]),
        Op::Convolution(_) => call(
            4,
            "convolve",
            &[window(), weights("_W"), weights("_B"), x, y],
        ),
        Op::Pool(pool) => match pool.kind {
            PoolKind::Max => call(
                4,
                &format!("max_pool::<_, {before}, {after}, {channels}>"),
                &[window(), x, y],
            ),
            kind => {
                let padding = (kind == PoolKind::AverageWithPadding).to_string();
                let function = format!("average_pool::<_, {before}, {after}, {channels}>");
                call(4, &function, &[window(), padding, x, y])
            }
        },
        Op::Reshape(_) if plan.is_in_place(place) => String::new(),
        Op::Reshape(_) => format!("    {} = *x;\n", plan.value(place)),
        Op::Permute(axes) => {
            let (shape, steps) = permutation(axes, &plan.network.nodes[from].shape);
            call(4, "permute", &[shape, steps, x, y])
        }
        Op::Scale { .. } => call(4, "scale", &[weights("_GAIN"), weights("_OFFSET"), x, y]),
        Op::Activation(g) if plan.is_in_place(place) => call(4, "activate", &[activation(*g), y]),
        Op::Activation(Activation::Linear) if !plan.is_in_place(place) => copy(plan, place, from),
        Op::Softmax | Op::LogSoftmax if !plan.is_in_place(place) => {
            copy(plan, place, from) + &softmax(plan, place)
        }
        Op::Activation(g) => call(4, "activate_from", &[activation(*g), x, y]),
        Op::Softmax | Op::LogSoftmax => softmax(plan, place),
        Op::Add => {
            let mut text = copy(plan, place, from);
            for &other in &node.from[1..] {
                text.push_str(&call(4, "add", &[plan.borrowed(other), y.clone()]));
            }
            text
        }
        Op::Multiply => {
            let copy = copy(plan, place, from);
            copy + &call(4, "multiply", &[plan.borrowed(node.from[1]), y])
        }
        Op::Maximum | Op::Minimum => {
            let largest = node.op == Op::Maximum;
            let function = format!("extreme::<_, {after}, {largest}>");
            copy(plan, place, from) + &call(4, &function, &[plan.borrowed(node.from[1]), y])
        }
        Op::Select(_) => call(4, "select", &[weights("_PLACES"), x, y]),
        Op::Normalise { epsilon } => {
            let last = node.shape.last().copied().unwrap_or(1);
            let function = format!("normalise::<_, {after}, {last}>");
            call(4, &function, &[literal::float(*epsilon), x, y])
        }
        Op::Concatenate(axis) => concatenate(plan, place, *axis, &y),
        Op::Recurrent(layer) => recurrent(plan, place, layer, &x),
    }
}

fn copy(plan: &Plan<'_>, place: usize, from: usize) -> String {
    let x = match plan.buffer[from] {
        0 => "*x".into(),
        _ => plan.value(from),
    };
    format!("    {} = {x};\n", plan.value(place))
}

/// A softmax, or its logarithm, in place.
fn softmax(plan: &Plan<'_>, place: usize) -> String {
    let node = &plan.network.nodes[place];
    let (all, last) = (node.len(), node.shape.last().copied().unwrap_or(1));
    let y = format!("&mut {}", plan.value(place));
    let kernel = node.op.kind();
    call(4, &format!("{kernel}::<_, {all}, {last}>"), &[y])
}

/// Shape of the result and steps in what is read, both of three axes.
fn permutation(axes: &[usize], from: &[usize]) -> (String, String) {
    let stride = |axis: usize| from[axis + 1..].iter().product::<usize>();
    let ones = 3 - axes.len();
    let shape = std::iter::repeat_n(1, ones).chain(axes.iter().map(|&axis| from[axis]));
    let steps = std::iter::repeat_n(0, ones).chain(axes.iter().map(|&axis| stride(axis)));
    let list = |values: Vec<usize>| literal::list(values.iter().map(ToString::to_string));
    (list(shape.collect()), list(steps.collect()))
}

/// The inverse of an order of axes.
pub(super) fn inverse_permutation(axes: &[usize], to: &[usize]) -> (String, String) {
    let mut inverse = vec![0; axes.len()];
    for (place, &axis) in axes.iter().enumerate() {
        inverse[axis] = place;
    }
    permutation(&inverse, to)
}

/// For each part of a concatenation: its node, where its run begins, and how long runs are.
pub(super) fn parts(plan: &Plan<'_>, place: usize, axis: usize) -> Vec<(usize, usize, usize)> {
    let mut start = 0;
    let node = &plan.network.nodes[place];
    let part = |&from: &usize| {
        let length: usize = plan.network.nodes[from].shape[axis..].iter().product();
        start += length;
        (from, start - length, length)
    };
    node.from.iter().map(part).collect()
}

fn concatenate(plan: &Plan<'_>, place: usize, axis: usize, y: &str) -> String {
    let total: usize = plan.network.nodes[place].shape[axis..].iter().product();
    parts(plan, place, axis)
        .into_iter()
        .map(|(from, start, length)| {
            let nodes = &plan.network.nodes;
            let (part, all) = (nodes[from].len(), nodes[place].len());
            let function = format!("concatenate::<_, {part}, {all}, {length}, {total}>");
            call(
                4,
                &function,
                &[start.to_string(), plan.borrowed(from), y.into()],
            )
        })
        .collect()
}

/// The module of a recurrent layer's kernel, and the arguments before the input.
pub(super) fn cell(
    plan: &Plan<'_>,
    place: usize,
    layer: &Recurrent,
) -> (&'static str, Vec<String>) {
    let weights = format!("&weights::{}", constant(plan, place, ""));
    match layer.cell {
        Cell::Simple { activation: g } => ("rnn", vec![weights, activation(g)]),
        Cell::Gru {
            activation: g,
            gates,
            ..
        } => ("gru", vec![weights, activation(gates), activation(g)]),
        Cell::Lstm {
            activation: g,
            gates,
        } => ("lstm", vec![weights, activation(gates), activation(g)]),
    }
}

fn recurrent(plan: &Plan<'_>, place: usize, layer: &Recurrent, x: &str) -> String {
    let name = &plan.names[place];
    let (module, mut arguments) = cell(plan, place, layer);
    let two = layer.cell.vectors() == 2;
    if layer.streaming {
        let state = if two {
            format!("(&state.{name}, &state.{name}_cell)")
        } else {
            format!("&state.{name}")
        };
        arguments.extend([x.into(), state, format!("&mut a.{name}_step")]);
        return call(4, &format!("{module}::step"), &arguments)
            + &format!("    a.{name} = a.{name}_step.state;\n");
    }
    let (inputs, units) = (layer.inputs(), layer.units);
    let rest = format!("[N::ZERO; {units}]");
    let mut text = if two {
        format!("    let (mut h, mut c) = ({rest}, {rest});\n")
    } else {
        format!("    let mut h = {rest};\n")
    };
    let x = x.trim_start_matches('&');
    let mut items = format!("{x}.chunks_exact({inputs}).zip(&mut a.{name}_steps)");
    let mut pattern = "(x, step)".to_string();
    if layer.sequences {
        items = format!("{items}.zip(outputs)");
        pattern = format!("({pattern}, y)");
        text.push_str(&format!(
            "    let outputs = a.{name}.chunks_exact_mut({units});\n"
        ));
    }
    text.push_str(&format!(
        "    let steps = {items};\n    for {pattern} in steps {{\n        \
         let Some(x) = x.first_chunk() else {{ continue }};\n"
    ));
    let state = if two { "(&h, &c)" } else { "&h" };
    arguments.extend(["x".into(), state.into(), "step".into()]);
    text.push_str(&call(8, &format!("{module}::step"), &arguments));
    text.push_str(if two {
        "        (h, c) = (step.state, step.cell);\n"
    } else {
        "        h = step.state;\n"
    });
    if layer.sequences {
        text.push_str("        y.copy_from_slice(&h);\n    }\n");
    } else {
        text.push_str(&format!("    }}\n    a.{name} = h;\n"));
    }
    text
}
