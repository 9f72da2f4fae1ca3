//! ONNX's operator table (tests/operators, made by tests/foreign/operator_table.py): every operator
//! is read or refused by name, and so is every attribute and input away from its default.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use prost::Message;
use serde_json::Value;

use super::proto::{
    Dimension, GraphProto, ModelProto, NodeProto, OperatorSetProto, Shape, TensorType, TypeProto,
    ValueInfoProto,
};
use super::{OPSETS, import};
use crate::{NetworkError, evaluate};

/// Largest difference from onnxruntime, of the range of the outputs.
const EXACT: f64 = 2e-5;

/// Attributes of operators that change no float32 value, which onnxruntime will not run.
const IDLE: &[(&str, &str)] = &[("Cast", "saturate")];

/// Contents of a file of the table.
fn read(file: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/operators");
    let text = fs::read_to_string(path.join(file)).expect("the table is committed");
    serde_json::from_str(&text).expect("the table is JSON")
}

fn words(list: &Value) -> Vec<&str> {
    let list = list.as_array().expect("the value is a list");
    list.iter().filter_map(Value::as_str).collect()
}

fn numbers(list: &Value) -> Vec<f64> {
    let list = list.as_array().expect("the value is a list");
    list.iter().filter_map(Value::as_f64).collect()
}

/// A case of the table: operator, opset, and the attribute or the input that is not at its default.
struct Case {
    op: String,
    opset: i64,
    what: String,
    model: Vec<u8>,
    x: Vec<f64>,
    /// Outputs of onnxruntime; none where it does not run the graph.
    y: Option<Vec<f64>>,
}

fn cases() -> Vec<Case> {
    let found = read("cases.json");
    let found = found.as_array().expect("the cases are a list").iter();
    found
        .map(|case| Case {
            op: case["op"].as_str().expect("a case has an operator").into(),
            opset: case["opset"].as_i64().expect("a case has an opset"),
            what: case["what"].as_str().expect("a case says its kind").into(),
            model: base64(case["model"].as_str().expect("a case has a model")),
            x: numbers(&case["x"]),
            y: case["y"].is_array().then(|| numbers(&case["y"])),
        })
        .collect()
}

/// Bytes of their text in base 64.
fn base64(text: &str) -> Vec<u8> {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = text.bytes().filter(|&byte| byte != b'=');
    let places: Vec<u32> = digits
        .map(|byte| DIGITS.iter().position(|&digit| digit == byte))
        .map(|place| place.expect("a digit of base 64") as u32)
        .collect();
    let mut bytes = Vec::new();
    for four in places.chunks(4) {
        let bits = four.iter().fold(0, |bits, place| bits << 6 | place) << (6 * (4 - four.len()));
        bytes.extend(&bits.to_be_bytes()[1..four.len()]);
    }
    bytes
}

/// A node of an operator between an input and an output of three axes.
fn single(domain: &str, op: &str, opset: i64, inputs: usize) -> Vec<u8> {
    let dim = [1, 2, 3].map(|n| Dimension { dim_value: Some(n) }).to_vec();
    let value = |name: &str| ValueInfoProto {
        name: name.into(),
        kind: Some(TypeProto {
            tensor_type: Some(TensorType {
                elem_type: 1,
                shape: Some(Shape { dim: dim.clone() }),
            }),
        }),
    };
    let node = NodeProto {
        input: vec!["x".into(); inputs],
        output: vec!["y".into()],
        name: "node".into(),
        op_type: op.into(),
        domain: domain.into(),
        ..NodeProto::default()
    };
    let graph = GraphProto {
        node: vec![node],
        input: vec![value("x")],
        output: vec![value("y")],
        ..GraphProto::default()
    };
    let set = OperatorSetProto {
        domain: String::new(),
        version: opset,
    };
    let model = ModelProto {
        graph: Some(graph),
        opset_import: vec![set],
    };
    model.encode_to_vec()
}

