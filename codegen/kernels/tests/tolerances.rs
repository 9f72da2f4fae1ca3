//! Every tanh that a tolerance may choose, over all numbers: its error, its slope, its ends.

use sinew_kernels::math::{self, coarse, precise, rough, rougher};

/// Name, tanh, sigmoid, stated error of tanh (`Accuracy::error` in
/// codegen/nn/src/emit/accuracy.rs), and by how much the slope `1 - y^2` may differ from the
/// derivative of the kernel itself.
type Kernel = (&'static str, fn(f32) -> f32, fn(f32) -> f32, f64, f64);

const KERNELS: [Kernel; 5] = [
    ("precise", precise::tanh, precise::sigmoid, 2e-7, 1e-5),
    ("quick", math::tanh, math::sigmoid, 2e-6, 3e-5),
    ("coarse", coarse::tanh, coarse::sigmoid, 5e-5, 3e-4),
    ("rough", rough::tanh, rough::sigmoid, 9e-4, 2e-3),
    ("rougher", rougher::tanh, rougher::sigmoid, 3e-3, 1.1e-2),
];

/// 2^20 points within 12 on either side, and as many bit patterns from all that there are but NaN.
fn points() -> impl Iterator<Item = f32> {
    const COUNT: u32 = 1 << 20;
    let near = (0..=COUNT).map(|i| (24.0 * f64::from(i) / f64::from(COUNT) - 12.0) as f32);
    let all = (0..COUNT).map(|i| f32::from_bits(i << 12 | 0x555));
    near.chain(all.filter(|x| !x.is_nan()))
}

fn largest(errors: impl Iterator<Item = f64>) -> f64 {
    // A NaN is the worst there is.
    errors.fold(0.0, |most, error| if error <= most { most } else { error })
}

#[test]
fn values_and_slopes_are_within_what_is_stated() {
    for (name, tanh, sigmoid, stated, own) in KERNELS {
        let off = |f: fn(f32) -> f32, truth: fn(f64) -> f64| {
            largest(points().map(|x| (f64::from(f(x)) - truth(x.into())).abs()))
        };
        let value = off(tanh, libm::tanh);
        let half = off(sigmoid, |x| 1.0 / (1.0 + libm::exp(-x)));
        let slope = |x: f32| 1.0 - f64::from(tanh(x)).powi(2);
        let truth = |x: f32| 1.0 - libm::tanh(x.into()).powi(2);
        let of_slope = largest(points().map(|x| (slope(x) - truth(x)).abs()));
        println!("{name}: {value:.1e}, sigmoid {half:.1e}, slope {of_slope:.1e}");
        assert!(value <= stated, "{name}: {value:e}");
        assert!(
            value > stated / 4.0,
            "{name}: {value:e} is far better than stated: the sweep misses its worst, or the statement is lax"
        );
        assert!(half <= 0.5 * stated + 1e-7, "{name}: sigmoid {half:e}");
        assert!(of_slope <= 2.0 * stated, "{name}: slope {of_slope:e}");

        // Against the kernel's own derivative, by differences of its error; the step is large
        // enough for the rounding of f32.
        const STEP: f32 = 1.0 / 128.0;
        let error = |x: f32| f64::from(tanh(x)) - libm::tanh(x.into());
        let inside = points().filter(|x| x.abs() < 3.0);
        let of_itself = largest(inside.map(|x| {
            let (above, below) = (x + STEP, x - STEP);
            let difference = (error(above) - error(below)) / f64::from(above - below);
            (difference + truth(x) - slope(x)).abs()
        }));
        println!("{name}: the kernel's derivative differs by {of_itself:.1e} from its slope");
        assert!(of_itself <= own, "{name}: {of_itself:e}");
        assert!(of_itself > own / 4.0, "{name}: {of_itself:e} of {own:e}");
    }
}

#[test]
fn it_is_odd_and_bounded_and_its_ends_and_nan_pass() {
    for (name, tanh, sigmoid, stated, _) in KERNELS {
        for x in points() {
            let y = tanh(x);
            assert_eq!(tanh(-x), -y, "{name} at {x:e}");
            assert!(y.abs() <= 1.0, "{name}: tanh({x:e}) = {y:e}");
            assert!(
                (0.0..=1.0).contains(&sigmoid(x)),
                "{name}: sigmoid({x:e}) = {:e}",
                sigmoid(x)
            );
        }
        let close = |found: f32, expected: f64| (f64::from(found) - expected).abs() <= stated;
        assert!(close(tanh(f32::INFINITY), 1.0), "{name}");
        assert!(close(tanh(f32::NEG_INFINITY), -1.0), "{name}");
        assert!(close(sigmoid(f32::NEG_INFINITY), 0.0), "{name}");
        assert_eq!(tanh(0.0).to_bits(), 0, "{name}");
        assert!(
            tanh(f32::NAN).is_nan() && sigmoid(f32::NAN).is_nan(),
            "{name}"
        );
    }
}
