//! Keras models over a sequence of one step: the axis of length 1 stays.

use std::fs;
use std::io::{Cursor, Read, Write};
use std::path::Path;

use sinew_nn::{evaluate, import};
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

/// The committed model `name`, with `from` replaced by `to` in its configuration.
fn edited(name: &str, from: &str, to: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/frameworks/models");
    let bytes = fs::read(folder.join(name)).expect("the model is committed");
    let mut archive = ZipArchive::new(Cursor::new(bytes)).expect("the model is an archive");
    let mut edited = ZipWriter::new(Cursor::new(Vec::new()));
    for name in ["metadata.json", "config.json", "model.weights.h5"] {
        let mut entry = archive.by_name(name).expect("Keras writes these three");
        let mut contents = Vec::new();
        entry.read_to_end(&mut contents).expect("the file unpacks");
        if name == "config.json" {
            let text = String::from_utf8(contents).expect("JSON is text");
            assert!(text.contains(from), "{text}");
            contents = text.replace(from, to).into_bytes();
        }
        edited
            .start_file(name, SimpleFileOptions::default())
            .and_then(|()| Ok(edited.write_all(&contents)?))
            .expect("memory can be written");
    }
    edited.finish().expect("memory can be written").into_inner()
}

#[test]
fn a_residual_network_over_one_step_is_that_over_features() {
    let name = "keras-residual.keras";
    let features = import::parse(name, &edited(name, "[null, 8]", "[null, 8]"));
    let step = import::parse(name, &edited(name, "[null, 8]", "[null, 1, 8]"));
    let (features, step) = (
        features.expect("the model is sound"),
        step.expect("one step is a sequence"),
    );
    let x: Vec<f64> = (0..8).map(|i| 0.3 * f64::from(i) - 1.0).collect();
    let outputs = [&features, &step].map(|network| evaluate::call(network, &x, &[]).y);
    assert_eq!(outputs[0], outputs[1]);
    let shape = |network: &sinew_nn::Network| network.nodes.last().map(|node| node.shape.clone());
    assert_eq!(shape(&features), Some(vec![2]));
    assert_eq!(shape(&step), Some(vec![1, 2]));
}
