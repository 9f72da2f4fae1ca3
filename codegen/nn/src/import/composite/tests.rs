//! Composed functions against their formulas.

use crate::{Network, NetworkError, evaluate};

fn of(f: impl Fn(&mut Network) -> Result<usize, NetworkError>, x: &[f64]) -> Vec<f64> {
    let mut network = Network::new("n", "x", vec![x.len()]);
    f(&mut network).expect("the function is composed");
    network.validate().expect("the network is valid");
    evaluate::run(&network, x)
}

#[test]
fn powers_are_products_roots_and_reciprocals() {
    for exponent in [1.5, 2.0, 3.0, 7.0, 8.0, 0.5, -0.5, -1.0, -2.0, -3.5, 4.5] {
        let x = [0.3, 1.0, 2.7];
        let found = of(|network| network.power("p", 0, exponent), &x);
        for (x, y) in x.iter().zip(found) {
            let exact = x.powf(f64::from(exponent));
            assert!((y - exact).abs() <= 1e-12 * exact, "{x}^{exponent}: {y}");
        }
    }
    let mut network = Network::new("n", "x", vec![1]);
    for exponent in [0.0, 9.0, 0.3, -2.25, f32::NAN, f32::INFINITY] {
        let error = network.power("p", 0, exponent).expect_err("no such power");
        assert!(error.to_string().contains("a power of"), "{error}");
    }
}

#[test]
fn bounds_and_composed_activations_are_their_formulas() {
    let x = [-4.0, -0.5, 0.0, 0.7, 8.0];
    type Formula = (&'static str, fn(f64) -> f64);
    let formulas: [Formula; 10] = [
        ("relu6", |x| x.clamp(0.0, 6.0)),
        ("hard_tanh", |x| x.clamp(-1.0, 1.0)),
        ("hard_silu", |x| x * (x / 6.0 + 0.5).clamp(0.0, 1.0)),
        ("mish", |x| x * x.exp().ln_1p().tanh()),
        ("log_sigmoid", |x| -(-x).exp().ln_1p()),
        ("squareplus", |x| (x + (x * x + 4.0).sqrt()) / 2.0),
        ("soft_shrink", |x| x - x.clamp(-0.5, 0.5)),
        ("sparse_plus", |x| match x {
            x if x <= -1.0 => 0.0,
            x if x >= 1.0 => x,
            x => (x + 1.0) * (x + 1.0) / 4.0,
        }),
        ("sparse_sigmoid", |x| (0.5 * (x + 1.0)).clamp(0.0, 1.0)),
        ("celu", |x| if x > 0.0 { x } else { x.exp_m1() }),
    ];
    for (name, exact) in formulas {
        let found = of(
            |network| network.named_composite(name, name, 0).expect(name),
            &x,
        );
        for (x, y) in x.iter().zip(found) {
            assert!((y - exact(*x)).abs() < 1e-6, "{name}({x}) = {y}");
        }
    }
    let found = of(
        |network| network.prelu("p", 0, &[0.1, -0.2, 3.0, 1.0, 0.5]),
        &x,
    );
    assert_eq!(found[3..], [0.7, 8.0]);
    assert!((found[0] + 0.4).abs() < 1e-6 && (found[1] - 0.1).abs() < 1e-6);
    assert_eq!(of(|network| network.absolute("a", 0), &x)[..2], [4.0, 0.5]);
}

#[test]
fn zeros_are_put_around_and_values_cut_off() {
    let x = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    let found = of(
        |network| {
            let image = network.reshaped("r", 0, &[2, 3])?;
            network.padded("p", image, &[[1, 0], [-1, 1]])
        },
        &x,
    );
    assert_eq!(found, [0.0, 0.0, 0.0, 2.0, 3.0, 0.0, 5.0, 6.0, 0.0]);
}

/// The bits of an input within the bounds, whatever their size, and of a bound beyond.
#[test]
fn a_bound_takes_no_digit_of_a_value() {
    let x = [-3e7, -1.0 / 3.0, 1e-9, 0.7, 4e7];
    for (low, high) in [(-1e6, 1e6), (-1e5, f32::INFINITY), (f32::NEG_INFINITY, 2e4)] {
        let found = of(|network| network.clipped("clip", 0, low, high), &x);
        let expected = x.map(|x| x.clamp(f64::from(low), f64::from(high)));
        assert_eq!(found, expected, "{low} to {high}");
    }
    let mut open = Network::new("open", "x", vec![2]);
    assert_eq!(open.clipped("clip", 0, f32::MIN, f32::MAX).ok(), Some(0));
    let crossed = of(|network| network.clipped("clip", 0, 2.0, 1.0), &x);
    assert_eq!(crossed, [1.0; 5]);
    let mut network = Network::new("bounded", "x", vec![2]);
    assert!(network.clipped("clip", 0, f32::NAN, 1.0).is_err());
    for largest in [true, false] {
        let bounds = [1e8, -1e8, 0.0, 0.5, -7.0];
        let found = of(|network| network.bounded_each("b", 0, &bounds, largest), &x);
        let one = |(x, b): (f64, f32)| {
            let b = f64::from(b);
            if largest { x.max(b) } else { x.min(b) }
        };
        let expected: Vec<f64> = x.into_iter().zip(bounds).map(one).collect();
        assert_eq!(found, expected);
    }
}
