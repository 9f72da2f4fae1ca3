//! Rolls the predictor out over the horizon on its own predictions, with the sensitivity of every
//! prediction to every planned command carried through the whole recursion (docs/mpc.md, eq. 5).

use crate::model::{Jacobian, Model, Regressor};

/// The regressor on its way through the horizon.
pub struct Rollout<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
> {
    regressor: Regressor<NU, NY, NS, ND, DD>,
}

/// dy/du_i of the last DD predictions, one block per planned command: `[i][lag][r][c]` is
/// dy_r(k+j-lag)/du_c(k+i); the last block stands for all held commands.
pub struct Sensitivity<const NU: usize, const NY: usize, const DD: usize, const NC: usize> {
    blocks: [[[[f32; NU]; NY]; DD]; NC],
}

impl<const NU: usize, const NY: usize, const DD: usize, const NC: usize>
    Sensitivity<NU, NY, DD, NC>
{
    /// What was measured does not depend on the plan: zero.
    pub const fn new() -> Self {
        Self {
            blocks: [[[[0.0; NU]; NY]; DD]; NC],
        }
    }

    /// The blocks of the newest prediction, one per planned command.
    #[inline(always)]
    pub fn newest(&self) -> impl Iterator<Item = &[[f32; NU]; NY]> + Clone {
        self.blocks.iter().filter_map(|lags| lags.first())
    }

    /// dy(k+j+1)/du_i = sum_lag df/dy(k+j-lag) dy(k+j-lag)/du_i + sum of df/du(k+j-lag) over the lags
    /// at which u_i was applied.
    #[inline(always)]
    fn advance<const ND: usize>(&mut self, jacobian: &Jacobian<NU, NY, ND, DD>, j: usize) {
        for (i, lags) in self.blocks.iter_mut().take(j + 1).enumerate() {
            let mut next = [[0.0; NU]; NY];
            // u_i is in the regressor at lag j - i; the last one, held, at that lag and all newer.
            let oldest = j - i;
            let newest = if i + 1 == NC { 0 } else { oldest };
            for direct in jacobian.u.iter().take(oldest + 1).skip(newest) {
                for (next, direct) in next.iter_mut().zip(direct) {
                    for (next, direct) in next.iter_mut().zip(direct) {
                        *next += direct;
                    }
                }
            }
            // At j = i nothing before depends on u_i yet.
            for (jac, past) in jacobian.y.iter().zip(lags.iter()).take(oldest) {
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
    }
}

impl<const NU: usize, const NY: usize, const DD: usize, const NC: usize> Default
    for Sensitivity<NU, NY, DD, NC>
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

impl<const NU: usize, const NY: usize, const NS: usize, const ND: usize, const DD: usize>
    Rollout<NU, NY, NS, ND, DD>
{
    /// Starts at k.
    #[inline(always)]
    pub fn new(start: &Regressor<NU, NY, NS, ND, DD>) -> Self {
        Self { regressor: *start }
    }

    /// y(k+j+1) under the plan: `f(..) + d`. Call with j = 0, 1, 2, ...
    #[inline(always)]
    pub fn advance<M: Model<NU, NY, NS, ND, DD>, const NV: usize>(
        &mut self,
        model: &M,
        disturbance: &[f32; NY],
        plan: &[f32; NV],
        j: usize,
    ) -> [f32; NY] {
        self.apply(plan, j);
        let y = model.predict(&self.regressor);
        self.observe(y, disturbance)
    }

    /// The same, and the sensitivities one step further; `jacobian` is overwritten.
    #[inline(always)]
    pub fn advance_with_sensitivity<
        M: Model<NU, NY, NS, ND, DD>,
        const NC: usize,
        const NV: usize,
    >(
        &mut self,
        model: &M,
        disturbance: &[f32; NY],
        plan: &[f32; NV],
        j: usize,
        jacobian: &mut Jacobian<NU, NY, ND, DD>,
        sensitivity: &mut Sensitivity<NU, NY, DD, NC>,
    ) -> [f32; NY] {
        self.apply(plan, j);
        let y = model.predict_with_jacobian(&self.regressor, jacobian);
        sensitivity.advance(jacobian, j);
        self.observe(y, disturbance)
    }

    /// Puts u(k+j) at the newest place; at j = 0 that place is already waiting for it.
    #[inline(always)]
    fn apply<const NV: usize>(&mut self, plan: &[f32; NV], j: usize) {
        let mut u = [0.0; NU];
        // Held after the last planned command.
        let last = NV / NU - 1;
        let i = if j < last { j } else { last };
        for (u, planned) in u.iter_mut().zip(plan.iter().skip(i * NU)) {
            *u = *planned;
        }
        if j > 0 {
            shift(&mut self.regressor.u, u);
        } else if let Some(newest) = self.regressor.u.first_mut() {
            *newest = u;
        }
    }

    #[inline(always)]
    fn observe(&mut self, mut y: [f32; NY], disturbance: &[f32; NY]) -> [f32; NY] {
        for (y, d) in y.iter_mut().zip(disturbance) {
            *y += d;
        }
        shift(&mut self.regressor.y, y);
        y
    }
}
