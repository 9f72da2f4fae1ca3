//! The network, one prediction.

use core::hint::black_box;

use layered::{INPUTS, predict_in_layers};

// A frame of its own, below that of who measures.
#[inline(never)]
pub fn call(mark: &mut dyn FnMut(usize)) {
    let x = [0.1; INPUTS];
    let _ = black_box(predict_in_layers(black_box(&x), mark));
}
