//! The PID that everything else is compared with: two degrees of freedom, filtered derivative,
//! back-calculation against windup, and the same limits through the same code.
//!
//! u = P + I + D with P = kp (b r - y), dI/dt = ki (r - y) + (u_limited - u) / tracking_time, D =
//! kd s / (filter s + 1) (c r - y), discretised by backward Euler (docs/explanation/controller.md,
//! eq. 12).

use crate::feedback::{Feedback, Law, back_calculation};

/// Gains of one channel, physical units: `input` is a measured output, `output` a command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidGains {
    /// Proportional gain, `output/input`.
    pub kp: f32,
    /// Integral gain, `output/input * s^-1`.
    pub ki: f32,
    /// Derivative gain, `output/input * s`.
    pub kd: f32,
    /// Time constant of the derivative's filter, seconds.
    pub filter_s: f32,
    /// Weight b of the reference in P.
    pub proportional_setpoint_weight: f32,
    /// Weight c of the reference in D.
    pub derivative_setpoint_weight: f32,
    /// Time constant of the anti-windup, seconds; shorter than a period: one period. 0: the
    /// integral is corrected at once.
    pub tracking_time_s: f32,
}

/// State of one channel. The integral starts at the command that is applied, so the loop closes
/// without a bump.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidState {
    integral: f32,
    derivative: f32,
    /// c r - y of the last sample; none before the first.
    differenced: Option<f32>,
}

impl Law for PidState {
    type Gains = PidGains;

    fn new(applied: f32) -> Self {
        Self {
            integral: applied,
            derivative: 0.0,
            differenced: None,
        }
    }

    fn advance(&mut self, gains: &PidGains, period_s: f32, reference: f32, y: f32) -> f32 {
        self.integral += gains.ki * period_s * (reference - y);
        let differenced = gains.derivative_setpoint_weight * reference - y;
        let change = differenced - self.differenced.unwrap_or(differenced);
        let window = gains.filter_s + period_s;
        self.derivative = (gains.filter_s * self.derivative + gains.kd * change) / window;
        self.differenced = Some(differenced);
        gains.kp * (gains.proportional_setpoint_weight * reference - y)
            + self.integral
            + self.derivative
    }

    fn anti_windup(&mut self, gains: &PidGains, period_s: f32, unsaturated: f32, applied: f32) {
        self.integral +=
            back_calculation(gains.tracking_time_s, period_s) * (applied - unsaturated);
    }
}

/// One PID per channel: output i to command i.
///
/// ```
/// use sinew_mpc::Limits;
/// use sinew_mpc::feedback::pid::{Pid, PidGains};
///
/// let gains = PidGains {
///     kp: 2.0,
///     ki: 4.0,
///     kd: 0.0,
///     filter_s: 0.0,
///     proportional_setpoint_weight: 1.0,
///     derivative_setpoint_weight: 0.0,
///     tracking_time_s: 0.5,
/// };
/// let limits = Limits { lower: [-1.0], upper: [1.0], rate: [0.2], safe: [0.0] };
/// let mut pid = Pid::new([gains], 0.01, limits, 5);
/// // A first-order lag, y' = (u - y) / 0.5 s.
/// let mut y = 0.0;
/// for _ in 0..500 {
///     let [u] = pid.step(&[y], &[0.5]);
///     y += 0.01 / 0.5 * (u - y);
/// }
/// assert!((y - 0.5).abs() < 1e-3);
/// ```
pub type Pid<const NU: usize> = Feedback<PidState, NU>;
