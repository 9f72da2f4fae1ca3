//! A plate on foam that creeps along three axes, by the exponential of a matrix
//! (`tests/foreign/foam.py`).

use super::recording::error;

/// Error that is allowed, as a part of the range of the motion: the integrator's, at its usual
/// sub-steps.
const TOLERANCE: f64 = 1e-9;

#[test]
fn foam_that_creeps_moves_as_closed_formulas_say() {
    let error = error("foam", "exact", None);
    println!("largest error: {error:.2e} of the range");
    assert!(error < TOLERANCE, "{error:.3e} of the range");
}

#[test]
fn foam_that_relaxes_a_thousandth_later_would_be_noticed() {
    let slot = "column_roll.viscoelastic_creep.time_constant";
    let error = error("foam", "exact", Some((slot, 1.001)));
    assert!(error > 100.0 * TOLERANCE, "{error:.3e} of the range");
}
