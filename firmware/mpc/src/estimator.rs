//! History, disturbance estimate and missing samples (docs/explanation/controller.md, section 3).
//!
//! The disturbance d stands at the model's equation: `y(k+1) = f(..) + d`. It is added at every
//! step of a prediction, so that a constant load, a gain error or an offset leaves no steady error,
//! also where the plant integrates.

use crate::model::{Model, Regressor};
use crate::rollout::shift;
use crate::tuning::Tuning;

/// A measurement further than this from model zero, in model units, is no measurement: a thousand
/// times the range that was seen in training. It also keeps every sum below finite.
pub(crate) const IMPLAUSIBLE: f32 = 1.0e3;

/// Result of taking a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sample {
    /// Every output was measured.
    Measured,
    /// At least one output was missing and replaced by its prediction.
    Predicted,
    /// Too many were missing in a row, or none has come yet: do not control on this.
    SignalLost,
}

/// The state of the estimator; model units.
///
/// ```
/// # use sinew_mpc::model::{Jacobian, Model, Regressor};
/// # struct Lag;
/// # impl Model<1, 1, 0, 1, 1> for Lag {
/// #     type Trace = ();
/// #     const TRACE: () = ();
/// #     fn predict(&self, x: &Regressor<1, 1, 0, 1, 1>, _: &mut ()) -> [f32; 1] {
/// #         [0.5 * x.y[0][0] + 0.5 * x.u[0][0]]
/// #     }
/// #     fn jacobian(&self, _: &(), jacobian: &mut Jacobian<1, 1, 1, 1>) {
/// #         jacobian.y[0][0][0] = 0.5;
/// #         jacobian.u[0][0][0] = 0.5;
/// #     }
/// # }
/// # impl sinew_mpc::Tuning for Lag {}
/// use sinew_mpc::estimator::{Estimator, Sample};
///
/// // The model `Lag` is y(k+1) = 0.5 y(k) + 0.5 u(k).
/// let mut estimator: Estimator<1, 1, 0, 1, 1> = Estimator::new([0.0]);
/// let (gain, max_missing_samples) = (1.0, 1);
/// let mut observe = |y: f32| {
///     let sample = estimator.observe(&Lag, &[y], &[], gain, max_missing_samples);
///     estimator.apply(&[1.0]);
///     (sample, estimator.regressor().y[0][0])
/// };
/// assert_eq!(observe(0.0), (Sample::Measured, 0.0));
/// // One missing sample is predicted; after the second in a row the signal is lost.
/// assert_eq!(observe(f32::NAN), (Sample::Predicted, 0.5));
/// assert_eq!(observe(f32::NAN).0, Sample::SignalLost);
/// ```
#[derive(Clone, Debug)]
pub struct Estimator<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
> {
    regressor: Regressor<NU, NY, NS, ND, DD>,
    disturbance: [f32; NY],
    /// Complete samples in a row.
    measured_run: u16,
    /// Incomplete samples in a row.
    missing_run: u16,
    /// Incomplete samples since the reset.
    missed: u32,
    /// The history holds this plant's past.
    started: bool,
}

