//! One step of the derivatives: sensitivities a prediction further, and what they add to gradient and
//! Hessian (docs/mpc.md, eq. 5 to 7). Most of a control step's work; slices over the blocks keep it small.

use super::prediction::shift;
use crate::model::Jacobian;

/// Where a command stands among the decision variables: between the ends of two blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The block.
    pub block: usize,
    /// How much of the block's move has been made, 0 to 1.
    pub share: f32,
}

/// What a step of the horizon is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage<'a, const NY: usize, const ND: usize> {
    /// Blocks with an effect on the prediction before this one.
    pub carried: usize,
    /// Blocks with an effect on this one.
    pub reached: usize,
    /// Where u(k+j), u(k+j-1) .. stand; `None`: they lie in the past.
    pub inputs: [Option<Place>; ND],
    /// Q e of this prediction; `None`: it does not count (before N1).
    pub weighted: Option<&'a [f32; NY]>,
    /// Diagonal of Q.
    pub tracking: &'a [f32; NY],
}

/// What is being built, an entry for each block.
pub struct Tangent<'a, const NU: usize, const NY: usize, const DD: usize> {
    /// dy/dv of the last DD predictions: `[b][lag][r][c]` is the derivative of y_r(k+j-lag) by the command
    /// of channel c at the end of block b.
    pub blocks: &'a mut [[[[f32; NU]; NY]; DD]],
    /// `S' Q e`.
    pub gradient: &'a mut [[f32; NU]],
    /// The lower triangle of `S' Q S` by blocks, row after row.
    pub pairs: &'a mut [[[f32; NU]; NU]],
}

/// One prediction further:
///
/// dy(k+j+1)/dv_b = sum_lag df/dy(k+j-lag) dy(k+j-lag)/dv_b + sum_lag df/du(k+j-lag) du(k+j-lag)/dv_b.
///
/// Cost: per block that has an effect `NY NY NU DD` multiply-adds, per pair of them `NU NU NY`.
#[inline(always)]
pub fn carry<const NU: usize, const NY: usize, const ND: usize, const DD: usize>(
    jacobian: &Jacobian<NU, NY, ND, DD>,
    stage: &Stage<'_, NY, ND>,
    tangent: &mut Tangent<'_, NU, NY, DD>,
) {
    for lags in tangent.blocks.iter_mut().take(stage.carried) {
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
    for (place, direct) in stage.inputs.iter().zip(&jacobian.u) {
        let Some(Place { block, share }) = *place else {
            continue;
        };
        if let Some(lags) = tangent.blocks.get_mut(block) {
            add(lags, share, direct);
        }
        if share < 1.0
            && let Some(lags) = tangent.blocks.get_mut(block.wrapping_sub(1))
        {
            add(lags, 1.0 - share, direct);
        }
    }
    let Some(weighted) = stage.weighted else {
        return;
    };
    let mut pairs = tangent.pairs.iter_mut();
    let reached = tangent.blocks.iter().take(stage.reached);
    for (b, (lags, gradient)) in reached.zip(tangent.gradient.iter_mut()).enumerate() {
        let Some(s) = lags.first() else { continue };
        let mut qs = *s;
        for ((qs, q), (s, weighted)) in qs
            .iter_mut()
            .zip(stage.tracking)
            .zip(s.iter().zip(weighted))
        {
            for ((qs, s), g) in qs.iter_mut().zip(s).zip(gradient.iter_mut()) {
                *qs *= q;
                *g += s * weighted;
            }
        }
        for (lags, pair) in tangent.blocks.iter().take(b + 1).zip(&mut pairs) {
            let Some(s) = lags.first() else { continue };
            for (a, row) in pair.iter_mut().enumerate() {
                for (c, h) in row.iter_mut().enumerate() {
                    for (qs, s) in qs.iter().zip(s) {
                        *h += qs[a] * s[c];
                    }
                }
            }
        }
    }
}

/// `newest += share direct`.
#[inline(always)]
fn add<const NU: usize, const NY: usize, const DD: usize>(
    lags: &mut [[[f32; NU]; NY]; DD],
    share: f32,
    direct: &[[f32; NU]; NY],
) {
    if let Some(newest) = lags.first_mut() {
        for (newest, direct) in newest.iter_mut().zip(direct) {
            for (newest, direct) in newest.iter_mut().zip(direct) {
                *newest += share * direct;
            }
        }
    }
}
