//! Errors of the transcendental functions, swept over 2^20 points.

use sinew_kernels::math;

const POINTS: u32 = 1 << 20;

/// Largest error over `from..to`, absolute or relative.
fn worst(
    from: f64,
    to: f64,
    f: impl Fn(f32) -> f32,
    truth: impl Fn(f64) -> f64,
    relative: bool,
) -> f64 {
    let mut worst = 0.0_f64;
    for i in 0..=POINTS {
        let x = (from + (to - from) * f64::from(i) / f64::from(POINTS)) as f32;
        let exact = truth(x.into());
        let error = (f64::from(f(x)) - exact).abs() / if relative { exact.abs() } else { 1.0 };
        // A NaN is the worst there is.
        worst = if error <= worst { worst } else { error };
    }
    worst
}

#[test]
fn functions_are_within_their_stated_errors() {
    let errors = [
        ("exp", worst(-87.0, 88.0, math::exp, libm::exp, true), 3e-7),
        (
            "ln_1p",
            worst(1e-6, 1.0, math::ln_1p, libm::log1p, true),
            3e-7,
        ),
        (
            "root",
            worst(1e-3, 40.0, math::root, libm::sqrt, true),
            3e-7,
        ),
        (
            "reciprocal_root",
            worst(
                1e-30,
                1e-28,
                math::reciprocal_root,
                |x| 1.0 / libm::sqrt(x),
                true,
            ),
            3e-7,
        ),
        (
            "reciprocal_root of large numbers",
            worst(
                1e30,
                3e38,
                math::reciprocal_root,
                |x| 1.0 / libm::sqrt(x),
                true,
            ),
            3e-7,
        ),
        (
            "ln",
            worst(
                0.2,
                9.0,
                |x| 1.0 + math::ln(x),
                |x| 1.0 + libm::log(x),
                false,
            ),
            3e-7,
        ),
        ("erf", worst(-6.0, 6.0, math::erf, libm::erf, false), 4e-7),
        (
            "tanh",
            worst(-12.0, 12.0, math::precise::tanh, libm::tanh, false),
            1.5e-7,
        ),
        (
            "sigmoid",
            worst(
                -20.0,
                20.0,
                math::precise::sigmoid,
                |x| 1.0 / (1.0 + libm::exp(-x)),
                false,
            ),
            2e-7,
        ),
    ];
    for (name, error, most) in errors {
        println!("{name}: {error:.2e}");
        assert!(
            error > 1e-8,
            "{name}: an f32 function cannot be this good: nothing was compared"
        );
        assert!(error < most, "{name}: {error:e}");
    }
}

#[test]
fn ends_and_nan_pass_through() {
    assert_eq!(math::exp(200.0), f32::INFINITY);
    assert!(math::exp(-200.0) < 1e-38);
    assert_eq!(math::exp(0.0), 1.0);
    for f in [
        math::exp,
        math::erf,
        math::ln_1p,
        math::precise::tanh,
        math::precise::sigmoid,
    ] {
        assert!(f(f32::NAN).is_nan());
    }
    assert_eq!(math::precise::tanh(f32::INFINITY), 1.0);
    assert_eq!(math::precise::tanh(f32::NEG_INFINITY), -1.0);
}

#[test]
fn logarithms_have_limits_and_hold_from_the_smallest_to_the_largest() {
    assert_eq!(math::ln(0.0), f32::NEG_INFINITY);
    assert_eq!(math::ln(f32::INFINITY), f32::INFINITY);
    assert!(math::ln(-1.0).is_nan() && math::ln(f32::NAN).is_nan());
    let mut x = f32::MIN_POSITIVE;
    while x < 1e38 {
        let exact = libm::log(x.into());
        let error = (f64::from(math::ln(x)) - exact).abs();
        assert!(error < 3e-7 * (1.0 + exact.abs()), "{x:e}: {error:e}");
        x *= 1.0137;
    }
}

#[test]
fn roots_have_limits_at_zero_and_infinity() {
    assert_eq!(math::root(0.0), 0.0);
    assert_eq!(math::root(1e-40), 0.0);
    assert_eq!(math::root(f32::INFINITY), f32::INFINITY);
    assert_eq!(math::reciprocal_root(0.0), f32::INFINITY);
    assert_eq!(math::reciprocal_root(f32::INFINITY), 0.0);
    for x in [-1.0, -1e-40, f32::NEG_INFINITY, f32::NAN] {
        assert!(math::root(x).is_nan(), "{x}");
        assert!(math::reciprocal_root(x).is_nan(), "{x}");
    }
}
