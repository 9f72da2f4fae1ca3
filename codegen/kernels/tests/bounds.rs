//! Bounds, larger and smaller values, and logarithms of softmax in f32: no digit is lost far out.

use sinew_kernels::layers::activation::Clip;
use sinew_kernels::layers::elementwise::{activate_back, activate_from};
use sinew_kernels::layers::extreme::{extreme, extreme_back};
use sinew_kernels::layers::log_softmax::{log_softmax, log_softmax_back};
use sinew_kernels::number::Dual;

#[test]
fn a_clipped_value_has_its_own_bits_and_a_slope_of_one_inside() {
    let x = [-3e7, -1.0 / 3.0, 1e-9, 0.7, 4e7, f32::NAN];
    let far = Clip {
        low: -1e6,
        high: 1e7,
    };
    let mut y = [0.0; 6];
    activate_from(far, &x, &mut y);
    assert_eq!(y[..5], [-1e6, x[1], x[2], x[3], 1e7]);
    assert!(y[5].is_nan());
    let mut t = [[2.0]; 6];
    activate_back(far, &x, &y, &mut t);
    assert_eq!(t[..5], [[0.0], [2.0], [2.0], [2.0], [0.0]]);
    let open = Clip {
        low: f32::NEG_INFINITY,
        high: 0.5,
    };
    activate_from(open, &x, &mut y);
    assert_eq!(y[..5], [x[0], x[1], x[2], 0.5, 0.5]);
}

#[test]
fn the_larger_of_two_values_is_one_of_them_to_the_bit() {
    let (a, b) = ([0.1, -0.3, 1e-7, 5.0], [1e8, -1e8, -1e8, 5.0]);
    let mut most = a;
    extreme::<_, 4, true>(&b, &mut most);
    assert_eq!(most, [1e8, -0.3, 1e-7, 5.0]);
    let mut least = a;
    extreme::<_, 4, false>(&b, &mut least);
    assert_eq!(least, [0.1, -1e8, -1e8, 5.0]);
    let (mut of_a, mut of_b) = ([[9.0]; 4], [[9.0]; 4]);
    extreme_back::<_, 4, 1, true, true>(&a, &b, &[[2.0]; 4], &mut of_a);
    extreme_back::<_, 4, 1, true, false>(&a, &b, &[[2.0]; 4], &mut of_b);
    assert_eq!(of_a, [[0.0], [2.0], [2.0], [2.0]]);
    assert_eq!(of_b, [[2.0], [0.0], [0.0], [0.0]]);
    for side in [[f32::NAN, 1.0], [1.0, f32::NAN]] {
        let mut one = [side[0]];
        extreme::<_, 1, true>(&[side[1]], &mut one);
        assert!(one[0].is_nan());
    }
}

/// Beside double precision, from the largest value to a thousand below it.
#[test]
fn a_logarithm_of_softmax_is_a_difference_far_below_the_largest_value() {
    let z = [3.0_f32, 2.5, -100.0, -1000.0];
    let mut a = z;
    log_softmax::<_, 4, 4>(&mut a);
    let wide = z.map(f64::from);
    let sum: f64 = wide.iter().map(|z| (z - 3.0).exp()).sum();
    for (a, z) in a.iter().zip(wide) {
        let exact = z - 3.0 - sum.ln();
        assert!(
            (f64::from(*a) - exact).abs() < 2e-7 * exact.abs(),
            "{a} {exact}"
        );
    }
    let mut t = [[0.0], [0.0], [1.0], [0.0]];
    log_softmax_back::<_, 4, 4, 1>(&a, &mut t);
    for (place, (t, z)) in t.iter().zip(wide).enumerate() {
        let share = (z - 3.0).exp() / sum;
        let exact = if place == 2 { 1.0 - share } else { -share };
        assert!((f64::from(t[0]) - exact).abs() < 3e-7, "{place}: {}", t[0]);
    }
    // The same derivative, forward.
    let mut dual = z.map(|value| Dual {
        value,
        tangent: 0.0,
    });
    dual[1].tangent = 1.0;
    log_softmax::<_, 4, 4>(&mut dual);
    let share = (-0.5_f64).exp() / sum;
    assert!((f64::from(dual[2].tangent) + share).abs() < 3e-7);
}
