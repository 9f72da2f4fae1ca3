//! Refusal of settings that nothing reads, for every class in the committed files.

use std::collections::BTreeSet;
use std::fs;
use std::io::{Cursor, Read};
use std::path::Path;

use serde_json::Value;

use super::{Hdf5, Weights, build, configuration, idle};
use crate::{Network, NetworkError};

/// Name of what nothing reads.
const UNKNOWN: &str = "of_no_layer";

/// Every committed archive.
fn files() -> Vec<(String, Vec<u8>)> {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let mut folders = vec![tests.join("frameworks/models")];
    let cases = fs::read_dir(tests.join("cases")).expect("the cases are committed");
    folders.extend(cases.map(|entry| entry.expect("the entry is readable").path()));
    let mut found = Vec::new();
    for folder in folders {
        let entries = fs::read_dir(&folder).expect("the folder is committed");
        for path in entries.map(|entry| entry.expect("the entry is readable").path()) {
            if path.extension().is_some_and(|ending| ending == "keras") {
                let bytes = fs::read(&path).expect("the file was just seen");
                found.push((path.display().to_string(), bytes));
            }
        }
    }
    found
}

/// The network of an archive with another configuration.
fn with(bytes: &[u8], configuration: &Value) -> Result<Network, NetworkError> {
    let weights = || {
        let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).expect("an archive");
        let mut contents = Vec::new();
        let mut entry = archive.by_name("model.weights.h5").expect("weights");
        entry.read_to_end(&mut contents).expect("the file unpacks");
        Weights::numbered(&Hdf5::new(&contents)?)
    };
    build("net", &configuration.to_string(), weights, false)
}

#[test]
fn every_layer_and_operation_refuses_a_setting_that_nothing_reads() {
    let mut seen = BTreeSet::new();
    for (path, bytes) in files() {
        let text = configuration(&bytes).expect("an archive has a configuration");
        let whole: Value = serde_json::from_str(&text).expect("it is JSON");
        if with(&bytes, &whole).is_err() {
            continue;
        }
        let count = whole["config"]["layers"].as_array().map_or(0, Vec::len);
        for place in 0..count {
            let mut changed = whole.clone();
            let layer = &mut changed["config"]["layers"][place];
            let class = layer["class_name"].as_str().expect("a class").to_owned();
            if idle::IDLE.contains(&class.as_str()) || !seen.insert(class.clone()) {
                continue;
            }
            layer["config"][UNKNOWN] = 1.into();
            let case = format!("{class} of {path}");
            let refused = with(&bytes, &changed).expect_err(&case).to_string();
            assert!(refused.contains(UNKNOWN), "{case}: {refused}");
        }
    }
    assert!(seen.len() >= 40, "{} classes: {seen:?}", seen.len());
}
