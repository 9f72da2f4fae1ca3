//! Networks that other tools wrote, with those tools' own outputs (tests/cases/NAME/expected.json):
//! each is read rightly, or refused by name where nothing else is possible.
//!
//! With SINEW_CASES the same comparison runs over a folder of such folders
//! (tests/foreign/README.md).

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use sinew_nn::{Network, NetworkError, evaluate, import};

/// Largest difference, of the range of the outputs, that arithmetic in f32 explains.
const EXACT: f64 = 2e-5;
/// Largest difference from double precision: weights that are folded are f32.
const PRECISE: f64 = 1e-6;
/// Part of the range from which on rounding leaves nothing to compare.
const NO_DIGITS: f64 = 1e-2;
/// Times what rounding of every value changes, where the framework rounds to integers between
/// layers.
const ROUNDED: f64 = 3.0;

/// Files that are refused, and the words that name the reason.
const REFUSED: &[(&str, &str)] = &[
    ("01-initial-state/net.keras", "first state"),
    ("06-int8-keras/half.keras", "float16"),
    ("45-open-steps/backward.keras", "open length"),
    ("45-open-steps/both-ways.keras", "open length"),
    ("45-open-steps/convolution.onnx", "open length"),
    ("45-open-steps/first-slice.onnx", "open length"),
    ("45-open-steps/first-step.keras", "open length"),
    ("45-open-steps/first-step.onnx", "open length"),
    ("45-open-steps/mean.keras", "open length"),
    ("45-open-steps/mean.onnx", "open length"),
    ("45-open-steps/padded.keras", "open length"),
    ("45-open-steps/padded.onnx", "open length"),
    ("45-open-steps/softmax.onnx", "open length"),
    ("45-open-steps/twice.keras", "open length"),
    ("46-wrap-and-bounds/wrap-cut.onnx", "also cuts"),
    (
        "47-siblings-onnx/matmul-both.onnx",
        "one matrix has to be constant",
    ),
    (
        "47-siblings-onnx/matmul-weights-each.onnx",
        "one matrix for all",
    ),
    (
        "47-siblings-onnx/max-constant-three.onnx",
        "two Max in turn",
    ),
    ("48-siblings-keras/activation-glu.keras", "log_softmax"),
    (
        "48-siblings-keras/cell-stacked.keras",
        "one RNN after another",
    ),
    ("48-siblings-keras/ops-var.keras", "these work"),
    (
        "48-siblings-keras/state-cell.keras",
        "hidden state, its second",
    ),
    ("48-siblings-keras/state-encoder.keras", "first state"),
    ("50-own-code/cell.keras", "code of its own"),
    ("50-own-code/dense.keras", "code of its own"),
    ("50-own-code/function-layer.keras", "code of its own"),
    ("50-own-code/function.keras", "code of its own"),
];

/// Outcome of one file.
#[derive(Debug)]
enum Outcome {
    /// Largest difference, of the range.
    Read(f64),
    Refused(String),
    /// The file is said to be broken, which no framework's file is.
    Broken(String),
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        _ => value.as_f64().into_iter().collect(),
    }
}

fn rows(value: &Value) -> Vec<Vec<f64>> {
    value
        .as_array()
        .map(|rows| rows.iter().map(numbers).collect())
        .unwrap_or_default()
}

/// Largest difference between a network and the outputs of that key, of their range.
fn difference(network: &Network, expected: &Value, key: &str) -> f64 {
    let (inputs, outputs) = (rows(&expected["x"]), rows(&expected[key]));
    let all = outputs.iter().flatten().copied();
    let (low, high) = all.clone().fold((f64::MAX, f64::MIN), |(low, high), y| {
        (low.min(y), high.max(y))
    });
    let size = all.fold(0.0_f64, |size, y| size.max(y.abs()));
    let range = (high - low).max(0.1 * size).max(1e-3);
    let mut worst = 0.0_f64;
    for (x, y) in inputs.iter().zip(&outputs) {
        if x.len() % network.inputs() != 0 || x.is_empty() {
            return f64::INFINITY;
        }
        let found = evaluate::run(network, x);
        if found.len() != y.len() {
            return f64::INFINITY;
        }
        for (a, b) in found.iter().zip(y) {
            let error = (a - b).abs() / range;
            worst = if error.is_nan() {
                f64::INFINITY
            } else {
                worst.max(error)
            };
        }
    }
    worst
}

/// Largest difference from its framework that a file may show for these inputs.
fn tolerance(path: &Path, inputs: &[Vec<f64>]) -> f64 {
    match (import::rounding(path), import::read(path)) {
        (Ok(Some(rounding)), Ok(network)) => {
            let one = |x: &Vec<f64>| x.len() == network.inputs();
            assert!(
                inputs.iter().all(one),
                "a quantised file is given one input a call"
            );
            EXACT.max(ROUNDED * rounding.loss(&network, inputs))
        }
        _ => EXACT,
    }
}

