//! The controller's derivatives on a Cortex-M4F: exact Hessian, Gauss-Newton's, and through
//! recurrent cells.

use std::process::{Command, Stdio};

use sinew::device::Workplace;
use sinew::project::{Machine, run_cargo};
use sinew_mpc::model::{Jacobian, Model};
use sinew_tests::{image, skip};
use sinew_vectors::case::{Case, FAR};
use sinew_vectors::differenced::Differenced;
use sinew_vectors::random::Random;
use sinew_vectors::shallow::Shallow;

/// The same cases are held against double precision by `firmware/mpc/tests/hessian.rs` and
/// `firmware/mpc/tests/recurrent`, so equal bits here are vectors of double precision there.
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

/// Test that what `cargo xtask bench differences` counts does differentiate, and no better than
/// that.
#[test]
fn differences_of_predictions_are_near_the_exact_derivatives() {
    let mut random = Random(77);
    let mut most = 0.0_f32;
    for case in 0..50 {
        let net = Shallow::<12, 10, 3>::random(&mut random, case % 2 == 1);
        let drawn = Case::<2, 3, 0, 3, 2, 10, 8>::draw(&mut random, FAR);
        let net = Differenced(net);
        let (mut exact, mut near) = (Jacobian::<2, 3, 3, 2>::ZERO, Jacobian::ZERO);
        let mut trace = [0.0; 10];
        net.0.predict(&drawn.start, &mut trace);
        Model::<2, 3, 0, 3, 2>::jacobian(&net.0, &trace, &mut exact);
        let mut seen = <Differenced<Shallow<12, 10, 3>> as Model<2, 3, 0, 3, 2>>::TRACE;
        net.predict(&drawn.start, &mut seen);
        net.jacobian(&seen, &mut near);
        let flat = |j: &Jacobian<2, 3, 3, 2>| -> Vec<f32> {
            let u = j.u.iter().flatten().flatten();
            u.chain(j.y.iter().flatten().flatten()).copied().collect()
        };
        let (exact, near) = (flat(&exact), flat(&near));
        most = exact
            .iter()
            .zip(&near)
            .fold(most, |m, (e, n)| m.max((e - n).abs()));
    }
    assert!((1e-5..2e-3).contains(&most), "{most}");
}
