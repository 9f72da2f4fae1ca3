//! Controllers without a model: one law a channel, output i to command i, and around it what they
//! share: limits by the same code as everything else, anti-windup, missing samples, a start without
//! a bump. A [`policy`] is a network in their place.

pub mod pid;
pub mod policy;
pub mod rise;

use crate::limits::{Limiter, Limits};

/// Control law of one channel and its state; physical units.
pub trait Law: Clone {
    /// Parameters of the law.
    type Gains: Copy;
    /// At rest at `applied`: the first command is near it, so the loop closes without a bump.
    fn new(applied: f32) -> Self;
    /// The command before limiting.
    fn advance(&mut self, gains: &Self::Gains, period_s: f32, reference: f32, y: f32) -> f32;
    /// Anti-windup update: called with the unsaturated and the applied command.
    fn anti_windup(&mut self, gains: &Self::Gains, period_s: f32, unsaturated: f32, applied: f32);
}

/// Back-calculation: the share of what was not applied by which an integral gives way in one
/// period. At a time constant no longer than the period, or none that is a number: all of it.
pub(crate) fn back_calculation(tracking_time_s: f32, period_s: f32) -> f32 {
    if tracking_time_s > period_s {
        period_s / tracking_time_s
    } else {
        1.0
    }
}

/// One law per channel.
///
/// ```
/// use sinew_mpc::feedback::Feedback;
/// use sinew_mpc::feedback::pid::{PidGains, PidState};
/// use sinew_mpc::limits::Limits;
///
/// let gains = PidGains {
///     kp: 2.0,
///     ki: 0.5,
///     kd: 0.0,
///     filter_s: 0.0,
///     proportional_setpoint_weight: 1.0,
///     derivative_setpoint_weight: 0.0,
///     tracking_time_s: 1.0,
/// };
/// let limits = Limits { lower: [-1.0], upper: [1.0], rate: [0.1], safe: [0.0] };
/// let mut pid: Feedback<PidState, 1> = Feedback::new([gains], 0.01, limits, 3);
/// assert_eq!(pid.step(&[0.0], &[0.5]), [0.1]); // one rate limit away from the safe command
/// assert_eq!(pid.step(&[f32::NAN], &[0.5]), [0.1]); // a missing sample: the command is held
/// ```
#[derive(Clone, Debug)]
pub struct Feedback<L: Law, const NU: usize> {
    /// May change between two steps.
    pub gains: [L::Gains; NU],
    period_s: f32,
    state: [L; NU],
    limiter: Limiter<NU>,
    max_missing_samples: u16,
    missing_run: u16,
}

impl<L: Law, const NU: usize> Feedback<L, NU> {
    /// At rest at the safe command. `max_missing_samples`: missing samples in a row over which the
    /// command is held, before the safe command.
    pub fn new(
        gains: [L::Gains; NU],
        period_s: f32,
        limits: Limits<NU>,
        max_missing_samples: u16,
    ) -> Self {
        let limiter = Limiter::new(limits);
        Self {
            gains,
            period_s,
            state: limiter.applied().map(L::new),
            limiter,
            max_missing_samples,
            missing_run: 0,
        }
    }

    /// The command for this sample, physical units, inside the limits whatever comes in. A channel
    /// whose output or reference is not finite holds its command; when that lasts longer than
    /// `max_missing_samples`, all channels go to the safe command.
    pub fn step(&mut self, y: &[f32; NU], reference: &[f32; NU]) -> [f32; NU] {
        let usable = |i: usize| y[i].is_finite() && reference[i].is_finite();
        if (0..NU).all(usable) {
            self.missing_run = 0;
        } else {
            self.missing_run = self.missing_run.saturating_add(1);
        }
        if self.missing_run > self.max_missing_samples {
            let applied = self.limiter.ramp_to_safe();
            self.restart(&applied);
            return applied;
        }
        let mut unsaturated = *self.limiter.applied();
        for i in 0..NU {
            if usable(i) {
                unsaturated[i] =
                    self.state[i].advance(&self.gains[i], self.period_s, reference[i], y[i]);
            }
        }
        let applied = self.limiter.limit(&unsaturated);
        for i in 0..NU {
            self.state[i].anti_windup(&self.gains[i], self.period_s, unsaturated[i], applied[i]);
            if !unsaturated[i].is_finite() {
                self.state[i] = L::new(applied[i]);
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
        self.state = applied.map(L::new);
    }
}
