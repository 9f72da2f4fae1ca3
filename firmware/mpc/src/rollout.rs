//! The predictions over the horizon, each made from the ones before it.

use crate::model::{Model, Regressor};

/// Intermediate values of a rollout for the derivatives: the network is not evaluated again.
#[derive(Clone, Debug)]
pub struct Trajectory<T, const NY: usize, const N: usize, E = ()> {
    /// Trace of the model at each step.
    pub traces: [T; N],
    /// Q e_j, the weighted tracking errors; zero before N1.
    pub weighted: [[f32; NY]; N],
    /// Residuals of the cost-to-go at the end of the horizon.
    pub residuals: E,
}

impl<T: Copy, const NY: usize, const N: usize, E: Copy> Trajectory<T, NY, N, E> {
    /// Room for a rollout.
    pub const fn new(trace: T, residuals: E) -> Self {
        Self {
            traces: [trace; N],
            weighted: [[0.0; NY]; N],
            residuals,
        }
    }
}

/// One step on: `u` becomes the newest command of `x`, y(k+j+1) = f(x) + d its newest output.
#[inline(always)]
pub fn advance<
    M: Model<NU, NY, NS, ND, DD> + ?Sized,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
>(
    model: &M,
    x: &mut Regressor<NU, NY, NS, ND, DD>,
    u: &[f32; NU],
    disturbance: &[f32; NY],
    trace: &mut M::Trace,
) -> [f32; NY] {
    shift(&mut x.u, *u);
    let mut y = model.predict(x, trace);
    if M::PREDICTS_CHANNELS {
        x.s = model.channels(x, trace);
    }
    for (y, d) in y.iter_mut().zip(disturbance) {
        *y += d;
    }
    shift(&mut x.y, y);
    y
}

/// Makes room at the newest place; the oldest value is lost.
#[inline(always)]
pub fn shift<T: Copy, const L: usize>(lags: &mut [T; L], newest: T) {
    let mut carry = newest;
    for place in lags {
        core::mem::swap(place, &mut carry);
    }
}
