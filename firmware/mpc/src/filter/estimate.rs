//! Estimate of a filter, and its starts: at rest, after a gap, and where it broke down.

use super::covariance::Covariance;
use super::settings::{Prior, variance};
use crate::math::clamp;

/// A state further than this from model zero is none; also keeps every sum finite.
const IMPLAUSIBLE: f32 = 1.0e6;

/// Everything that readings change.
#[derive(Clone, Copy, Debug)]
pub(super) struct Estimate<const NX: usize, const NU: usize, const NP: usize, const NZ: usize> {
    pub x: [f32; NX],
    pub d: [f32; NU],
    pub theta: [f32; NP],
    pub covariance: Covariance<NZ>,
    /// Variance that readings took from each parameter and noise has not given back.
    pub owed: [f32; NP],
    /// Periods in a row without an accepted reading.
    pub missing_run: u16,
    /// A reading was accepted since the start.
    pub started: bool,
    /// Periods with readings in which the start at rest may still be contradicted.
    pub unconfirmed: u16,
}

impl<const NX: usize, const NU: usize, const NP: usize, const NZ: usize> Estimate<NX, NU, NP, NZ> {
    /// The prior at rest, before any reading.
    pub const fn new(prior: &Prior<NX, NU, NP>, unconfirmed: u16) -> Self {
        Self {
            x: prior.x,
            d: [0.0; NU],
            theta: prior.theta,
            covariance: Covariance::diagonal(initial_variances(prior, &prior.rest_deviation)),
            owed: [0.0; NP],
            missing_run: 0,
            started: false,
            unconfirmed,
        }
    }

    /// Adds a correction of (x, d, theta); the parameters stay within their bounds.
    pub fn correct(&mut self, prior: &Prior<NX, NU, NP>, correction: &[f32; NZ]) {
        for (x, correction) in self.x.iter_mut().zip(correction) {
            *x += correction;
        }
        for (d, correction) in self.d.iter_mut().zip(correction.iter().skip(NX)) {
            *d += correction;
        }
        let corrections = correction.iter().skip(NX + NU);
        let bounds = prior.lower.iter().zip(&prior.upper);
        for ((theta, correction), (lower, upper)) in
            self.theta.iter_mut().zip(corrections).zip(bounds)
        {
            *theta = clamp(*theta + correction, *lower, *upper);
        }
    }

    /// The state anew, of a plant that may move.
    pub fn restart(&mut self, prior: &Prior<NX, NU, NP>) {
        self.x = prior.x;
        self.widen(prior);
        self.missing_run = 0;
        self.started = false;
    }

    /// The state anew, of a plant at rest.
    pub fn rest(&mut self, prior: &Prior<NX, NU, NP>, unconfirmed: u16) {
        self.restart(prior);
        let variances = initial_variances(prior, &prior.rest_deviation);
        self.covariance.restart(NX + NU, &variances);
        self.unconfirmed = unconfirmed;
    }

    /// The state stays where it is, as uncertain as after a gap.
    pub fn widen(&mut self, prior: &Prior<NX, NU, NP>) {
        let variances = initial_variances(prior, &prior.state_deviation);
        self.covariance.restart(NX + NU, &variances);
        self.unconfirmed = 0;
    }

    /// Starts anew where an estimate is no plausible number; the plant may move then.
    pub fn recover(&mut self, prior: &Prior<NX, NU, NP>) {
        let plausible = |value: &f32| value.abs() <= IMPLAUSIBLE;
        let known = self.d.iter().chain(&self.theta).all(plausible);
        if !known || !self.covariance.is_valid() {
            *self = Self::new(prior, 0);
            self.restart(prior);
        } else if !self.x.iter().all(plausible) {
            self.restart(prior);
        }
    }
}

/// Variances of (x, d, theta) before any reading, with the given deviations of the state.
const fn initial_variances<const NX: usize, const NU: usize, const NP: usize, const NZ: usize>(
    prior: &Prior<NX, NU, NP>,
    state_deviation: &[f32; NX],
) -> [f32; NZ] {
    let mut variances = [0.0; NZ];
    let mut i = 0;
    while i < NZ {
        variances[i] = variance(if i < NX {
            state_deviation[i]
        } else if i < NX + NU {
            prior.disturbance_deviation[i - NX]
        } else {
            prior.parameter_deviation[i - NX - NU]
        });
        i += 1;
    }
    variances
}
