//! The network, measured.
#![no_std]

use core::hint::black_box;

use network::{INPUTS, RESULTS, State, VARIABLES, predict, predict_with_jacobian};

mod bench;
pub use bench::Bench;

/// Measures a call of each function.
pub fn run(bench: &mut dyn Bench) {
    let x = [0.1; INPUTS];
    let mut jacobian = [[0.0; RESULTS]; VARIABLES];
    let mut state = State::new();
    bench.measure("predict", &mut || {
        let _ = black_box(predict(black_box(&mut state), black_box(&x)));
    });
    bench.measure("jacobian", &mut || {
        let _ = black_box(predict_with_jacobian(black_box(&mut state), black_box(&x), black_box(&mut jacobian)));
    });
}
