//! Commands of the how-to pages, run as they stand there.

use crate::desk::{Desk, checkout, images};

/// The lines of a page's shell blocks.
fn commands(page: &str) -> Vec<String> {
    let path = checkout().join("docs/how-to").join(page);
    let text = std::fs::read_to_string(&path).expect("the page is committed");
    let mut inside = false;
    let mut found = Vec::new();
    for line in text.lines() {
        match line {
            "```sh" => inside = true,
            "```" => inside = false,
            line if inside => found.push(line.to_owned()),
            _ => {}
        }
    }
    found
}

#[test]
fn the_commands_from_pytorch_and_keras_run_as_they_stand_on_the_page() {
    let desk = Desk::new();
    let copy = |from: &str, to: &str| {
        let from = checkout().join(from);
        std::fs::copy(&from, desk.path(to)).unwrap_or_else(|e| panic!("{}: {e}", from.display()));
    };
    let nets = "codegen/nn/tests";
    copy(
        &format!("{nets}/cases/17-pytorch-view-open-batch/net.onnx"),
        "net.onnx",
    );
    copy(
        &format!("{nets}/frameworks/models/keras-mlp.keras"),
        "net.keras",
    );
    copy(
        "rigs/experiments/mass-spring-damper.tflite",
        "predictor.tflite",
    );
    copy("rigs/mass-spring-damper.fit.csv", "rec.csv");
    copy("rigs/mass-spring-damper.toml", "rig.toml");
    desk.write(
        "rig.toml",
        &(desk.read("rig.toml") + "form = \"increment\"\n"),
    );
    let lines = commands("from-pytorch-and-keras.md");
    assert_eq!(lines.len(), 10, "{lines:?}");
    for line in lines {
        let verb = line
            .strip_prefix("sinew ")
            .expect("a command of this program");
        if line.contains("--python") {
            continue;
        }
        let output = desk.command(verb).env("SINEW_BUILD_DIR", images()).output();
        let output = output.expect("the program starts");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{line}\n{errors}");
    }
    for written in [
        "net/network.toml",
        "crate/src/network.rs",
        "small/Cargo.toml",
        "layers.json",
    ] {
        assert!(desk.path(written).is_file(), "{written}");
    }
    assert!(desk.path("firmware/model/Cargo.toml").is_file());
}
