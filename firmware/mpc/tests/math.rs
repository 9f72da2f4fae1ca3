//! Errors of the transcendental functions, swept, and the directed sums against exact arithmetic.

mod common;

use common::cases;
use proptest::prelude::*;
use sinew_mpc::math;

const POINTS: u32 = 1 << 20;

/// Largest |f - truth| over POINTS points of -range to range, and the largest error for the slope.
fn worst(range: f64, f: impl Fn(f32) -> f32, truth: impl Fn(f64) -> f64) -> f64 {
    (0..=POINTS)
        .map(|i| (-range + 2.0 * range * f64::from(i) / f64::from(POINTS)) as f32)
        .map(|x| (f64::from(f(x)) - truth(f64::from(x))).abs())
        .fold(0.0, f64::max)
}

#[test]
fn tanh_is_within_its_stated_error() {
    let near = worst(2.0, math::tanh, f64::tanh);
    let far = worst(12.0, math::tanh, f64::tanh);
    println!("largest error of tanh: {near:.3e} in +-2, {far:.3e} in +-12");
    assert!(
        near > 1e-8,
        "an f32 function cannot be this good: nothing was compared"
    );
    assert!(near < 1.2e-6 && far < 2e-6);
}

#[test]
fn tanh_is_odd_bounded_and_passes_nan() {
    for i in 0..POINTS {
        let x = f32::from_bits(i << 11);
        if x.is_nan() {
            continue;
        }
        let y = math::tanh(x);
        assert_eq!(math::tanh(-x).to_bits(), (-y).to_bits(), "at {x:e}");
        assert!(y.abs() <= 1.0, "tanh({x:e}) = {y:e}");
    }
    assert!(math::tanh(f32::NAN).is_nan());
    assert!(math::tanh(f32::INFINITY) > 0.999_997);
}

#[test]
fn tanh_slope_from_the_value_is_the_derivative() {
    let error = worst(
        8.0,
        |x| math::tanh_slope(math::tanh(x)),
        |x| 1.0 - f64::tanh(x).powi(2),
    );
    assert!(error < 4e-6, "{error:e}");
}

#[test]
fn sigmoid_is_within_its_stated_error() {
    let truth = |x: f64| 1.0 / (1.0 + f64::exp(-x));
    assert!(worst(20.0, math::sigmoid, truth) < 1e-6);
    let slope = |x: f64| truth(x) * (1.0 - truth(x));
    assert!(worst(20.0, |x| math::sigmoid_slope(math::sigmoid(x)), slope) < 2e-6);
}

#[test]
fn relu_keeps_nan_and_makes_zero_positive() {
    assert!(math::relu(f32::NAN).is_nan());
    assert_eq!(math::relu(-0.0).to_bits(), 0);
    assert_eq!(math::relu(3.0), 3.0);
    assert_eq!(
        (math::relu_slope(math::relu(-1.0)), math::relu_slope(2.0)),
        (0.0, 1.0)
    );
}

/// `x <= a + b` in real arithmetic: two-sum in f64 is exact for any two finite f32.
fn not_above_sum(x: f32, a: f32, b: f32) -> bool {
    let (a, b, x) = (f64::from(a), f64::from(b), f64::from(x));
    let sum = a + b;
    let part = sum - a;
    let error = (a - (sum - part)) + (b - part);
    x < sum || (x == sum && error >= 0.0)
}

proptest! {
    #![proptest_config(cases(20_000))]

    #[test]
    fn add_down_is_the_largest_number_not_above_the_sum(a: u32, b: u32) {
        let (a, b) = (f32::from_bits(a), f32::from_bits(b));
        prop_assume!(a.is_finite() && b.is_finite());
        let down = math::add_down(a, b);
        prop_assert!(not_above_sum(down, a, b), "{a:e} + {b:e} -> {down:e}");
        if down != f32::MAX {
            prop_assert!(!not_above_sum(down.next_up(), a, b), "{a:e} + {b:e} -> {down:e}");
        }
        prop_assert_eq!(math::add_up(-a, -b), -down);
    }

    /// Magnitudes near each other, where the rounding error is not the smaller operand.
    #[test]
    fn add_down_of_neighbours(a in -2.0_f32..2.0, b in -2.0_f32..2.0) {
        let down = math::add_down(a, b);
        prop_assert!(not_above_sum(down, a, b) && !not_above_sum(down.next_up(), a, b));
    }
}
