//! RISE, the robust integral of the sign of the error: continuous, and yet it rejects any smooth
//! disturbance whose rate beta exceeds, a ramp included, which leaves a PID with an error. B. Xian,
//! D. M. Dawson, M. S. de Queiroz, J. Chen, "A continuous asymptotic tracking control strategy for
//! uncertain nonlinear systems", IEEE Transactions on Automatic Control 49(7), 2004, eq. 9;
//! docs/explanation/controller.md, eq. 13.
//!
//! e2 = d(c r - y)/dt + alpha1 e with e = r - y, u = u(0) + gain (e2 - e2(0)) + integral of
//! (gain alpha2 e2 + beta sgn(e2)) + back-calculation. Outside the integral alpha1 e is
//! alpha1 (b r - y). Without the weight b a static spring force would require a steady-state
//! error; without c a step of the reference is a blow. With b = c = 1 it is the paper's law.

use crate::feedback::{Feedback, Law, back_calculation};

/// Gains of one channel, physical units: `input` is a measured output, `output` a command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RiseGains {
    /// ks + 1 of the paper, `output/input * s`; the "+ 1" has a meaning in the paper's units only.
    pub gain: f32,
    /// alpha1: decay rate of e once e2 is zero, `s^-1`.
    pub alpha1: f32,
    /// alpha2: gain of the integral of e2, `s^-1`.
    pub alpha2: f32,
    /// beta: the fastest disturbance that is rejected, `output * s^-1`.
    pub beta: f32,
    /// Weight b of the reference in alpha1 (b r - y) outside the integral; 1: the paper's law.
    pub proportional_setpoint_weight: f32,
    /// Weight c of the reference in d(c r - y)/dt; 1: the paper's law.
    pub derivative_setpoint_weight: f32,
    /// Time constant of the filter of d(c r - y)/dt, seconds.
    pub filter_s: f32,
    /// Time constant of the anti-windup, seconds; shorter than a period: one period.
    pub tracking_time_s: f32,
}

/// State of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RiseState {
    integral: f32,
    /// d(c r - y)/dt, filtered.
    slope: f32,
    /// The last c r - y, and e2(0) with the weighted reference; none before the first sample.
    begun: Option<(f32, f32)>,
}

impl Law for RiseState {
    type Gains = RiseGains;

    fn new(applied: f32) -> Self {
        Self {
            integral: applied,
            slope: 0.0,
            begun: None,
        }
    }

    fn advance(&mut self, gains: &RiseGains, period_s: f32, reference: f32, y: f32) -> f32 {
        let error = reference - y;
        let weighted = gains.alpha1 * (gains.proportional_setpoint_weight * reference - y);
        let differenced = gains.derivative_setpoint_weight * reference - y;
        let Some((before, origin)) = self.begun else {
            // t = 0: no slope yet, and nothing integrated.
            self.begun = Some((differenced, weighted));
            return self.integral;
        };
        let window = gains.filter_s + period_s;
        self.slope = (gains.filter_s * self.slope + (differenced - before)) / window;
        self.begun = Some((differenced, origin));
        let e2 = self.slope + gains.alpha1 * error;
        self.integral += period_s * (gains.gain * gains.alpha2 * e2 + gains.beta * sign(e2));
        gains.gain * (self.slope + weighted - origin) + self.integral
    }

    fn anti_windup(&mut self, gains: &RiseGains, period_s: f32, unsaturated: f32, applied: f32) {
        self.integral +=
            back_calculation(gains.tracking_time_s, period_s) * (applied - unsaturated);
    }
}

/// sgn with sgn(0) = 0, which `f32::signum` has not.
fn sign(x: f32) -> f32 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// One RISE per channel: output i to command i.
///
/// ```
/// use sinew_mpc::Limits;
/// use sinew_mpc::feedback::rise::{Rise, RiseGains};
///
/// let gains = RiseGains {
///     gain: 0.5,
///     alpha1: 4.0,
///     alpha2: 1.0,
///     beta: 0.2,
///     proportional_setpoint_weight: 1.0,
///     derivative_setpoint_weight: 1.0,
///     filter_s: 0.02,
///     tracking_time_s: 0.5,
/// };
/// let limits = Limits { lower: [-2.0], upper: [2.0], rate: [0.2], safe: [0.0] };
/// let mut rise = Rise::new([gains], 0.01, limits, 5);
/// // A first-order lag under a ramp of a load, y' = (u - y - t / 10) / 0.5 s.
/// let mut y = 0.0;
/// for k in 0..1000 {
///     let [u] = rise.step(&[y], &[0.5]);
///     y += 0.01 / 0.5 * (u - y - 0.001 * k as f32);
/// }
/// assert!((y - 0.5).abs() < 0.02);
/// ```
pub type Rise<const NU: usize> = Feedback<RiseState, NU>;
