//! Selection of the kernels that a network needs, and their files.

use std::collections::BTreeSet;

use super::plan::Plan;
use super::{Accuracy, File, file};
use crate::{Activation, Cell, Op};

macro_rules! kernel {
    ($path:literal) => {
        ($path, include_str!(concat!("../../kernels/", $path)))
    };
}

/// Every file, by its path in `codegen/nn/kernels` and in the printed crate.
const FILES: &[(&str, &str)] = &[
    kernel!("number.rs"),
    kernel!("math/coarse.rs"),
    kernel!("math/exponential.rs"),
    kernel!("math/precise.rs"),
    kernel!("math/root.rs"),
    kernel!("math/rough.rs"),
    kernel!("math/rougher.rs"),
    kernel!("layers/activation/clip.rs"),
    kernel!("layers/activation/elu.rs"),
    kernel!("layers/activation/exponential.rs"),
    kernel!("layers/activation/gelu.rs"),
    kernel!("layers/activation/hard_sigmoid.rs"),
    kernel!("layers/activation/leaky_relu.rs"),
    kernel!("layers/activation/linear.rs"),
    kernel!("layers/activation/logarithm.rs"),
    kernel!("layers/activation/reciprocal.rs"),
    kernel!("layers/activation/relu.rs"),
    kernel!("layers/activation/root.rs"),
    kernel!("layers/activation/sigmoid.rs"),
    kernel!("layers/activation/softplus.rs"),
    kernel!("layers/activation/softsign.rs"),
    kernel!("layers/activation/swish.rs"),
    kernel!("layers/activation/tanh.rs"),
    kernel!("layers/along.rs"),
    kernel!("layers/arithmetic.rs"),
    kernel!("layers/convolution.rs"),
    kernel!("layers/dense.rs"),
    kernel!("layers/elementwise.rs"),
    kernel!("layers/extreme.rs"),
    kernel!("layers/gate.rs"),
    kernel!("layers/gru.rs"),
    kernel!("layers/log_softmax.rs"),
    kernel!("layers/lstm.rs"),
    kernel!("layers/normalisation.rs"),
    kernel!("layers/pooling.rs"),
    kernel!("layers/rectified.rs"),
    kernel!("layers/rnn.rs"),
    kernel!("layers/rows.rs"),
    kernel!("layers/selection.rs"),
    kernel!("layers/softmax.rs"),
    kernel!("layers/window.rs"),
    kernel!("math/activation.rs"),
];

/// Items that `network.rs` may name, by module.
pub(super) const ITEMS: &[(&str, &[&str])] = &[
    (
        "layers::activation",
        &[
            "Clip",
            "Elu",
            "Exponential",
            "Gelu",
            "GeluTanh",
            "HardSigmoid",
            "LeakyRelu",
            "Linear",
            "Logarithm",
            "Reciprocal",
            "Relu",
            "Root",
            "Sigmoid",
            "Softplus",
            "Softsign",
            "Swish",
            "Tanh",
        ],
    ),
    (
        "layers::arithmetic",
        &[
            "add",
            "add_back",
            "concatenate",
            "concatenate_back",
            "multiply",
            "multiply_back",
            "permute",
            "scale",
            "scale_back",
            "weighed",
        ],
    ),
    ("layers::convolution", &["convolve", "convolve_back"]),
    (
        "layers::dense",
        &[
            "dense",
            "dense_back",
            "dense_back_activated",
            "dense_seed",
            "dense_seed_activated",
        ],
    ),
    (
        "layers::elementwise",
        &["activate", "activate_back", "activate_from", "slopes"],
    ),
    ("layers::extreme", &["extreme", "extreme_back"]),
    ("layers::log_softmax", &["log_softmax", "log_softmax_back"]),
    ("layers::normalisation", &["normalise", "normalise_back"]),
    (
        "layers::pooling",
        &[
            "average_pool",
            "average_pool_back",
            "max_pool",
            "max_pool_back",
        ],
    ),
    ("layers::rectified", &["rectified_back"]),
    ("layers::selection", &["select", "select_back"]),
    ("layers::softmax", &["softmax", "softmax_back"]),
    ("layers::window", &["Window"]),
    ("number", &["Dual", "Number"]),
];

