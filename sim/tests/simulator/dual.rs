//! [`Dual`] against num-dual: values and gradients of every operation, at points across its domain.

use num_dual::{Dual64, DualNum};
use sinew_sim::{Dual, Scalar};

/// One function of two numbers, written in each type's own words.
struct Case {
    name: &'static str,
    ours: fn(Dual<2>, Dual<2>) -> Dual<2>,
    theirs: fn(Dual64, Dual64) -> Dual64,
}

macro_rules! same_words {
    ($($name:literal: |$x:ident, $y:ident| $body:expr),* $(,)?) => {
        [$(Case { name: $name, ours: |$x, $y| $body, theirs: |$x, $y| $body }),*]
    };
}

#[test]
fn every_operation_agrees_with_num_dual() {
    let cases = same_words![
        "sum": |x, y| x + y,
        "difference": |x, y| x - y,
        "product": |x, y| x * y,
        "quotient": |x, y| x / y,
        "negation": |x, y| -x + y,
        "with numbers": |x, y| ((x + 2.0) * 3.0 - 0.5) / 7.0 + y,
        "assignment": |x, y| { let mut z = x; z += y; z -= x * y; z },
        "sine": |x, y| (x * y).sin(),
        "cosine": |x, y| (x * y + 0.3).cos(),
        "exponential": |x, y| (-(x * x) / y + x).exp(),
        "logarithm": |x, y| (x * x + y).ln(),
        "tangent": |x, y| (x - y).tanh(),
        "root": |x, y| (x * x + y).sqrt(),
    ];
    for case in cases {
        for i in 0..60 {
            let (a, b) = (-1.45 + 0.05 * f64::from(i), 1.7 - 0.02 * f64::from(i));
            let ours = (case.ours)(Dual::variable(a, 0), Dual::variable(b, 1));
            let by_x = (case.theirs)(Dual64::new(a, 1.0), Dual64::new(b, 0.0));
            let by_y = (case.theirs)(Dual64::new(a, 0.0), Dual64::new(b, 1.0));
            let near = |ours: f64, theirs: f64| {
                let error = (ours - theirs).abs();
                assert!(
                    error <= 4e-15 * (1.0 + theirs.abs()),
                    "{} at {a}, {b}",
                    case.name
                );
            };
            near(ours.value, by_x.re);
            near(ours.derivative[0], by_x.eps);
            near(ours.derivative[1], by_y.eps);
            assert!(
                by_x.eps.abs() + by_y.eps.abs() > 1e-3,
                "{} is flat",
                case.name
            );
        }
    }
}

#[test]
fn comparisons_look_at_the_value_and_choices_keep_the_gradient() {
    let (small, large) = (Dual::<1>::variable(1.0, 0), Dual::<1>::constant(2.0));
    assert!(small < large && small == Dual::constant(1.0));
    assert_eq!(small.min(large).derivative, [1.0]);
    assert_eq!(small.max(large).derivative, [0.0]);
    assert_eq!((-small).abs().derivative, [1.0]);
}
