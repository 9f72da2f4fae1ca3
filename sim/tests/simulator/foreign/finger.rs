//! A finger between two dry tendons that pull against each other, by closed formulas between its
//! stops (`tests/foreign/finger.py`): what rests is held by both, and neither moves without the
//! other.

use super::recording::{Columns, error};

/// Error that is allowed, as a part of the range of the motion.
const TOLERANCE: f64 = 1e-7;

#[test]
fn opposite_tendons_that_rub_move_as_closed_formulas_say() {
    let recording = Columns::read("finger/exact.csv");
    let x = recording.get("x_m");
    let stuck = x.windows(2).filter(|pair| pair[0] == pair[1]).count();
    assert!(stuck > 50, "the finger sticks for {stuck} samples only");
    let error = error("finger", "exact", None);
    println!("largest error: {error:.2e} of the range");
    assert!(error < TOLERANCE, "{error:.3e} of the range");
}

#[test]
fn a_tendon_that_rubs_a_thousandth_more_would_be_noticed() {
    let slot = "east.load_dependent_friction.coefficient";
    let error = error("finger", "exact", Some((slot, 1.001)));
    assert!(error > 100.0 * TOLERANCE, "{error:.3e} of the range");
}
