//! The PID as a baseline controller (docs/explanation/controller.md, eq. 12).

use sinew_mpc::feedback::pid::{PidGains, PidState};

use crate::closed_loop::baseline::BaselineController;
use crate::tuning::optimise::Range;

impl BaselineController for PidState {
    const NAME: &'static str = "PID";

    fn ranges() -> Vec<Range> {
        vec![
            Range::logarithmic(1e-2, 1e4),  // kp, input ranges an output range
            Range::logarithmic(1e-3, 1e3),  // ki / kp, 1/s
            Range::logarithmic(1e-4, 1e1),  // kd / kp, s
            Range::logarithmic(0.1, 30.0),  // filter, periods
            Range::linear(0.0, 1.5),        // reference in P
            Range::linear(0.0, 1.5),        // reference in D
            Range::logarithmic(0.5, 200.0), // anti-windup, periods
        ]
    }

    /// Gentle to fierce, with the integral slow and fast; and an integral with little else, which
    /// suits a plant that follows its input.
    fn starts() -> Vec<Vec<f64>> {
        let start = |kp, ki, kd| vec![kp, ki, kd, 1.0, 1.0, 1.0, 10.0];
        let of = |kp| [start(kp, 1.0, 0.1), start(kp, 10.0, 0.03)];
        let gains = [0.3, 3.0, 30.0, 300.0, 3000.0].into_iter();
        let integral = [0.03, 0.3].map(|kp| start(kp, 100.0, 0.003));
        gains.flat_map(of).chain(integral).collect()
    }

    fn gains(g: &[f64], (input, output): (f64, f64), period_s: f64) -> PidGains {
        let unit = input / output;
        PidGains {
            kp: (g[0] * unit) as f32,
            ki: (g[1] * g[0] * unit) as f32,
            kd: (g[2] * g[0] * unit) as f32,
            filter_s: (g[3] * period_s) as f32,
            proportional_setpoint_weight: g[4] as f32,
            derivative_setpoint_weight: g[5] as f32,
            tracking_time_s: (g[6] * period_s) as f32,
        }
    }

    fn named(gains: &PidGains) -> Vec<(&'static str, f64)> {
        [
            ("kp", gains.kp),
            ("ki", gains.ki),
            ("kd", gains.kd),
            ("filter_s", gains.filter_s),
            ("proportional_setpoint", gains.proportional_setpoint_weight),
            ("derivative_setpoint", gains.derivative_setpoint_weight),
            ("tracking_time_s", gains.tracking_time_s),
        ]
        .map(|(name, value)| (name, f64::from(value)))
        .into()
    }
}
