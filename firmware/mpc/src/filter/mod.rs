//! Extended Kalman filter over state, input disturbance and parameters
//! (docs/explanation/controller.md, section 9).
//!
//! A [`StateSpace`] model says where the state goes and what the sensors read. The [`Filter`]
//! estimates z = (x, d, theta): the state, a disturbance that adds to each input, and the
//! parameters in which this device differs from the usual one. Each period has two calls:
//! [`Filter::update`] with the readings, whichever came, and [`Filter::predict`] with the command.
//!
//! ```
//! use sinew_mpc::estimator::Sample;
//! use sinew_mpc::filter::{
//!     Filter, FilterSettings, MeasurementJacobian, Prior, StateSpace, TransitionJacobian,
//! };
//!
//! /// Speed and position of a cart on wheels, pushed by u; theta is 1/mass. Only the position is
//! /// read.
//! struct Cart;
//! const PERIOD_S: f32 = 0.01;
//!
//! impl StateSpace<2, 1, 1, 1> for Cart {
//!     type Trace = (f32, f32);
//!     const TRACE: (f32, f32) = (0.0, 0.0);
//!
//!     fn transition(
//!         &self,
//!         x: &[f32; 2],
//!         u: &[f32; 1],
//!         theta: &[f32; 1],
//!         trace: &mut (f32, f32),
//!     ) -> [f32; 2] {
//!         *trace = (u[0], theta[0]);
//!         [x[0] + PERIOD_S * x[1], x[1] + PERIOD_S * theta[0] * u[0]]
//!     }
//!
//!     fn transition_jacobian(
//!         &self,
//!         &(u, theta): &(f32, f32),
//!         jacobian: &mut TransitionJacobian<2, 1, 1>,
//!     ) {
//!         jacobian.x = [[1.0, PERIOD_S], [0.0, 1.0]];
//!         jacobian.u = [[0.0], [PERIOD_S * theta]];
//!         jacobian.theta = [[0.0], [PERIOD_S * u]];
//!     }
//!
//!     fn measure(&self, x: &[f32; 2], _: &[f32; 1]) -> [f32; 1] {
//!         [x[0]]
//!     }
//!
//!     fn measurement_jacobian(
//!         &self,
//!         _: &[f32; 2],
//!         _: &[f32; 1],
//!         jacobian: &mut MeasurementJacobian<2, 1, 1>,
//!     ) {
//!         jacobian.x = [[1.0, 0.0]];
//!     }
//! }
//!
//! let prior = Prior {
//!     x: [0.0; 2],
//!     // Somewhere, at rest; after a gap it may move.
//!     rest_deviation: [1.0, 0.01],
//!     state_deviation: [1.0; 2],
//!     disturbance_deviation: [0.0],
//!     theta: [1.0],
//!     parameter_deviation: [0.3],
//!     lower: [0.3],
//!     upper: [3.0],
//! };
//! let settings = FilterSettings {
//!     state_noise: [0.0; 2],
//!     disturbance_noise: [0.0],
//!     parameter_noise: [0.0],
//!     measurement_noise: [0.01],
//!     gate: 5.0,
//!     adapt: true,
//!     max_missing_samples: 10,
//! };
//! // States, inputs, measurements, parameters, and all that is estimated: 2 + 1 + 1.
//! let mut filter: Filter<2, 1, 1, 1, 4> = Filter::new(prior, settings);
//! // The cart weighs 0.8, so that 1/mass is 1.25.
//! let (mut position, mut speed) = (0.2_f32, 0.0_f32);
//! for k in 0..400 {
//!     let update = filter.update(&Cart, &[position]);
//!     assert_eq!(update.sample, Sample::Measured);
//!     let u = if k % 100 < 50 { 2.0 } else { -2.0 };
//!     filter.predict(&Cart, &[u]);
//!     (position, speed) = (position + PERIOD_S * speed, speed + PERIOD_S * 1.25 * u);
//! }
//! assert!((filter.theta()[0] - 1.25).abs() < 0.01);
//! assert!((filter.x()[1] - speed).abs() < 0.01, "the speed that nobody reads");
//! ```

mod covariance;
mod estimate;
mod late;
mod settings;
mod state_space;

pub use covariance::{Covariance, Gain, Projection};
pub use late::LateFilter;
pub use settings::{FilterSettings, InvalidFilterSetting, Prior};
pub use state_space::{MeasurementJacobian, StateSpace, TransitionJacobian};

use crate::estimator::IMPLAUSIBLE;
use crate::estimator::Sample;
use crate::math::clamp;
use estimate::Estimate;
use settings::variance;