impl<const NU: usize, const NY: usize, const NS: usize, const ND: usize, const DD: usize>
    Estimator<NU, NY, NS, ND, DD>
{
    /// Nothing measured yet; the commands of the past are `applied`.
    pub const fn new(applied: [f32; NU]) -> Self {
        const { assert!(ND >= 1 && DD >= 1 && NU >= 1 && NY >= 1) };
        Self {
            regressor: Regressor {
                u: [applied; ND],
                y: [[0.0; NY]; DD],
                s: [0.0; NS],
            },
            disturbance: [0.0; NY],
            measured_run: 0,
            missing_run: 0,
            missed: 0,
            started: false,
        }
    }

    /// The regressor at k; its newest command is a place for u(k).
    pub const fn regressor(&self) -> &Regressor<NU, NY, NS, ND, DD> {
        &self.regressor
    }

    /// The disturbance estimate d.
    pub const fn disturbance(&self) -> &[f32; NY] {
        &self.disturbance
    }

    /// Incomplete samples since the reset.
    pub const fn missed(&self) -> u32 {
        self.missed
    }

    /// Takes the sample y(k) (NaN: missing) and the channels s(k) (NaN: the last reading is kept,
    /// or the prediction where the model predicts channels).
    ///
    /// `d <- d + gain (y - (f + d))` (eq. 10) while every value in the regressor was measured; what
    /// enters it is `y`, or with an observer `(f + d) + L (y - (f + d))` (eq. 10c). The first
    /// sample, and the first one after a loss, fills the whole history: at rest there.
    pub fn observe<M: Model<NU, NY, NS, ND, DD> + Tuning>(
        &mut self,
        model: &M,
        y: &[f32; NY],
        s: &[f32; NS],
        gain: f32,
        max_missing_samples: u16,
    ) -> Sample {
        let complete = y.iter().all(|y| plausible(*y));
        let lost = !self.started || self.missing_run > max_missing_samples;
        let mut predicted = self.regressor.y.first().copied().unwrap_or([0.0; NY]);
        if self.started {
            let mut trace = M::TRACE;
            let next = model.predict(&self.regressor, &mut trace);
            if M::PREDICTS_CHANNELS {
                let channels = model.channels(&self.regressor, &trace);
                keep_plausible(&mut self.regressor.s, &channels);
            }
            for ((place, next), d) in predicted.iter_mut().zip(&next).zip(&self.disturbance) {
                let value = next + d;
                // A prediction that has run away leaves the last value in place.
                if plausible(value) {
                    *place = value;
                }
            }
        }
        let sample = if complete {
            self.missing_run = 0;
            if lost {
                self.regressor.y = [*y; DD];
                self.measured_run = 0;
            } else {
                if usize::from(self.measured_run) >= DD {
                    self.correct(y, &predicted, gain);
                }
                let entered = entered(y, &predicted, M::OBSERVER_GAIN);
                shift(&mut self.regressor.y, entered);
            }
            self.started = true;
            self.measured_run = self.measured_run.saturating_add(1);
            Sample::Measured
        } else {
            self.missed = self.missed.wrapping_add(1);
            self.missing_run = self.missing_run.saturating_add(1);
            self.measured_run = 0;
            let entered = entered(y, &predicted, M::OBSERVER_GAIN);
            shift(&mut self.regressor.y, entered);
            if !self.started || self.missing_run > max_missing_samples {
                Sample::SignalLost
            } else {
                Sample::Predicted
            }
        };
        keep_plausible(&mut self.regressor.s, s);
        // Room for u(k); the last command stands in until it is known.
        if let Some(last) = self.regressor.u.first().copied() {
            shift(&mut self.regressor.u, last);
        }
        sample
    }

    /// Enters the command that was applied at k, as it was after limiting.
    pub fn apply(&mut self, u: &[f32; NU]) {
        if let Some(newest) = self.regressor.u.first_mut() {
            *newest = *u;
        }
    }

    /// Forgets the past; the commands of the past are `applied`.
    pub fn reset(&mut self, applied: [f32; NU]) {
        *self = Self::new(applied);
    }

    fn correct(&mut self, y: &[f32; NY], predicted: &[f32; NY], gain: f32) {
        for ((d, y), predicted) in self.disturbance.iter_mut().zip(y).zip(predicted) {
            let corrected = *d + gain * (y - predicted);
            if plausible(corrected) {
                *d = corrected;
            }
        }
    }
}

/// Values that enter the history: of a measurement the part that the observer takes (eq. 10c), and
/// the prediction where there is none.
#[inline(always)]
fn entered<const NY: usize>(y: &[f32; NY], predicted: &[f32; NY], gain: f32) -> [f32; NY] {
    let mut entered = *predicted;
    for (entered, y) in entered.iter_mut().zip(y) {
        if plausible(*y) {
            *entered = if gain < 1.0 {
                *entered + gain * (y - *entered)
            } else {
                *y
            };
        }
    }
    entered
}

/// Takes what is plausible of `new`, element by element.
#[inline(always)]
fn keep_plausible<const N: usize>(kept: &mut [f32; N], new: &[f32; N]) {
    for (kept, new) in kept.iter_mut().zip(new) {
        if plausible(*new) {
            *kept = *new;
        }
    }
}

/// A number, and not absurd.
#[inline(always)]
fn plausible(value: f32) -> bool {
    value.abs() <= IMPLAUSIBLE
}
