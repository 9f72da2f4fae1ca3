//! Rolls the predictor out over the horizon on its own predictions, and carries the sensitivity of
//! every prediction to every decision variable through the whole recursion (docs/mpc.md, eq. 5).

use super::Horizons;
use crate::model::Jacobian;

/// What a rollout leaves for the derivatives: the network is not evaluated again.
#[derive(Clone, Debug)]
pub struct Trajectory<T, const NY: usize, const N: usize> {
    /// What the model left at each step.
    pub traces: [T; N],
    /// Q e_j, the weighted tracking errors; zero before N1.
    pub weighted: [[f32; NY]; N],
}

impl<T: Copy, const NY: usize, const N: usize> Trajectory<T, NY, N> {
    /// Room for a rollout.
    pub const fn new(trace: T) -> Self {
        Self {
            traces: [trace; N],
            weighted: [[0.0; NY]; N],
        }
    }
}

/// dy/dv of the last DD predictions, one entry per block of the plan: `[b][lag][r][c]` is the
/// derivative of y_r(k+j-lag) by the command of channel c at the end of block b.
pub struct Sensitivity<const NU: usize, const NY: usize, const DD: usize, const NB: usize> {
    blocks: [[[[f32; NU]; NY]; DD]; NB],
}

impl<const NU: usize, const NY: usize, const DD: usize, const NB: usize>
    Sensitivity<NU, NY, DD, NB>
{
    /// What was measured does not depend on the plan: zero.
    pub const fn new() -> Self {
        Self {
            blocks: [[[[0.0; NU]; NY]; DD]; NB],
        }
    }

    /// The entries of the newest prediction, one per block.
    #[inline(always)]
    pub fn newest(&self) -> impl Iterator<Item = &[[f32; NU]; NY]> + Clone {
        self.blocks.iter().filter_map(|lags| lags.first())
    }

    /// One step further, to y(k+j+1); returns how many blocks have an effect on it.
    #[inline(always)]
    pub fn advance<const ND: usize, const N: usize>(
        &mut self,
        jacobian: &Jacobian<NU, NY, ND, DD>,
        horizons: &Horizons<N, NB>,
        j: usize,
    ) -> usize {
        let reached = |step: usize| horizons.block.get(step).map_or(0, |b| usize::from(*b) + 1);
        let before = if j > 0 { reached(j - 1) } else { 0 };
        for lags in self.blocks.iter_mut().take(before) {
            let mut next = [[0.0; NU]; NY];
            for (jac, past) in jacobian.y.iter().zip(lags.iter()) {
                for (next, jac) in next.iter_mut().zip(jac) {
                    for (jac, past) in jac.iter().zip(past) {
                        for (next, past) in next.iter_mut().zip(past) {
                            *next += jac * past;
                        }
                    }
                }
            }
            shift(lags, next);
        }
        // u(k+j-lag) lies between the ends of two blocks.
        for (lag, direct) in jacobian.u.iter().enumerate().take(j + 1) {
            let (Some(block), Some(share)) =
                (horizons.block.get(j - lag), horizons.share.get(j - lag))
            else {
                continue;
            };
            let block = usize::from(*block);
            self.add(block, *share, direct);
            if *share < 1.0 && block > 0 {
                self.add(block - 1, 1.0 - *share, direct);
            }
        }
        reached(j)
    }

    #[inline(always)]
    fn add(&mut self, block: usize, share: f32, direct: &[[f32; NU]; NY]) {
        if let Some(newest) = self.blocks.get_mut(block).and_then(|lags| lags.first_mut()) {
            for (newest, direct) in newest.iter_mut().zip(direct) {
                for (newest, direct) in newest.iter_mut().zip(direct) {
                    *newest += share * direct;
                }
            }
        }
    }
}

impl<const NU: usize, const NY: usize, const DD: usize, const NB: usize> Default
    for Sensitivity<NU, NY, DD, NB>
{
    fn default() -> Self {
        Self::new()
    }
}

/// Makes room at the newest place; the oldest value is lost.
#[inline(always)]
pub fn shift<T: Copy, const L: usize>(lags: &mut [T; L], newest: T) {
    let mut carry = newest;
    for place in lags {
        core::mem::swap(place, &mut carry);
    }
}
