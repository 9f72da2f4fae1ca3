//! The PID that everything else is compared with: two degrees of freedom, filtered derivative,
//! back-calculation against windup, and the same limits through the same code.
//!
//! u = P + I + D with P = kp (b r - y), dI/dt = ki (r - y) + (u_limited - u) / tracking_time,
//! D = kd s / (filter s + 1) (c r - y), discretised by backward Euler (docs/mpc.md, eq. 12).

use crate::safety::{Limiter, Limits};

/// What a tuner chooses, per channel; physical units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidGains {
    /// Proportional gain.
    pub kp: f32,
    /// Integral gain, per second.
    pub ki: f32,
    /// Derivative gain, seconds.
    pub kd: f32,
    /// Time constant of the derivative's filter, seconds.
    pub filter_s: f32,
    /// Weight b of the reference in P.
    pub proportional_setpoint: f32,
    /// Weight c of the reference in D.
    pub derivative_setpoint: f32,
    /// Time constant of the anti-windup, seconds; shorter than a period: one period. 0: the
    /// integral is corrected at once.
    pub tracking_time_s: f32,
}

/// One channel's memory. The integral starts at the command that is applied, so the loop closes
/// without a bump.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PidState {
    integral: f32,
    derivative: f32,
    /// c r - y of the last sample; none before the first.
    differenced: Option<f32>,
}

impl PidState {
    /// At rest at `applied`.
    pub const fn new(applied: f32) -> Self {
        Self {
            integral: applied,
            derivative: 0.0,
            differenced: None,
        }
    }

    /// The command before limiting.
    pub fn advance(&mut self, gains: &PidGains, period_s: f32, reference: f32, y: f32) -> f32 {
        self.integral += gains.ki * period_s * (reference - y);
        let differenced = gains.derivative_setpoint * reference - y;
        let change = differenced - self.differenced.unwrap_or(differenced);
        let window = gains.filter_s + period_s;
        self.derivative = (gains.filter_s * self.derivative + gains.kd * change) / window;
        self.differenced = Some(differenced);
        gains.kp * (gains.proportional_setpoint * reference - y) + self.integral + self.derivative
    }

    /// Back-calculation: the integral gives way by the part of the wish that was not applied.
    pub fn settle(&mut self, gains: &PidGains, period_s: f32, wish: f32, applied: f32) {
        let share = if gains.tracking_time_s > period_s {
            period_s / gains.tracking_time_s
        } else {
            1.0
        };
        self.integral += share * (applied - wish);
    }
}

/// One PID per channel: output i to command i.
#[derive(Clone, Debug)]
pub struct Pid<const NU: usize> {
    /// May change between two steps.
    pub gains: [PidGains; NU],
    period_s: f32,
    state: [PidState; NU],
    limiter: Limiter<NU>,
    gap_limit: u16,
    missing_run: u16,
}

impl<const NU: usize> Pid<NU> {
    /// At rest at the safe command. `gap_limit`: missing samples in a row over which the command is
    /// held, before the safe command.
    pub const fn new(
        gains: [PidGains; NU],
        period_s: f32,
        limits: Limits<NU>,
        gap_limit: u16,
    ) -> Self {
        let limiter = Limiter::new(limits);
        let mut state = [PidState::new(0.0); NU];
        let mut i = 0;
        while i < NU {
            state[i] = PidState::new(limiter.applied()[i]);
            i += 1;
        }
        Self {
            gains,
            period_s,
            state,
            limiter,
            gap_limit,
            missing_run: 0,
        }
    }

    /// The command for this sample, physical units, inside the limits whatever comes in. A channel
    /// whose output or reference is not finite holds its command; when that lasts longer than
    /// `gap_limit`, all channels go to the safe command.
    pub fn step(&mut self, y: &[f32; NU], reference: &[f32; NU]) -> [f32; NU] {
        let usable = |i: usize| y[i].is_finite() && reference[i].is_finite();
        if (0..NU).all(usable) {
            self.missing_run = 0;
        } else {
            self.missing_run = self.missing_run.saturating_add(1);
        }
        if self.missing_run > self.gap_limit {
            let applied = self.limiter.retreat();
            self.restart(&applied);
            return applied;
        }
        let mut wish = *self.limiter.applied();
        for i in 0..NU {
            if usable(i) {
                wish[i] = self.state[i].advance(&self.gains[i], self.period_s, reference[i], y[i]);
            }
        }
        let applied = self.limiter.limit(&wish);
        for i in 0..NU {
            self.state[i].settle(&self.gains[i], self.period_s, wish[i], applied[i]);
            if !wish[i].is_finite() {
                self.state[i] = PidState::new(applied[i]);
            }
        }
        applied
    }

    /// Forgets the past; the command applied last stays, so that the rate holds across a reset.
    pub fn reset(&mut self) {
        let applied = *self.limiter.applied();
        self.restart(&applied);
        self.missing_run = 0;
    }

    fn restart(&mut self, applied: &[f32; NU]) {
        self.state = applied.map(PidState::new);
    }
}
