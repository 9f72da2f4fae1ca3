//! The controller's derivatives on a Cortex-M4F: exact Hessian, Gauss-Newton's, and through recurrent cells.

use std::process::{Command, Stdio};

use sinew::device::Workplace;
use sinew::project::{Machine, run_cargo};
use sinew_tests::{image, skip};

/// The same cases are held against double precision by `firmware/tests/hessian.rs` and `firmware/tests/recurrent`, so equal
/// bits here are vectors of double precision there.
#[test]
fn hessians_and_recurrent_cells_have_the_same_bits_in_qemu() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let program = run_cargo(
        &image::root().join("tests/vectors"),
        Machine::Microcontroller,
        &image::cache(),
        &["build", "--features", "program", "--bin", "vectors"],
    );
    let program = program.unwrap_or_else(|error| panic!("{error}"));
    let folder = Workplace::new().expect("a temporary folder");
    let status = Command::new("sh")
        .arg(image::runner())
        .arg(program.join("vectors"))
        .current_dir(folder.path())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .status()
        .expect("QEMU was there a moment ago");
    assert_eq!(status.code(), Some(0));
    let said = std::fs::read(folder.path().join("to_host")).expect("what it said");
    let (words, []) = said.as_chunks::<4>() else {
        panic!("{} bytes are no words", said.len());
    };
    let there: Vec<u32> = words.iter().map(|word| u32::from_le_bytes(*word)).collect();
    let mut here = Vec::new();
    sinew_vectors::every(|value| here.push(value));

    let mut pairs = here.iter().zip(&there);
    let different = pairs.position(|(here, there)| here.to_bits() != *there);
    assert_eq!(there.len(), here.len());
    assert_eq!(different, None, "the first value that differs");
    let told = here.iter().filter(|v| v.is_finite() && **v != 0.0).count();
    // Only Lambda's pattern is nought.
    assert!(10 * told > 9 * here.len(), "{told} of {}", here.len());
    println!(
        "{} values of {} cases of each kind",
        here.len(),
        sinew_vectors::CASES
    );
}
