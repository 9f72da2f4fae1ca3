//! The controller that `sinew emit --c-abi` prints: its own example, in C, has the bits of the
//! controller in Rust.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use sinew::device::Workplace;
use sinew::project::{Optimise, c_library, ready};
use sinew_model_reference_s::control::{HORIZON, NY, controller};
use sinew_tests::{image, skip};

/// Sensor rows: a slow swing, a reading that is missing, and a stretch of none.
fn rows() -> Vec<[f32; NY]> {
    let row = |k: u32| {
        let angle = f64::from(k) * 0.05;
        let mut y = [angle.sin(), angle.cos(), 0.5 * angle.sin()].map(|y| (0.3 * y) as f32);
        if k == 7 {
            y[1] = f32::NAN;
        }
        if (40..55).contains(&k) {
            y = [f32::NAN; NY];
        }
        y
    };
    (0..80).map(row).collect()
}

/// Answers of the example to these rows.
fn answers(program: &Path, rows: &[[f32; NY]], asked: &[f32]) -> String {
    let mut text = String::new();
    for value in rows.iter().flatten() {
        let _ = write!(text, "{value} ");
    }
    let input = program.with_extension("rows");
    std::fs::write(&input, text.replace("NaN", "missing")).expect("the folder is writable");
    let ran = Command::new(program)
        .args(asked.iter().map(ToString::to_string))
        .stdin(std::fs::File::open(&input).expect("just written"))
        .output()
        .expect("just compiled");
    assert!(ran.status.success());
    String::from_utf8(ran.stdout).expect("the example prints ASCII")
}

#[test]
fn the_printed_example_in_c_has_the_bits_of_the_controller_in_rust() {
    if Command::new("cc").arg("--version").output().is_err() {
        return skip("no C compiler");
    }
    if ready(sinew::project::Board::Stm32f446).is_err() {
        return skip("no target thumbv7em-none-eabihf");
    }
    let workplace = Workplace::new().expect("a temporary folder");
    let folder = workplace.path().join("controller");
    let spec = sinew_model::store::load(&image::root().join("models/reference-s"))
        .expect("the model is committed");
    c_library::write(&folder, &spec, Optimise::Speed).expect("the folder is free");
    let built =
        c_library::build(&folder, &image::cache()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(built.len(), 2);
    // Optimised as a whole: what is in the archive can be reached.
    let found = image::symbols(&built[0]);
    let all = found.global.iter().chain(&found.local).chain(&found.wanted);
    let panics: Vec<_> = all.filter(|name| image::is_panic(name)).collect();
    assert!(panics.is_empty(), "{panics:?}");

    let program = workplace.path().join("example");
    let compiled = Command::new("cc")
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-I"])
        .arg(folder.join("src"))
        .arg(folder.join("examples/rows/rows.c"))
        .arg(folder.join("lib/host/libsinew_controller.a"))
        .args(["-lm", "-o"])
        .arg(&program)
        .output()
        .expect("cc was there a moment ago");
    let complaints = String::from_utf8_lossy(&compiled.stderr);
    assert!(compiled.status.success(), "{complaints}");

    let asked = [0.2, -0.1, 0.05];
    let rows = rows();
    let mut rust = controller();
    let mut statuses = std::collections::BTreeSet::new();
    let answers = answers(&program, &rows, &asked);
    let mut lines = answers.lines();
    for y in &rows {
        let step = rust.step(y, &[], &[asked; HORIZON]);
        let line: Vec<&str> = lines.next().expect("a line a row").split(' ').collect();
        let said: Vec<f32> = line[..2]
            .iter()
            .map(|u| u.parse().expect("a number"))
            .collect();
        assert_eq!(said, step.u, "{line:?}");
        assert_eq!(line[2], (step.status as u32).to_string());
        assert_eq!(line[3], step.iterations.to_string());
        statuses.insert(step.status as u32);
    }
    assert_eq!(lines.next(), None);
    assert!(
        statuses.len() > 1,
        "{statuses:?}: the stretch of no sample tests nothing"
    );
}
