//! Refusal of attributes and inputs that nothing reads, for every operator in the committed files.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use prost::Message;

use super::import;
use super::proto::{AttributeProto, ModelProto};

/// Name of what nothing reads.
const UNKNOWN: &str = "of_no_operator";

/// Every committed ONNX file that is read.
fn files() -> Vec<(PathBuf, ModelProto)> {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let mut folders = vec![tests.join("frameworks/models")];
    let cases = fs::read_dir(tests.join("cases")).expect("the cases are committed");
    folders.extend(cases.map(|entry| entry.expect("the entry is readable").path()));
    let mut found = Vec::new();
    for folder in folders {
        let entries = fs::read_dir(&folder).expect("the folder is committed");
        for path in entries.map(|entry| entry.expect("the entry is readable").path()) {
            if path.extension().is_none_or(|ending| ending != "onnx") {
                continue;
            }
            let bytes = fs::read(&path).expect("the file was just seen");
            if import("net", &bytes).is_ok() {
                let model = ModelProto::decode(bytes.as_slice()).expect("it has just been read");
                found.push((path, model));
            }
        }
    }
    found
}

#[test]
fn every_operator_refuses_an_attribute_and_an_input_that_nothing_reads() {
    let mut seen = BTreeSet::new();
    for (path, model) in files() {
        let count = model.graph.as_ref().map_or(0, |graph| graph.node.len());
        for place in 0..count {
            let mut model = model.clone();
            let node = &mut model.graph.as_mut().expect("it has nodes").node[place];
            let op = node.op_type.clone();
            let case = format!("{op} of {}", path.display());
            if !seen.insert(op.clone()) {
                continue;
            }
            node.attribute.push(AttributeProto {
                name: UNKNOWN.into(),
                i: 1,
                ..AttributeProto::default()
            });
            let refused = import("net", &model.encode_to_vec())
                .expect_err(&case)
                .to_string();
            let words = format!("the attribute {UNKNOWN} of {op}");
            assert!(refused.contains(&words), "{case}: {refused}");
            let node = &mut model.graph.as_mut().expect("it has nodes").node[place];
            node.attribute.pop();
            node.input.push(UNKNOWN.into());
            let refused = import("net", &model.encode_to_vec());
            assert!(
                refused.is_err(),
                "{case}: an input that nothing gives is taken"
            );
        }
    }
    // Operators of the table whose files are not committed pass through the same check.
    assert!(seen.len() >= 50, "{} operators: {seen:?}", seen.len());
}
