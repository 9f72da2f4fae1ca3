//! Slopes of activations whose parameters may be negative, and of those of positive numbers,
//! against differences.

use sinew_kernels::layers::activation::{
    Elu, HardSigmoid, LeakyRelu, Logarithm, Reciprocal, Relu, Root,
};
use sinew_kernels::layers::elementwise::{Elementwise, activate_back, activate_from};

/// Largest difference between the slope and a difference of values, of 1 + |slope|.
fn worst(g: impl Elementwise, points: &[f32]) -> f32 {
    let mut worst = 0.0_f32;
    for &z in points {
        let h = 1e-2 * z.abs();
        let (z, beside) = ([z], [[z - h], [z + h]]);
        let mut a = [0.0];
        activate_from(g, &z, &mut a);
        let mut t = [[1.0]];
        activate_back(g, &z, &a, &mut t);
        let [below, above] = beside.map(|z| {
            let mut a = [0.0_f32];
            activate_from(g, &z, &mut a);
            a[0]
        });
        let slope = (above - below) / (2.0 * h);
        worst = worst.max((t[0][0] - slope).abs() / (1.0 + slope.abs()));
    }
    worst
}

#[test]
fn slopes_have_the_sign_of_their_parameters() {
    let points = [-2.3, -1.1, -0.4, 0.3, 0.9, 2.6];
    for alpha in [-1.0, -0.6, 0.0, 0.2] {
        let error = worst(LeakyRelu { alpha }, &points);
        assert!(error < 1e-3, "leaky ReLU of {alpha}: {error}");
        let error = worst(Elu { alpha, scale: 1.2 }, &points);
        assert!(error < 1e-3, "ELU of {alpha}: {error}");
    }
    assert!(worst(Relu, &points) < 1e-3);
    let falling = HardSigmoid {
        alpha: -0.3,
        beta: 0.5,
    };
    assert!(worst(falling, &points) < 1e-3);
}

#[test]
fn slopes_of_functions_of_positive_numbers_are_exact() {
    let points = [0.02, 0.3, 1.0, 4.5, 90.0];
    assert!(worst(Root, &points) < 1e-3);
    assert!(worst(Reciprocal, &points) < 1e-3);
    assert!(worst(Logarithm, &points) < 1e-3);
}
