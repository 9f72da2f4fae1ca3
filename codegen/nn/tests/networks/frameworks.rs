//! The networks of the frameworks (tests/frameworks/make.py), with the frameworks' own outputs.

use std::fs;
use std::path::{Path, PathBuf};

use safetensors::SafeTensors;
use sinew_nn::emit::Options;
use sinew_nn::{Activation, Cell, Golden, Network, Op, import};

use super::bench::Case;
use super::judge::{Errors, range, worst};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/frameworks/models")
}

/// Every file, by name.
pub fn files() -> Vec<PathBuf> {
    let entries = fs::read_dir(folder()).expect("the folder is committed");
    let paths = entries.map(|entry| entry.expect("the folder can be read").path());
    let mut files: Vec<PathBuf> = paths
        .filter(|path| path.extension().is_some_and(|e| e != "safetensors"))
        .collect();
    files.sort();
    files
}

/// A file read, its golden vectors with it, which [`Network::validate`] compares.
pub fn network(path: &Path) -> Network {
    let mut network =
        import::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let bytes = fs::read(path.with_extension("golden.safetensors")).expect("the file is committed");
    let file = SafeTensors::deserialize(&bytes).expect("golden vectors are a safetensors file");
    let (x, y) = (file.tensor("x").expect("x"), file.tensor("y").expect("y"));
    let rows = x.shape()[0];
    let floats: Vec<f32> = x
        .data()
        .as_chunks()
        .0
        .iter()
        .map(|b| f32::from_le_bytes(*b))
        .collect();
    let doubles: Vec<f64> = y
        .data()
        .as_chunks()
        .0
        .iter()
        .map(|b| f64::from_le_bytes(*b))
        .collect();
    let pairs = floats
        .chunks(floats.len() / rows)
        .zip(doubles.chunks(doubles.len() / rows));
    network.golden = pairs
        .map(|(x, y)| Golden {
            x: x.into(),
            y: y.into(),
        })
        .collect();
    network
        .validate()
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    network
}

pub fn cases() -> Vec<Case> {
    let case = |path: &PathBuf| {
        let network = network(path);
        let inputs = network
            .golden
            .iter()
            .map(|golden| golden.x.clone())
            .collect();
        let curvature = network.inputs() + network.state() <= 24;
        Case {
            network,
            options: Options::default(),
            inputs,
            curvature,
            in_qemu: true,
        }
    };
    files().iter().map(case).collect()
}

/// Holds what the programs gave against the frameworks, and keeps the table of the documentation:
/// rewritten where SINEW_SNAPSHOTS is `bless`, otherwise held to name every network (instructions
/// change with the compiler).
pub fn judge(cases: &[Case], errors: &[Errors]) {
    assert!(cases.len() >= 28, "{} networks", cases.len());
    let mut table = String::from(HEAD);
    for (case, errors) in cases.iter().zip(errors) {
        let golden: Vec<Vec<f64>> = case.network.golden.iter().map(|g| g.y.clone()).collect();
        let range = range(&golden);
        let mut error = 0.0_f64;
        for (found, expected) in errors.said.y.iter().flatten().zip(golden.iter().flatten()) {
            error = worst(error, (f64::from(*found) - expected) / range);
        }
        let cost = |name: &str| {
            let cost = errors.said.cost.get(name);
            cost.map_or("not in QEMU".into(), |cost| cost.0.to_string())
        };
        table += &format!(
            "| {} | {} | {error:.1e} | {:.1e} | {} | {} |\n",
            errors.name,
            case.network.parameters(),
            errors.jacobian,
            cost("predict"),
            cost("jacobian")
        );
        assert!(
            error < 1e-5,
            "{}: {error:e} of the range away from its framework",
            errors.name
        );
    }
    println!("{table}");
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/evaluation/networks-table.md");
    if std::env::var("SINEW_SNAPSHOTS").is_ok_and(|mode| mode == "bless") {
        fs::write(&path, &table).expect("docs can be written");
    }
    let kept = fs::read_to_string(&path).expect("the table is committed");
    for case in cases {
        let row = format!("| {} |", case.network.name);
        assert!(
            kept.contains(&row),
            "docs/evaluation/networks-table.md has no {}: SINEW_SNAPSHOTS=bless",
            case.network.name
        );
    }
}

const HEAD: &str = "# Networks of the frameworks, measured\n\n\
    Written by `SINEW_SNAPSHOTS=bless cargo test -p sinew-nn --test networks`. Error: largest\n\
    difference from the framework's own outputs, of their range; of derivatives: from double\n\
    precision, of the largest. Instructions of one call on a Cortex-M4F in QEMU.\n\n\
    | network | parameters | error | of derivatives | predict | with Jacobian |\n|---|---|---|---|---|---|\n";

/// Every kind of layer and of activation that is promised, as an importer or an activation is
/// called here.
const PROMISED: &[&str] = &[
    "dense",
    "conv1d",
    "conv2d",
    "max_pool",
    "average_pool",
    "reshape",
    "simple_rnn",
    "gru reset after",
    "gru reset before",
    "lstm",
    "scale",
    "add",
    "multiply",
    "select",
    "normalise",
    "concatenate",
    "softmax",
    "Relu",
    "LeakyRelu",
    "Elu",
    "Selu",
    "Gelu",
    "GeluTanh",
    "Softplus",
    "Softsign",
    "Swish",
    "HardSigmoid",
    "Sigmoid",
    "Tanh",
    "Exponential",
    "Logarithm",
    "Root",
    "Reciprocal",
];

/// Promised kinds that no file of a framework has.
pub fn missing() -> Vec<&'static str> {
    let mut found = std::collections::HashSet::new();
    for path in files() {
        for node in network(&path).nodes {
            found.insert(node.op.kind().to_string());
            match &node.op {
                Op::Activation(g) => drop(found.insert(activation(*g))),
                Op::Recurrent(layer) => {
                    found.extend(layer.cell.activations().into_iter().map(activation));
                    if let Cell::Gru { reset_after, .. } = layer.cell {
                        let when = if reset_after { "after" } else { "before" };
                        found.insert(format!("gru reset {when}"));
                    }
                }
                _ => {}
            }
        }
    }
    let promised = PROMISED.iter().copied();
    promised.filter(|name| !found.contains(*name)).collect()
}

/// The variant's name; an elu with a scale is a selu.
fn activation(g: Activation) -> String {
    match g {
        Activation::Elu { scale, .. } if scale != 1.0 => "Selu".into(),
        g => {
            let text = format!("{g:?}");
            text.split(' ').next().unwrap_or_default().into()
        }
    }
}