/// Periods whose parameter noise may be owed: what readings took from a parameter's variance is
/// given back over at most this long (eq. 18).
const FORGETTING_PERIODS: f32 = 100.0;

/// Use of one reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// It corrected the estimate.
    Accepted,
    /// There was none, or no plausible number.
    Missing,
    /// It was further from its prediction than the gate allows.
    Rejected,
}

/// Result of an update.
#[must_use]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Update<const NM: usize> {
    /// [`Sample::Measured`]: every reading was accepted. [`Sample::Predicted`]: some were not.
    /// [`Sample::SignalLost`]: none for too long, or none yet; do not control on this.
    pub sample: Sample,
    /// Use of each reading.
    pub readings: [Reading; NM],
}

/// Extended Kalman filter over z = (x, d, theta), `NZ = NX + NU + NP`. Model units.
#[derive(Clone, Copy, Debug)]
pub struct Filter<
    const NX: usize,
    const NU: usize,
    const NM: usize,
    const NP: usize,
    const NZ: usize,
> {
    prior: Prior<NX, NU, NP>,
    settings: FilterSettings<NX, NU, NM, NP>,
    estimate: Estimate<NX, NU, NP, NZ>,
}

impl<const NX: usize, const NU: usize, const NM: usize, const NP: usize, const NZ: usize>
    Filter<NX, NU, NM, NP, NZ>
{
    /// A filter that has read nothing, of a plant at rest.
    pub const fn new(prior: Prior<NX, NU, NP>, settings: FilterSettings<NX, NU, NM, NP>) -> Self {
        const { assert!(NX >= 1 && NU >= 1 && NM >= 1) };
        const { assert!(NZ == NX + NU + NP, "NZ is all that is estimated") };
        Self {
            prior,
            settings,
            estimate: Estimate::new(&prior, settings.max_missing_samples),
        }
    }

    /// The state estimate.
    pub const fn x(&self) -> &[f32; NX] {
        &self.estimate.x
    }

    /// The disturbance estimate; it adds to the inputs.
    pub const fn disturbance(&self) -> &[f32; NU] {
        &self.estimate.d
    }

    /// The parameter estimate, inside the bounds of the prior.
    pub const fn theta(&self) -> &[f32; NP] {
        &self.estimate.theta
    }

    /// Covariance of (x, d, theta).
    pub const fn covariance(&self) -> &Covariance<NZ> {
        &self.estimate.covariance
    }

    /// The settings in force.
    pub const fn settings(&self) -> &FilterSettings<NX, NU, NM, NP> {
        &self.settings
    }

    /// The settings, to be changed between two calls.
    pub const fn settings_mut(&mut self) -> &mut FilterSettings<NX, NU, NM, NP> {
        &mut self.settings
    }

    /// Too few readings to control on: none yet, or none for too long.
    pub const fn is_lost(&self) -> bool {
        !self.estimate.started
    }

    /// Takes the readings m(k); NaN stands for one that did not come.
    ///
    /// Each reading corrects the estimate by itself (eq. 17), so missing ones cost nothing. A
    /// reading beyond the gate changes nothing. The first period with readings after a start takes
    /// them all. One beyond the gate soon after a start at rest says that the plant moves: from the
    /// next period on the state is as uncertain as after a gap.
    pub fn update<M: StateSpace<NX, NU, NM, NP>>(
        &mut self,
        model: &M,
        readings: &[f32; NM],
    ) -> Update<NM> {
        if !self.settings.adapt {
            self.estimate.covariance.condition(NX + NU);
        }
        let predicted = model.measure(&self.estimate.x, &self.estimate.theta);
        let mut jacobian = MeasurementJacobian::ZERO;
        model.measurement_jacobian(&self.estimate.x, &self.estimate.theta, &mut jacobian);
        let mut uses = [Reading::Missing; NM];
        let mut correction = [0.0; NZ];
        let mut accepted = 0;
        for i in 0..NM {
            let r = variance(self.settings.measurement_noise[i]);
            if !(readings[i].abs() <= IMPLAUSIBLE) || !(r > 0.0) {
                continue;
            }
            let row = self.row(&jacobian.x[i], None, &jacobian.theta[i]);
            // Readings before this one moved the estimate, the model is linear over that way.
            let mut innovation = readings[i] - predicted[i];
            for (h, correction) in row.iter().zip(&correction) {
                innovation -= h * correction;
            }
            let projection = self.estimate.covariance.project(&row, r);
            let gate = self.settings.gate;
            let near = innovation * innovation <= gate * gate * projection.variance;
            let usable = innovation.is_finite() && projection.variance.is_finite();
            if !usable || (self.estimate.started && !near) {
                uses[i] = Reading::Rejected;
                continue;
            }
            let update = self.estimate.covariance.update(&projection, r);
            for (correction, gain) in correction.iter_mut().zip(&update.gain) {
                *correction += gain * innovation;
            }
            for (owed, reduction) in self
                .estimate
                .owed
                .iter_mut()
                .zip(update.reduction.iter().skip(NX + NU))
            {
                *owed += reduction;
            }
            uses[i] = Reading::Accepted;
            accepted += 1;
        }
        self.estimate.correct(&self.prior, &correction);
        if accepted > 0 {
            self.estimate.missing_run = 0;
            self.estimate.started = true;
            self.estimate.unconfirmed = self.estimate.unconfirmed.saturating_sub(1);
        } else {
            self.estimate.missing_run = self.estimate.missing_run.saturating_add(1);
            if self.estimate.missing_run > self.settings.max_missing_samples {
                self.estimate.restart(&self.prior);
            }
        }
        if self.estimate.unconfirmed > 0 && uses.contains(&Reading::Rejected) {
            self.estimate.widen(&self.prior);
        }
        self.estimate.recover(&self.prior);
        let sample = if !self.estimate.started {
            Sample::SignalLost
        } else if accepted == NM {
            Sample::Measured
        } else {
            Sample::Predicted
        };
        Update {
            sample,
            readings: uses,
        }
    }

    /// Goes on to the next period under the applied command u(k) (eq. 15 and 16). Waits at the
    /// prior while nothing has been read.
    pub fn predict<M: StateSpace<NX, NU, NM, NP>>(&mut self, model: &M, u: &[f32; NU]) {
        if !self.estimate.started {
            return;
        }
        let mut disturbed = *u;
        for (u, d) in disturbed.iter_mut().zip(&self.estimate.d) {
            *u += d;
        }
        let mut trace = M::TRACE;
        self.estimate.x = model.transition(
            &self.estimate.x,
            &disturbed,
            &self.estimate.theta,
            &mut trace,
        );
        let mut jacobian = TransitionJacobian::ZERO;
        model.transition_jacobian(&trace, &mut jacobian);
        let mut f = [[0.0; NZ]; NX];
        for (i, row) in f.iter_mut().enumerate() {
            *row = self.row(&jacobian.x[i], Some(&jacobian.u[i]), &jacobian.theta[i]);
        }
        self.estimate
            .covariance
            .propagate(&f, &self.settings.state_noise.map(variance));
        for (i, noise) in self.settings.disturbance_noise.iter().enumerate() {
            self.estimate.covariance.add_noise(NX + i, variance(*noise));
        }
        if self.settings.adapt {
            self.forget();
        }
        self.estimate.recover(&self.prior);
    }

    /// Gives back variance that readings took from the parameters (eq. 18): never more, so that an
    /// unexcited parameter keeps what is known of it.
    fn forget(&mut self) {
        for i in 0..NP {
            let noise = variance(self.settings.parameter_noise[i]);
            let owed = clamp(self.estimate.owed[i], 0.0, FORGETTING_PERIODS * noise);
            let back = clamp(owed, 0.0, noise);
            self.estimate.owed[i] = owed - back;
            self.estimate.covariance.add_noise(NX + NU + i, back);
        }
    }

    /// A row over (x, d, theta); without the parameters where they are kept.
    #[inline(always)]
    fn row(&self, x: &[f32; NX], d: Option<&[f32; NU]>, theta: &[f32; NP]) -> [f32; NZ] {
        let mut row = [0.0; NZ];
        for (place, value) in row.iter_mut().zip(x) {
            *place = *value;
        }
        if let Some(d) = d {
            for (place, value) in row.iter_mut().skip(NX).zip(d) {
                *place = *value;
            }
        }
        if self.settings.adapt {
            for (place, value) in row.iter_mut().skip(NX + NU).zip(theta) {
                *place = *value;
            }
        }
        row
    }

    /// Starts the state anew, as after a gap: at the prior, with its covariance. Disturbance and
    /// parameters keep their estimates, and the parameters their covariance.
    pub fn restart(&mut self) {
        self.estimate.restart(&self.prior);
    }

    /// As [`Filter::restart`], of a plant at rest.
    pub fn rest(&mut self) {
        self.estimate
            .rest(&self.prior, self.settings.max_missing_samples);
    }

    /// Forgets everything: the prior, at rest.
    pub fn reset(&mut self) {
        self.estimate = Estimate::new(&self.prior, self.settings.max_missing_samples);
    }
}