#[test]
fn every_operator_of_the_table_is_read_or_refused_by_name_with_a_hint() {
    let cases = cases();
    let table = read("table.json");
    let table = table.as_object().expect("the table has operators");
    let mut counts = [0; 3];
    for (op, versions) in table {
        let versions = versions.as_array().expect("an operator has versions");
        if cases.iter().any(|case| case.op == *op) {
            counts[0] += 1;
            continue;
        }
        for version in versions {
            let opset = version["opset"].as_i64().expect("a version has an opset");
            let inputs = words(&version["inputs"]).len();
            let refused = import("net", &single("", op, opset, inputs.max(1)));
            let error = refused.map(|_| ()).expect_err(op);
            let NetworkError::Unsupported { what, nearest, .. } = &error else {
                panic!("{op} of opset {opset}: {error}");
            };
            if OPSETS.contains(&opset) {
                assert!(what.contains(op.as_str()), "{op}: {error}");
                assert!(!nearest.contains("see docs"), "{op} has no hint: {error}");
                counts[1] += 1;
            } else {
                assert_eq!(*what, format!("opset {opset}"), "{op}: {error}");
                counts[2] += 1;
            }
        }
    }
    println!(
        "{} operators: {} read; versions refused by name {}, by number {}",
        table.len(),
        counts[0],
        counts[1],
        counts[2]
    );
    assert!(table.len() >= 200 && counts[0] >= 70, "{counts:?}");
    for (domain, names) in read("domains.json").as_object().expect("domains") {
        for op in words(names) {
            let refused = import("net", &single(domain, op, 21, 1));
            if !["Scaler", "LinearRegressor"].contains(&op) {
                let error = refused.map(|_| ()).expect_err(op).to_string();
                let words = format!("{op} of {domain}");
                assert!(error.contains(&words), "{words}: {error}");
            }
        }
    }
}

#[test]
fn every_attribute_and_input_of_the_table_has_a_case() {
    let mut seen: BTreeMap<(String, i64), Vec<String>> = BTreeMap::new();
    for case in cases() {
        seen.entry((case.op, case.opset))
            .or_default()
            .push(case.what);
    }
    let operators: Vec<String> = seen.keys().map(|(op, _)| op.clone()).collect();
    let mut missing = Vec::new();
    for (op, versions) in read("table.json").as_object().expect("operators") {
        if !operators.contains(op) {
            continue;
        }
        for version in versions.as_array().expect("versions") {
            if version["deprecated"] == true {
                continue;
            }
            // A choice needs Where, which is younger than the oldest opset.
            let opset = version["opset"].as_i64().expect("an opset");
            let opset = opset.max(if ["Less", "Greater"].contains(&op.as_str()) {
                9
            } else {
                7
            });
            let found = seen
                .get(&(op.clone(), opset))
                .map_or(&[][..], Vec::as_slice);
            let optional = words(&version["inputs"]);
            let optional = optional.iter().filter(|name| name.ends_with(['?', '*']));
            let wanted = words(&version["attributes"]);
            for what in wanted.iter().chain(optional).chain([&""]) {
                if !found.iter().any(|had| had == what) {
                    missing.push(format!("{op} of opset {opset}: {what:?}"));
                }
            }
        }
    }
    assert!(missing.is_empty(), "{missing:#?}");
}

#[test]
fn every_attribute_and_input_of_the_table_is_read_rightly_or_refused() {
    let mut wrong = Vec::new();
    let (mut right, mut refused) = (0, BTreeMap::new());
    for case in cases() {
        let name = format!("{} of opset {}, {:?}", case.op, case.opset, case.what);
        let network = match import("net", &case.model) {
            Err(error @ NetworkError::Unsupported { .. }) if !case.what.is_empty() => {
                *refused
                    .entry(format!("{} {}: {error}", case.op, case.what))
                    .or_insert(0) += 1;
                continue;
            }
            Err(error) => {
                if case.y.is_some() {
                    wrong.push(format!("{name}: {error}"));
                }
                continue;
            }
            Ok(network) => network,
        };
        let Some(y) = case.y else {
            if !IDLE.contains(&(case.op.as_str(), case.what.as_str())) {
                wrong.push(format!("{name}: read, and onnxruntime does not run it"));
            }
            continue;
        };
        let found = evaluate::run(&network, &case.x);
        let range = y.iter().fold(0.1_f64, |size, y| size.max(y.abs()));
        let error = (found.iter().zip(&y)).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        if found.len() != y.len() || error.is_nan() || error > EXACT * range {
            wrong.push(format!("{name}: {found:?}, onnxruntime {y:?}"));
        }
        right += 1;
    }
    println!("{right} right; refused:\n{refused:#?}");
    assert!(wrong.is_empty(), "{}:\n{}", wrong.len(), wrong.join("\n"));
    assert!(right >= 800, "{right}");
}
