//! Properties of the shape that no numbers can break.

use super::*;
use crate::Dual;
use proptest::prelude::*;

fn shape(kind: LawKind, odd: bool) -> LawShape {
    LawShape {
        kind,
        odd,
        reach: 0.3,
        length: 1.5,
        width: 0.7,
    }
}

/// Numbers of a law and whether it is odd.
fn law(range: std::ops::Range<f64>) -> impl Strategy<Value = (bool, LawKind, Vec<f64>)> {
    let kinds = prop_oneof![Just(LawKind::Spring), Just(LawKind::Damper)];
    (any::<bool>(), kinds, 1..9usize).prop_flat_map(move |(odd, kind, steps)| {
        let count = if odd { steps + 1 } else { 2 * steps + 1 };
        (
            Just(odd),
            Just(kind),
            prop::collection::vec(range.clone(), count),
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10_000))]

    #[test]
    fn a_law_is_zero_at_rest_and_odd_where_it_says_so(
        (odd, kind, numbers) in law(-50.0..50.0),
        x in -2.0..2.0f64,
    ) {
        let shape = shape(kind, odd);
        prop_assert_eq!(shape.resistance(&numbers, 0.0), 0.0);
        if odd {
            let there = shape.resistance(&numbers, x);
            prop_assert_eq!(shape.resistance(&numbers, -x), -there);
        }
    }

    #[test]
    fn a_monotone_law_rises_and_takes_power_whatever_its_numbers(
        (odd, kind, numbers) in law(0.0..50.0),
        x in -2.0..2.0f64,
        y in -2.0..2.0f64,
    ) {
        let shape = shape(kind, odd);
        let force = |x: f64| shape.resistance(&numbers, x);
        prop_assert!(force(x) * x >= 0.0);
        // Rounding: a level stretch is the same sum of other terms.
        let slack = 1e-12 * (force(x).abs() + force(y).abs());
        prop_assert!((force(x) - force(y)) * (x - y) >= -slack);
    }

    #[test]
    fn a_law_is_continuous_with_its_slope_and_never_steeper_than_its_bound(
        (odd, kind, numbers) in law(0.0..50.0),
        x in -2.0..2.0f64,
    ) {
        let shape = shape(kind, odd);
        let force = |x: f64| shape.resistance(&numbers, x);
        let h = 1e-7;
        let slope = (force(x + h) - force(x - h)) / (2.0 * h);
        let bound = shape.steepest(&numbers, x.abs() + h);
        prop_assert!(slope.abs() <= bound * (1.0 + 1e-6) + 1e-6, "{} {}", slope, bound);
        let exact = shape.resistance(
            &numbers.iter().map(|&p| Dual::<1>::constant(p)).collect::<Vec<_>>(),
            Dual::variable(x, 0),
        );
        prop_assert_eq!(exact.value, force(x));
        // The slope is straight on both sides of a knot and meets there.
        prop_assert!((exact.derivative[0] - slope).abs() <= 1e-4 * (1.0 + bound), "{}", slope);
    }

    #[test]
    fn derivatives_by_the_numbers_are_those_of_differences(
        (odd, kind, numbers) in law(1.0..50.0),
        x in -1.0..1.0f64,
        which in 0..17usize,
    ) {
        let shape = shape(kind, odd);
        let which = which % numbers.len();
        let dual: Vec<Dual<1>> = (numbers.iter().enumerate())
            .map(|(k, &p)| if k == which { Dual::variable(p, 0) } else { Dual::constant(p) })
            .collect();
        let exact = shape.resistance(&dual, Dual::constant(x)).derivative[0];
        let changed = |by: f64| {
            let mut numbers = numbers.clone();
            numbers[which] += by;
            shape.resistance(&numbers, x)
        };
        let h = 1e-6;
        let by = (changed(h) - changed(-h)) / (2.0 * h);
        // Beyond the reach the slope counts only where it rises: a kink that a difference blurs.
        let last = numbers.len() - 1;
        let kink = (numbers[last] - numbers[last - 1]).abs() < 2.0 * h
            || (numbers[1] - numbers[0]).abs() < 2.0 * h;
        prop_assert!(kink || (exact - by).abs() <= 1e-6 * (1.0 + exact.abs()), "{} {}", exact, by);
    }
}

#[test]
fn numbers_straight_over_the_square_are_a_cubic_spring_within_the_reach_and_beyond() {
    let shape = LawShape {
        length: 1.0,
        width: 1.0,
        ..shape(LawKind::Spring, true)
    };
    let (k, cubic) = (3.0, 20.0);
    let places = shape.places(9);
    let numbers: Vec<f64> = (places.iter()).map(|x| k + 3.0 * cubic * x * x).collect();
    for x in [-0.7, -0.3, -0.123, 0.0, 0.01, 0.2, 0.3, 0.31, 0.9] {
        let wanted = k * x + cubic * x * x * x;
        assert!(
            (shape.resistance(&numbers, x) - wanted).abs() < 1e-13,
            "{x}"
        );
    }
}

#[test]
fn numbers_straight_over_the_speed_are_a_damper_with_quadratic_drag() {
    let shape = LawShape {
        length: 1.0,
        width: 1.0,
        ..shape(LawKind::Damper, true)
    };
    let (c, drag) = (0.4, 7.0);
    let places = shape.places(9);
    let numbers: Vec<f64> = places.iter().map(|v| c + 2.0 * drag * v).collect();
    for v in [-0.8f64, -0.3, -0.05, 0.0, 0.02, 0.29, 1.1] {
        let wanted = c * v + drag * v * v.abs();
        assert!(
            (shape.resistance(&numbers, v) - wanted).abs() < 1e-13,
            "{v}"
        );
    }
}

#[test]
fn a_softening_law_goes_on_along_its_tangent_and_never_turns_back() {
    let shape = LawShape {
        length: 1.0,
        width: 1.0,
        ..shape(LawKind::Spring, true)
    };
    let numbers = [5.0, 4.0, 2.0];
    let force = |x: f64| shape.resistance(&numbers, x);
    for x in [0.3, 0.5, 3.0] {
        assert!(
            (force(x) - force(0.3) - 2.0 * (x - 0.3)).abs() < 1e-12,
            "{x}"
        );
    }
    // One that turned down within the reach is level beyond.
    let falling = [5.0, 1.0, -2.0];
    let level = shape.resistance(&falling, 0.3);
    assert_eq!(shape.resistance(&falling, 5.0), level);
}

#[test]
fn twice_the_length_and_three_times_the_width_is_six_pieces() {
    // Two pieces in a row share the extension; three side by side add their forces.
    let one = LawShape {
        length: 1.0,
        width: 1.0,
        ..shape(LawKind::Spring, true)
    };
    let numbers = [5.0, 7.0, 16.0];
    let six = LawShape {
        length: 2.0,
        width: 3.0,
        ..one
    };
    for x in [-0.5, 0.1, 0.4, 1.3] {
        let wanted = 3.0 * one.resistance(&numbers, 0.5 * x);
        assert!((six.resistance(&numbers, x) - wanted).abs() < 1e-12);
    }
}