/// The kernels' files, and those that name them.
pub(super) fn files(plan: &Plan<'_>, accuracy: Accuracy, rectified: bool) -> Vec<File> {
    let (mut layers, mut activations) = (BTreeSet::new(), BTreeSet::new());
    for node in &plan.network.nodes {
        layers.extend(modules(&node.op));
        match &node.op {
            Op::Activation(g) => activations.extend(names(*g)),
            Op::Recurrent(layer) => {
                for g in layer.cell.activations() {
                    activations.extend(names(g));
                }
            }
            _ => {}
        }
    }
    // The derivative of a value that several layers read is a sum, and so is that of a state.
    let readers = |place: usize| {
        plan.network
            .nodes
            .iter()
            .flat_map(|node| &node.from)
            .filter(|&&from| plan.buffer[from] == place)
            .count()
    };
    if (0..plan.network.nodes.len()).any(|place| readers(place) > 1) {
        layers.insert("arithmetic");
    }
    if rectified {
        layers.insert("rectified");
    }
    // Dense is the seed of derivatives with an activation, and names its trait.
    if layers.contains("dense") || !activations.is_empty() {
        layers.insert("elementwise");
    }
    if !activations.is_empty() {
        layers.insert("activation");
    }
    let exponential = layers.contains("softmax")
        || layers.contains("log_softmax")
        || accuracy == Accuracy::Precise
        || activations.iter().any(|(module, _)| {
            matches!(
                *module,
                "elu" | "exponential" | "gelu" | "logarithm" | "softplus"
            )
        });
    let root =
        layers.contains("normalisation") || activations.iter().any(|(module, _)| *module == "root");
    let mut files = vec![
        copy("number.rs"),
        file("src/math.rs", math(accuracy, exponential, root)),
        copy("math/activation.rs"),
        file("src/layers.rs", module_list(&layers)),
    ];
    if exponential {
        files.push(copy("math/exponential.rs"));
    }
    if root {
        files.push(copy("math/root.rs"));
    }
    if let Some(module) = accuracy.module() {
        files.push(copy(&format!("math/{module}.rs")));
    }
    for layer in layers.iter().filter(|layer| **layer != "activation") {
        files.push(copy(&format!("layers/{layer}.rs")));
    }
    if !activations.is_empty() {
        files.push(file(
            "src/layers/activation.rs",
            activation_list(&activations),
        ));
        let modules: BTreeSet<&str> = activations.iter().map(|(module, _)| *module).collect();
        files.extend(
            modules
                .iter()
                .map(|module| copy(&format!("layers/activation/{module}.rs"))),
        );
    }
    files
}

/// The kernels of a predictor that begins with a recurrent layer; its mathematics is the
/// firmware's.
pub fn of_predictor(cell: Cell) -> Vec<File> {
    let cell = match cell {
        Cell::Simple { .. } => "rnn",
        Cell::Gru { .. } => "gru",
        Cell::Lstm { .. } => "lstm",
    };
    let layers = BTreeSet::from([
        "activation",
        "along",
        "dense",
        "elementwise",
        "gate",
        cell,
        "rows",
    ]);
    let activations = BTreeSet::from([("sigmoid", "Sigmoid"), ("tanh", "Tanh")]);
    let mut files = vec![
        copy("number.rs"),
        file("src/layers.rs", module_list(&layers)),
        file("src/layers/activation.rs", activation_list(&activations)),
        copy("layers/activation/sigmoid.rs"),
        copy("layers/activation/tanh.rs"),
    ];
    let layers = layers.iter().filter(|layer| **layer != "activation");
    files.extend(layers.map(|layer| copy(&format!("layers/{layer}.rs"))));
    files
}

fn copy(path: &str) -> File {
    let found = FILES.iter().find(|(name, _)| *name == path);
    file(
        &format!("src/{path}"),
        found.map_or("", |(_, text)| text).into(),
    )
}

fn math(accuracy: Accuracy, exponential: bool, root: bool) -> String {
    let mut text = String::from(
        "//! The only home of transcendental functions. They use `+ - * /`, comparisons and shifts of an exponent,
//! each rounded once, so that every machine gives the same bits.

",
    );
    // The quick tanh stands beside the chosen one, for whoever wants it.
    let chosen = accuracy.module();
    let public = if chosen.is_some() { "pub " } else { "" };
    let mut modules = vec![("activation", public)];
    modules.extend(exponential.then_some(("exponential", "")));
    modules.extend(root.then_some(("root", "")));
    modules.extend(chosen.map(|module| (module, "")));
    modules.sort_unstable();
    for (module, public) in modules {
        text.push_str(&format!("{public}mod {module};\n"));
    }
    text.push('\n');
    let mut uses = vec![match chosen {
        None => "activation::*".to_string(),
        Some(_) => "activation::{clamp, relu}".to_string(),
    }];
    uses.extend(exponential.then(|| "exponential::{erf, exp, ln, ln_1p}".to_string()));
    uses.extend(root.then(|| "root::{reciprocal_root, root}".to_string()));
    uses.extend(chosen.map(|module| format!("{module}::{{sigmoid, tanh}}")));
    uses.sort_unstable();
    for path in uses {
        text.push_str(&format!("pub use {path};\n"));
    }
    text
}

