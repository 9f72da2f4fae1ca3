//! The network, measured.
#![no_std]

use core::hint::black_box;

use network::{INPUTS, OUTPUTS, predict, predict_with_jacobian};

mod bench;
pub use bench::Bench;

/// Measures a call of each function.
pub fn run(bench: &mut dyn Bench) {
    let x = [0.1; INPUTS];
    let mut jacobian = [[0.0; OUTPUTS]; INPUTS];
    bench.measure("predict", &mut || {
        let _ = black_box(predict(black_box(&x)));
    });
    bench.measure("jacobian", &mut || {
        let _ = black_box(predict_with_jacobian(black_box(&x), black_box(&mut jacobian)));
    });
}