/// Fate of a file, and the largest difference that it may show.
///
/// A generator that evaluates its graphs in double precision too (tests/foreign/exact.py) gives
/// those outputs, and how far rounding of every value moves them: a network is held to both.
fn outcome(path: &Path, expected: &Value) -> (Outcome, f64) {
    let network = match import::read(path) {
        Ok(network) => network,
        Err(error @ NetworkError::Malformed { .. }) => {
            return (Outcome::Broken(error.to_string()), EXACT);
        }
        Err(error) => return (Outcome::Refused(error.to_string()), EXACT),
    };
    let rounding = expected["rounding"].as_f64();
    let limit = expected["tolerance"].as_f64().or(rounding.map(|rounding| {
        let name = path.display();
        assert!(rounding < NO_DIGITS, "{name}: rounding leaves no digits");
        EXACT.max(rounding)
    }));
    let limit = limit.unwrap_or_else(|| tolerance(path, &rows(&expected["x"])));
    if let Some(rounding) = rounding {
        let (error, limit) = (
            difference(&network, expected, "exact"),
            PRECISE.max(rounding),
        );
        if error >= limit {
            return (Outcome::Read(error), limit);
        }
    }
    (Outcome::Read(difference(&network, expected, "y")), limit)
}

/// Every file of a folder of cases, its name with its folder's.
fn outcomes(folder: &Path) -> BTreeMap<String, (Outcome, f64)> {
    let mut found = BTreeMap::new();
    let entries = fs::read_dir(folder).expect("the folder of cases is there");
    let mut folders: Vec<PathBuf> = entries
        .map(|entry| entry.expect("the entry is readable").path())
        .collect();
    folders.sort();
    for folder in folders
        .into_iter()
        .filter(|path| path.join("expected.json").is_file())
    {
        let text =
            fs::read_to_string(folder.join("expected.json")).expect("the file was just seen");
        let expected: Value = serde_json::from_str(&text).expect("expected.json is JSON");
        for (file, expected) in expected.as_object().expect("expected.json is an object") {
            let path = folder.join(file);
            let name = format!(
                "{}/{file}",
                folder
                    .file_name()
                    .expect("a folder of cases has a name")
                    .to_string_lossy()
            );
            found.insert(name, outcome(&path, expected));
        }
    }
    found
}

#[test]
fn every_case_is_read_rightly_or_refused_by_name() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let mut found = outcomes(&folder);
    let half = "06-int8-keras/half.keras".to_owned();
    let path = folder.join(&half);
    found
        .entry(half)
        .or_insert_with(|| outcome(&path, &Value::Null));
    let mut wrong = Vec::new();
    for (name, (outcome, limit)) in &found {
        let refused = REFUSED.iter().find(|(file, _)| file == name);
        let right = match (outcome, refused) {
            (Outcome::Read(error), None) => error < limit,
            (Outcome::Refused(said), Some((_, words))) => said.contains(words),
            _ => false,
        };
        if !right {
            wrong.push(format!("{name}: {outcome:?}"));
        }
    }
    assert!(found.len() >= 120, "{} files", found.len());
    assert!(
        wrong.is_empty(),
        "{} of {}:\n{}",
        wrong.len(),
        found.len(),
        wrong.join("\n")
    );
}

/// The bits and, where the file states a scale, the inputs that it holds.
#[test]
fn a_quantised_file_says_what_its_framework_rounds() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let of = |file: &str| import::rounding(&folder.join(file)).expect(file);
    let keras = of("cases/06-int8-keras/int8.keras").expect("int8 layers");
    assert_eq!((keras.bits, keras.input), (8, None));
    let wide = of("cases/12-tflite-16x8-bias/dense.tflite").expect("16-bit values");
    let [low, high] = wide.input.expect("a scale of the input");
    assert_eq!(wide.bits, 16);
    assert!(low < -1.0 && high > 1.0 && (low + high).abs() < 1e-3 * high);
    let whole = of("frameworks/models/tflite-int8.tflite").expect("8-bit values");
    assert_eq!(whole.bits, 8);
    for file in [
        "cases/03-plus-constant/scalar.keras",
        "cases/20-tflite-dense-sequence/one.tflite",
        "frameworks/models/onnx-mlp.onnx",
        "frameworks/models/h5-mlp.h5",
        "reference/reference-s",
    ] {
        assert_eq!(of(file), None, "{file}");
    }
}

/// The table of a folder that SINEW_CASES names: none may be wrong without a word.
#[test]
fn foreign_networks_are_never_silently_wrong() {
    let Ok(folder) = std::env::var("SINEW_CASES") else {
        println!("skipped: SINEW_CASES names no folder (tests/foreign/README.md)");
        return;
    };
    let mut table: BTreeMap<String, [usize; 4]> = BTreeMap::new();
    let mut wrong = Vec::new();
    for (name, (outcome, limit)) in outcomes(Path::new(&folder)) {
        let exporter = name.split('/').next().unwrap_or("").to_owned();
        let counts = table.entry(exporter).or_default();
        match outcome {
            Outcome::Read(error) if error < limit => counts[0] += 1,
            Outcome::Read(error) => {
                counts[2] += 1;
                wrong.push(format!("{name}: {error:.1e} of the range"));
            }
            Outcome::Refused(said) => {
                counts[1] += 1;
                println!("{name}: {said}");
            }
            Outcome::Broken(said) => {
                counts[3] += 1;
                println!("{name}: BROKEN {said}");
            }
        }
    }
    println!(
        "| exporter | networks | read right | refused by name | said to be broken | wrong |\n|---|---|---|---|---|---|"
    );
    for (exporter, [right, refused, wrong, broken]) in &table {
        let all = right + refused + wrong + broken;
        println!("| {exporter} | {all} | {right} | {refused} | {broken} | {wrong} |");
    }
    assert!(wrong.is_empty(), "{}:\n{}", wrong.len(), wrong.join("\n"));
}
