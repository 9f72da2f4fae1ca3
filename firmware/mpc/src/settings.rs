//! Settings of a controller, which may change between two steps.

use crate::newton::MAX_ITERATIONS;

/// Everything that may change between two calls; model units except where stated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings<const NU: usize, const NY: usize> {
    /// Q: weight on the squared tracking error of each output.
    pub tracking_weight: [f32; NY],
    /// Lambda: weight on the squared change of each command.
    pub move_suppression: [f32; NU],
    /// Gain of the disturbance estimate, 0 (none) to 1 (follows the last error).
    pub disturbance_gain: f32,
    /// Newton iterations a step, 1 to [`MAX_ITERATIONS`].
    pub iterations: u8,
    /// Missing samples in a row that are predicted before the safe command.
    pub max_missing_samples: u16,
}

impl<const NU: usize, const NY: usize> Settings<NU, NY> {
    /// Checks every field.
    ///
    /// ```
    /// use sinew_mpc::settings::{InvalidSetting, Settings};
    ///
    /// let mut settings = Settings {
    ///     tracking_weight: [1.0],
    ///     move_suppression: [0.1],
    ///     disturbance_gain: 0.5,
    ///     iterations: 2,
    ///     max_missing_samples: 10,
    /// };
    /// assert_eq!(settings.validate(), Ok(()));
    /// settings.move_suppression = [-0.1];
    /// assert_eq!(settings.validate(), Err(InvalidSetting::MoveSuppression));
    /// ```
    ///
    /// # Errors
    /// The first field that is out of its range.
    pub fn validate(&self) -> Result<(), InvalidSetting> {
        let is_weight = |w: &f32| (0.0..f32::INFINITY).contains(w);
        if !self.tracking_weight.iter().all(is_weight) {
            Err(InvalidSetting::TrackingWeight)
        } else if !self.move_suppression.iter().all(is_weight) {
            Err(InvalidSetting::MoveSuppression)
        } else if !(0.0..=1.0).contains(&self.disturbance_gain) {
            Err(InvalidSetting::DisturbanceGain)
        } else if !(1..=MAX_ITERATIONS).contains(&self.iterations) {
            Err(InvalidSetting::Iterations)
        } else {
            Ok(())
        }
    }

    /// Every field is valid ([`Settings::validate`]).
    pub fn is_valid(&self) -> bool {
        self.validate().is_ok()
    }
}

/// A field of [`Settings`] that is out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InvalidSetting {
    /// A tracking weight is negative or not finite.
    TrackingWeight,
    /// A move suppression is negative or not finite.
    MoveSuppression,
    /// The gain is not from 0 to 1.
    DisturbanceGain,
    /// The iterations are not from 1 to [`MAX_ITERATIONS`].
    Iterations,
}
