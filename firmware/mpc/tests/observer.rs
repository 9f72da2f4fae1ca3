//! The observer before the history: a part of what is measured, the rest of what was predicted
//! (docs/explanation/controller.md, eq. 10c).

use sinew_mpc::estimator::{Estimator, Sample};
use sinew_mpc::model::{Jacobian, Model, Regressor};
use sinew_mpc::tuning::Tuning;

/// An output that halves in each step, pushed by its input; L in percent.
struct Halving<const PERCENT: u32>;

impl<const PERCENT: u32> Model<1, 1, 0, 1, 2> for Halving<PERCENT> {
    type Trace = ();
    const TRACE: () = ();

    fn predict(&self, x: &Regressor<1, 1, 0, 1, 2>, (): &mut ()) -> [f32; 1] {
        [0.5 * x.y[0][0] + x.u[0][0]]
    }

    fn jacobian(&self, (): &(), jacobian: &mut Jacobian<1, 1, 1, 2>) {
        jacobian.u[0] = [[1.0]];
        jacobian.y[0] = [[0.5]];
    }
}

impl<const PERCENT: u32> Tuning for Halving<PERCENT> {
    const OBSERVER_GAIN: f32 = PERCENT as f32 / 100.0;
}

/// The estimator after `measured`, with a command of `u` at every step and no estimate of a
/// disturbance.
fn after<const PERCENT: u32>(u: f32, measured: &[f32]) -> Estimator<1, 1, 0, 1, 2> {
    let mut estimator = Estimator::new([u]);
    for y in measured {
        estimator.observe(&Halving::<PERCENT>, &[*y], &[], 0.0, 3);
        estimator.apply(&[u]);
    }
    estimator
}

#[test]
fn a_part_of_what_is_measured_enters_the_history_and_the_rest_is_predicted() {
    // 0.8 fills the history. Predicted: 0.5 * 0.8 + 0.1 = 0.5, measured 0.9.
    let estimator = after::<25>(0.1, &[0.8, 0.9]);
    let [[newest], [before]] = estimator.regressor().y;
    assert!((newest - (0.5 + 0.25 * 0.4)).abs() < 1e-6, "{newest}");
    assert_eq!(before, 0.8);
}

#[test]
fn without_an_observer_the_history_has_the_bits_of_what_was_measured() {
    let measured = [0.3, 0.1 + 0.2, -7.123_456_7, 1e-30];
    let estimator = after::<100>(0.1, &measured);
    let [[newest], [before]] = estimator.regressor().y;
    assert_eq!(
        [newest.to_bits(), before.to_bits()],
        [measured[3].to_bits(), measured[2].to_bits()]
    );
}

#[test]
fn noise_of_a_model_that_is_right_is_less_in_the_history() {
    // At rest at 0.2; what is measured lies 0.1 above or below, drawn by a linear congruence.
    let mut seed = 1_u32;
    let mut estimator = Estimator::new([0.1]);
    let mut squares = 0.0;
    for _ in 0..2000 {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = if seed >> 31 == 0 { 0.1 } else { -0.1 };
        estimator.observe(&Halving::<30>, &[0.2 + noise], &[], 0.0, 3);
        estimator.apply(&[0.1]);
        let off = estimator.regressor().y[0][0] - 0.2;
        squares += off * off;
    }
    // Of the variance L^2 / (1 - (a (1 - L))^2) with a = 0.5 is left: 0.1026.
    let left = squares / 2000.0 / 0.01;
    assert!((left - 0.1026).abs() < 0.015, "{left}");
}

#[test]
fn what_is_missing_is_predicted_as_it_is_without_an_observer() {
    let mut estimator = after::<25>(0.1, &[0.8, 0.9]);
    let held = estimator.regressor().y[0][0];
    let sample = estimator.observe(&Halving::<25>, &[f32::NAN], &[], 0.0, 3);
    assert_eq!(sample, Sample::Predicted);
    assert_eq!(estimator.regressor().y[0][0], 0.5 * held + 0.1);
}