fn module_list(layers: &BTreeSet<&str>) -> String {
    let modules: String = layers
        .iter()
        .map(|layer| format!("pub mod {layer};\n"))
        .collect();
    format!("//! One kind of layer a file.\n\n{modules}")
}

fn activation_list(activations: &BTreeSet<(&str, &str)>) -> String {
    let modules: BTreeSet<&str> = activations.iter().map(|(module, _)| *module).collect();
    let declared: String = modules
        .iter()
        .map(|module| format!("mod {module};\n"))
        .collect();
    let used: String = modules
        .iter()
        .map(|module| {
            let types: Vec<&str> = activations
                .iter()
                .filter(|(m, _)| m == module)
                .map(|(_, t)| *t)
                .collect();
            match types.as_slice() {
                [one] => format!("pub use {module}::{one};\n"),
                _ => format!("pub use {module}::{{{}}};\n", types.join(", ")),
            }
        })
        .collect();
    format!("//! Activations, element by element.\n\n{declared}\n{used}")
}

/// Modules of `layers` that a layer needs.
fn modules(op: &Op) -> &'static [&'static str] {
    match op {
        Op::Input | Op::Reshape(_) => &[],
        Op::Dense(_) => &["dense", "rows"],
        Op::Convolution(_) => &["convolution", "dense", "rows", "window"],
        Op::Pool(_) => &["pooling", "window"],
        Op::Permute(_) | Op::Scale { .. } | Op::Add | Op::Multiply | Op::Concatenate(_) => {
            &["arithmetic"]
        }
        Op::Select(_) => &["selection"],
        Op::Normalise { .. } => &["normalisation"],
        Op::Activation(_) => &["elementwise"],
        Op::Softmax => &["softmax"],
        Op::LogSoftmax => &["log_softmax"],
        Op::Maximum | Op::Minimum => &["extreme"],
        Op::Recurrent(layer) => match layer.cell {
            Cell::Simple { .. } => &["arithmetic", "dense", "elementwise", "gate", "rnn", "rows"],
            Cell::Gru { .. } => &[
                "along",
                "arithmetic",
                "dense",
                "elementwise",
                "gate",
                "gru",
                "rows",
            ],
            Cell::Lstm { .. } => &[
                "along",
                "arithmetic",
                "dense",
                "elementwise",
                "gate",
                "lstm",
                "rows",
            ],
        },
    }
}

/// Module and type of an activation, and of those that it is made of.
fn names(g: Activation) -> &'static [(&'static str, &'static str)] {
    match g {
        Activation::Linear => &[("linear", "Linear")],
        Activation::Relu => &[("relu", "Relu")],
        Activation::LeakyRelu { .. } => &[("leaky_relu", "LeakyRelu")],
        Activation::Elu { .. } => &[("elu", "Elu")],
        Activation::Gelu => &[("gelu", "Gelu"), ("gelu", "GeluTanh")],
        Activation::GeluTanh => &[("gelu", "Gelu"), ("gelu", "GeluTanh")],
        Activation::Softplus => &[("softplus", "Softplus"), ("sigmoid", "Sigmoid")],
        Activation::Softsign => &[("softsign", "Softsign")],
        Activation::Swish => &[("swish", "Swish"), ("sigmoid", "Sigmoid")],
        Activation::HardSigmoid { .. } => &[("hard_sigmoid", "HardSigmoid")],
        Activation::Clip { .. } => &[("clip", "Clip")],
        Activation::Sigmoid => &[("sigmoid", "Sigmoid")],
        Activation::Tanh => &[("tanh", "Tanh")],
        Activation::Exponential => &[("exponential", "Exponential")],
        Activation::Logarithm => &[("logarithm", "Logarithm")],
        Activation::Root => &[("root", "Root")],
        Activation::Reciprocal => &[("reciprocal", "Reciprocal")],
    }
}
