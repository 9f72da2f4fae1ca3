//! A network as a table: layers, shapes, parameters.

use super::{Activation, Cell, Network, Op, PoolKind};

/// One line a layer, under a heading and above the totals.
#[must_use]
pub fn table(network: &Network) -> String {
    let mut rows: Vec<[String; 4]> =
        vec![["layer", "kind", "output", "parameters"].map(String::from)];
    for node in &network.nodes {
        let mut kind = describe(&node.op);
        if node.from.len() > 1 {
            let names: Vec<&str> = node
                .from
                .iter()
                .map(|&from| network.nodes[from].name.as_str())
                .collect();
            kind = format!("{kind} of {}", names.join(", "));
        }
        let parameters = node.op.parameters();
        let count = if parameters == 0 {
            String::new()
        } else {
            thousands(parameters)
        };
        rows.push([node.name.clone(), kind, shape(&node.shape), count]);
    }
    let width = |column: usize| {
        rows.iter()
            .map(|row| row[column].chars().count())
            .max()
            .unwrap_or(0)
    };
    let widths = [width(0), width(1), width(2), width(3)];
    let mut text = String::new();
    for (index, [name, kind, shape, count]) in rows.iter().enumerate() {
        let [a, b, c, d] = widths;
        let line = format!("{name:<a$}  {kind:<b$}  {shape:<c$}  {count:>d$}");
        text.push_str(line.trim_end());
        text.push('\n');
        if index == 0 {
            text.push_str(&format!("{}\n", "-".repeat(a + b + c + d + 6)));
        }
    }
    text.push_str(&format!(
        "\n{} parameters, {} in, {} out",
        thousands(network.parameters()),
        network.inputs(),
        network.outputs()
    ));
    if network.state() > 0 {
        text.push_str(&format!(", {} kept between calls", network.state()));
    }
    text.push('\n');
    text
}

/// Axes as `8 x 8 x 3`.
pub(crate) fn shape(axes: &[usize]) -> String {
    let axes: Vec<String> = axes.iter().map(ToString::to_string).collect();
    axes.join(" x ")
}

/// A layer in a few words.
#[must_use]
pub fn describe(op: &Op) -> String {
    let windowed = |window: &super::Window| {
        let pair = |[a, b]: [usize; 2]| {
            if window.size[0] == 1 {
                b.to_string()
            } else {
                format!("{a}x{b}")
            }
        };
        let mut text = pair(window.size);
        if window.stride != [1; 2] {
            text += &format!(", stride {}", pair(window.stride));
        }
        if window.dilation != [1; 2] {
            text += &format!(", dilation {}", pair(window.dilation));
        }
        if window.before != [0; 2] || window.after != [0; 2] {
            text += ", padded";
        }
        text
    };
    match op {
        Op::Convolution(layer) => format!("{} {}", op.kind(), windowed(&layer.window)),
        Op::Pool(pool) => {
            let zeros = if pool.kind == PoolKind::AverageWithPadding {
                ", zeros counted"
            } else {
                ""
            };
            format!("{} {}{zeros}", op.kind(), windowed(&pool.window))
        }
        Op::Permute(axes) => format!("permute {axes:?}"),
        Op::Activation(g) => activation(*g),
        Op::Concatenate(axis) => format!("concatenate, axis {axis},"),
        Op::Recurrent(layer) => {
            let names: Vec<String> = layer
                .cell
                .activations()
                .into_iter()
                .map(activation)
                .collect();
            let mut text = format!("{} {}", op.kind(), names.join(" "));
            if let Cell::Gru {
                reset_after: false, ..
            } = layer.cell
            {
                text += ", reset before";
            }
            text += if layer.streaming {
                ", one step a call"
            } else {
                ""
            };
            text += if layer.sequences { ", sequences" } else { "" };
            text
        }
        _ => op.kind().into(),
    }
}

fn activation(g: Activation) -> String {
    match g {
        Activation::LeakyRelu { alpha } => format!("leaky_relu {alpha}"),
        Activation::SELU => "selu".into(),
        Activation::Elu { alpha, .. } => format!("elu {alpha}"),
        Activation::HardSigmoid { alpha, beta } => format!("hard_sigmoid {alpha} {beta}"),
        Activation::Clip { low, high } => format!("clip {low} {high}"),
        Activation::GeluTanh => "gelu (tanh)".into(),
        other => format!("{other:?}").to_lowercase(),
    }
}

/// `12,345`.
pub(crate) fn thousands(n: usize) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
