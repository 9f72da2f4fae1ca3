//! Bounds of fitted parameters.

use sinew_sim::Parameter;

/// Bounds of a parameter: its owner's, and zero where the sign is fixed.
pub(crate) fn bounds(parameter: &Parameter) -> [f64; 2] {
    let [least, most] = natural(parameter);
    [
        parameter.min.unwrap_or(least).max(least),
        parameter.max.unwrap_or(most),
    ]
}

/// Bounds that physics gives: zero where the sign is fixed.
pub(super) fn natural(parameter: &Parameter) -> [f64; 2] {
    let least = if parameter.non_negative {
        0.0
    } else {
        f64::NEG_INFINITY
    };
    [least, f64::INFINITY]
}

/// The bound at which a fitted value rests, where its owner gave it.
pub(super) fn reached(parameter: &Parameter, value: f64) -> Option<f64> {
    let [low, high] = bounds(parameter);
    let [least, most] = natural(parameter);
    let below = (value <= low && least < low).then_some(low);
    below.or((value >= high && high < most).then_some(high))
}
