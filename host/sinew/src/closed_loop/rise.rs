//! RISE as a baseline controller (docs/explanation/controller.md, eq. 13).

use sinew_mpc::feedback::rise::{RiseGains, RiseState};

use crate::closed_loop::baseline::BaselineController;
use crate::tuning::optimise::Range;

impl BaselineController for RiseState {
    const NAME: &'static str = "RISE";

    /// In the terms of the PID that it is without its sign, so that both search the same ground:
    /// kp = gain (alpha1 + alpha2), ki / kp about alpha2, kd / kp about 1 / alpha1.
    fn ranges() -> Vec<Range> {
        vec![
            Range::logarithmic(1e-2, 1e4), // gain alpha1, input ranges an output range
            Range::logarithmic(1e-1, 1e4), // alpha1, 1/s
            Range::logarithmic(1e-3, 1e3), // alpha2, 1/s
            Range::logarithmic(1e-4, 1e2), // beta, input ranges a second
            Range::linear(0.0, 1.5),       // reference in alpha1 e outside the integral
            Range::linear(0.0, 1.5),       // reference in the derivative
            Range::logarithmic(0.1, 30.0), // filter, periods
            Range::logarithmic(0.5, 200.0), // anti-windup, periods
        ]
    }

    /// Gentle to fierce, with the integral slow and fast, and nearly an integral alone, as for the
    /// PID.
    fn starts() -> Vec<Vec<f64>> {
        let start = |kp, alpha2, alpha1| vec![kp, alpha1, alpha2, 0.1, 1.0, 1.0, 1.0, 10.0];
        let of = |kp| [start(kp, 1.0, 10.0), start(kp, 10.0, 33.0)];
        let gains = [0.3, 3.0, 30.0, 300.0, 3000.0].into_iter();
        let integral = [0.03, 0.3].map(|kp| start(kp, 100.0, 330.0));
        gains.flat_map(of).chain(integral).collect()
    }

    fn gains(g: &[f64], (input, output): (f64, f64), period_s: f64) -> RiseGains {
        RiseGains {
            gain: (g[0] / g[1] * input / output) as f32,
            alpha1: g[1] as f32,
            alpha2: g[2] as f32,
            beta: (g[3] * input) as f32,
            proportional_setpoint_weight: g[4] as f32,
            derivative_setpoint_weight: g[5] as f32,
            filter_s: (g[6] * period_s) as f32,
            tracking_time_s: (g[7] * period_s) as f32,
        }
    }

    fn named(gains: &RiseGains) -> Vec<(&'static str, f64)> {
        [
            ("ks_plus_1", gains.gain),
            ("alpha1", gains.alpha1),
            ("alpha2", gains.alpha2),
            ("beta", gains.beta),
            ("proportional_setpoint", gains.proportional_setpoint_weight),
            ("derivative_setpoint", gains.derivative_setpoint_weight),
            ("filter_s", gains.filter_s),
            ("tracking_time_s", gains.tracking_time_s),
        ]
        .map(|(name, value)| (name, f64::from(value)))
        .into()
    }
}
