//! Commands of the how-to pages, run as they stand there.

use crate::desk::{Desk, checkout, columns, images};

/// The lines of a page's shell blocks; blocks with a path behind their language are written there.
fn commands(page: &str, desk: &Desk) -> Vec<String> {
    let path = checkout().join("docs/how-to").join(page);
    let text = std::fs::read_to_string(&path).expect("the page is committed");
    let mut block: Option<(&str, String)> = None;
    let mut found = Vec::new();
    for line in text.lines() {
        match (line.strip_prefix("```"), &mut block) {
            (Some(info), None) => block = Some((info, String::new())),
            (Some(_), Some((info, inside))) => {
                match info.split_once(' ') {
                    Some((_, file)) => {
                        desk.write(file, inside);
                    }
                    None if *info == "sh" => found.extend(inside.lines().map(str::to_owned)),
                    None => {}
                }
                block = None;
            }
            (None, Some((_, inside))) => *inside += &format!("{line}\n"),
            (None, None) => {}
        }
    }
    found
}

/// Runs the ten commands of a page; what each printed.
fn follow(page: &str, desk: &Desk) -> Vec<String> {
    let lines = commands(page, desk);
    assert_eq!(lines.len(), 10, "{lines:?}");
    let run = |line: &String| {
        let words = line
            .strip_prefix("sinew ")
            .expect("a command of this program");
        if words.contains("--python") {
            return String::new();
        }
        let output = desk
            .command(words)
            .env("SINEW_BUILD_DIR", images())
            .output();
        let output = output.expect("the program starts");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{line}\n{errors}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    lines.iter().map(run).collect()
}

fn copy(desk: &Desk, from: &str, to: &str) {
    let from = checkout().join(from);
    std::fs::copy(&from, desk.path(to)).unwrap_or_else(|e| panic!("{}: {e}", from.display()));
}

/// Columns as a MATLAB file of level 5, uncompressed.
fn mat(columns: &[(String, Vec<f64>)]) -> Vec<u8> {
    let element = |kind: u32, bytes: &[u8]| {
        let mut element = [kind.to_le_bytes(), (bytes.len() as u32).to_le_bytes()].concat();
        element.extend(bytes);
        element.resize(element.len().next_multiple_of(8), 0);
        element
    };
    let mut file = vec![b' '; 116];
    file.extend([0; 8]);
    file.extend([0x00, 0x01, b'I', b'M']);
    for (name, values) in columns {
        let sizes = [values.len() as u32, 1].map(u32::to_le_bytes).concat();
        let numbers: Vec<u8> = values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        // Flags of a double array, its size, its name, its numbers.
        let parts = [
            element(6, &[6, 0, 0, 0, 0, 0, 0, 0]),
            element(5, &sizes),
            element(1, name.as_bytes()),
            element(9, &numbers),
        ];
        file.extend(element(14, &parts.concat()));
    }
    file
}

#[test]
fn the_commands_from_bam_run_as_they_stand_on_the_page_and_find_the_friction() {
    let desk = Desk::new();
    for name in ["sin_sin", "up_and_down"] {
        let log = format!("tests/foreign/logs/servo_{name}.json");
        copy(&desk, &log, &format!("{name}.json"));
    }
    let said = follow("from-bam.md", &desk);
    let diagnosis = &said[5];
    assert!(diagnosis.contains("Dry friction"), "{diagnosis}");
    let corrected = desk.read("corrected.toml");
    let level = corrected
        .split("kind = \"coulomb_friction\"")
        .nth(1)
        .and_then(|effect| effect.split("value = ").nth(1))
        .and_then(|rest| rest.split([',', ' ', '}']).next())
        .and_then(|number| number.parse::<f64>().ok());
    // tests/foreign/servo_log.py has 0.045 N m.
    let level = level.unwrap_or_else(|| panic!("no level: {corrected}"));
    assert!((0.040..0.050).contains(&level), "{level}");
}

#[test]
fn the_commands_from_matlab_run_as_they_stand_on_the_page() {
    let desk = Desk::new();
    for (role, name) in [("fit", "log.mat"), ("test", "test.mat")] {
        let path = checkout().join(format!("rigs/mass-spring-damper.{role}.csv"));
        let text = std::fs::read_to_string(path).expect("a shipped recording");
        std::fs::write(desk.path(name), mat(&columns(&text))).expect("the desk is writable");
    }
    copy(&desk, "rigs/mass-spring-damper.toml", "rig.toml");
    copy(&desk, "tests/foreign/logs/v73.mat", "v73.mat");
    let said = follow("from-matlab.md", &desk);
    assert!(said[0].starts_with("MATLAB v5"), "{}", said[0]);
    assert!(said[9].contains("HDF5"), "{}", said[9]);
    assert!(desk.read("corrected.toml").contains("coulomb_friction"));
    assert!(
        desk.read("fit.html")
            .contains("Residuals of q_m: autocorrelation")
    );
}

#[test]
fn the_commands_from_mujoco_run_as_they_stand_on_the_page() {
    let desk = Desk::new();
    for name in ["pendulum.xml", "pendulum.urdf"] {
        copy(&desk, &format!("tests/foreign/mechanism/{name}"), name);
    }
    let said = follow("from-mujoco.md", &desk);
    assert!(said[0].contains("left out: pendulum.xml:"), "{}", said[0]);
    let changes = desk.read("fitted.changes.csv");
    assert!(
        changes.starts_with("place,element,attribute,old,new"),
        "{changes}"
    );
    assert!(desk.path("corrected.xml").is_file());
}

#[test]
fn the_commands_from_pytorch_and_keras_run_as_they_stand_on_the_page() {
    let desk = Desk::new();
    let copy = |from: &str, to: &str| copy(&desk, from, to);
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
    follow("from-pytorch-and-keras.md", &desk);
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
