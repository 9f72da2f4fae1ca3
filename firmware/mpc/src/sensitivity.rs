//! One step of the derivatives: sensitivities a prediction further, and what they add to gradient
//! and Hessian (docs/explanation/controller.md, eq. 5 to 7). Most of a control step's work; slices
//! over the blocks keep it small.

use crate::model::{ChannelJacobian, Jacobian, Model, Regressor};
use crate::move_blocking::Interpolation;
use crate::rollout;
use crate::tuning::Tuning;

/// One step of the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage<'a, const NY: usize> {
    /// Blocks with an effect on the prediction before this one.
    pub active_before: usize,
    /// Blocks with an effect on this one.
    pub active: usize,
    /// Interpolation of u(k) .. u(k+j) in the plan, the newest last.
    pub inputs: &'a [Interpolation],
    /// Q e of this prediction; `None`: it does not count (before N1).
    pub weighted: Option<&'a [f32; NY]>,
    /// Diagonal of Q.
    pub tracking: &'a [f32; NY],
}

/// Derivatives under construction, an entry for each block.
pub struct Sensitivities<'a, const NU: usize, const NY: usize, const DD: usize> {
    /// dy/dv of the last DD predictions: `[b][lag][r][c]` is the derivative of y_r(k+j-lag) by the
    /// command of channel c at the end of block b.
    pub blocks: &'a mut [[[[f32; NU]; NY]; DD]],
    /// `S' Q e`.
    pub gradient: &'a mut [[f32; NU]],
    /// The lower triangle of `S' Q S` by blocks, row after row.
    pub pairs: &'a mut [[[f32; NU]; NU]],
}

/// One step of the horizon: a prediction, and the sensitivities of the plan through it.
///
/// The defaults are complete; a hand-written model needs `impl Propagate<..> for MyModel {}` only.
/// Generated models repeat the bodies as code of their own crate: these functions are most of a
/// control step, and are compiled for speed where the rest is compiled for size.
pub trait Propagate<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
>: Model<NU, NY, NS, ND, DD> + Tuning
{
    /// Enters u(k+j) into `x`, predicts, adds the disturbance, and enters the result.
    fn advance(
        &self,
        x: &mut Regressor<NU, NY, NS, ND, DD>,
        u: &[f32; NU],
        disturbance: &[f32; NY],
        trace: &mut Self::Trace,
    ) -> [f32; NY] {
        rollout::advance(self, x, u, disturbance, trace)
    }

    /// Propagates the sensitivities through the prediction that left `trace`.
    fn propagate(
        &self,
        trace: &Self::Trace,
        stage: &Stage<'_, NY>,
        sensitivities: &mut Sensitivities<'_, NU, NY, DD>,
    ) {
        let mut jacobian = Jacobian::ZERO;
        self.jacobian(trace, &mut jacobian);
        propagate(&jacobian, stage, sensitivities);
    }

    /// [`Propagate::propagate`] where the channels are predicted: their sensitivities are in
    /// `channels`.
    fn propagate_channels(
        &self,
        trace: &Self::Trace,
        stage: &Stage<'_, NY>,
        sensitivities: &mut Sensitivities<'_, NU, NY, DD>,
        channels: &mut [[[f32; NU]; NS]],
    ) {
        let (mut jacobian, mut of_channels) = (Jacobian::ZERO, ChannelJacobian::ZERO);
        self.jacobian(trace, &mut jacobian);
        self.channel_jacobian(trace, &mut of_channels);
        propagate_channels(&jacobian, &of_channels, stage, sensitivities, channels);
    }
}

/// One prediction further:
///
/// dy(k+j+1)/dv_b = sum_lag df/dy(k+j-lag) dy(k+j-lag)/dv_b + sum_lag df/du(k+j-lag)
/// du(k+j-lag)/dv_b.
///
/// Cost: per block that has an effect `NY NY NU DD` multiply-adds, per pair of them `NU NU NY`.
#[inline(always)]
pub fn propagate<const NU: usize, const NY: usize, const ND: usize, const DD: usize>(
    jacobian: &Jacobian<NU, NY, ND, DD>,
    stage: &Stage<'_, NY>,
    sensitivities: &mut Sensitivities<'_, NU, NY, DD>,
) {
    for lags in sensitivities.blocks.iter_mut().take(stage.active_before) {
        let mut next = [[0.0; NU]; NY];
        for (jac, past) in jacobian.y.iter().zip(lags.iter()) {
            add_product(&mut next, jac, past);
        }
        push(lags, &next);
    }
    enter_inputs(&jacobian.u, stage.inputs, sensitivities.blocks);
    add_up(stage, sensitivities);
}

/// [`propagate`] where the channels are predicted too: `channels[b][r][c]` is the derivative of
/// s_r(k+j) by the command of channel c at the end of block b.
///
/// ds(k+j+1)/dv_b is the sum of ds/dx dx/dv_b over all of x, and dy(k+j+1)/dv_b has dy/ds ds/dv_b
/// more. Cost: per block with an effect `NS NU (NY + NY DD + NS)` multiply-adds more.
pub fn propagate_channels<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
>(
    jacobian: &Jacobian<NU, NY, ND, DD>,
    of_channels: &ChannelJacobian<NU, NY, NS, ND, DD>,
    stage: &Stage<'_, NY>,
    sensitivities: &mut Sensitivities<'_, NU, NY, DD>,
    channels: &mut [[[f32; NU]; NS]],
) {
    let blocks = sensitivities.blocks.iter_mut().zip(channels.iter_mut());
    for (lags, channel) in blocks.take(stage.active_before) {
        let (mut next, mut next_channel) = ([[0.0; NU]; NY], [[0.0; NU]; NS]);
        for ((by_y, of_s), past) in jacobian.y.iter().zip(&of_channels.y).zip(lags.iter()) {
            add_product(&mut next, by_y, past);
            add_product(&mut next_channel, of_s, past);
        }
        add_product(&mut next, &of_channels.y_by_s, channel);
        add_product(&mut next_channel, &of_channels.s, channel);
        push(lags, &next);
        *channel = next_channel;
    }
    enter_inputs(&jacobian.u, stage.inputs, sensitivities.blocks);
    for (place, direct) in stage.inputs.iter().rev().zip(&of_channels.u) {
        let Interpolation { block, weight } = *place;
        if let Some(channel) = channels.get_mut(block) {
            add_scaled(channel, weight, direct);
        }
        if let Some(channel) = channels.get_mut(block.wrapping_sub(1)) {
            add_scaled(channel, 1.0 - weight, direct);
        }
    }
    add_up(stage, sensitivities);
}

/// Effect of a command at the end of a block on the regressor: `u[i]` is
/// du(k+j-i)/dv_b, the same for each channel, `y[i][r][c]` dy_r(k+j-i)/dv_b,c, `s[r][c]`
/// ds_r(k+j)/dv_b,c.
pub struct Direction<
    'a,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
> {
    /// Of the commands.
    pub u: [f32; ND],
    /// Of the outputs.
    pub y: &'a [[[f32; NU]; NY]; DD],
    /// Of the channels.
    pub s: &'a [[f32; NU]; NS],
}

/// [`propagate_channels`] by `along`, which takes a direction to the derivatives of the next output
/// and channels: less work than all of their Jacobian where there are fewer commands than channels.
#[inline(always)]
pub fn propagate_along<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
>(
    stage: &Stage<'_, NY>,
    sensitivities: &mut Sensitivities<'_, NU, NY, DD>,
    channels: &mut [[[f32; NU]; NS]],
    along: impl Fn(&Direction<'_, NU, NY, NS, ND, DD>) -> ([[f32; NU]; NY], [[f32; NU]; NS]),
) {
    let blocks = sensitivities.blocks.iter_mut().zip(channels.iter_mut());
    for (b, (lags, channel)) in blocks.take(stage.active).enumerate() {
        let mut u = [0.0; ND];
        for (u, place) in u.iter_mut().zip(stage.inputs.iter().rev()) {
            let Interpolation { block, weight } = *place;
            if block == b {
                *u = weight;
            } else if block == b + 1 {
                *u = 1.0 - weight;
            }
        }
        let (y, s) = along(&Direction {
            u,
            y: lags,
            s: channel,
        });
        push(lags, &y);
        *channel = s;
    }
    add_up(stage, sensitivities);
}

/// Makes room at the newest place; the oldest is lost. Element by element: rows that are moved
/// whole become calls of memmove.
#[inline(always)]
fn push<const NU: usize, const NY: usize, const DD: usize>(
    lags: &mut [[[f32; NU]; NY]; DD],
    newest: &[[f32; NU]; NY],
) {
    for (r, row) in newest.iter().enumerate() {
        let mut carry = *row;
        for lag in lags.iter_mut() {
            core::mem::swap(&mut lag[r], &mut carry);
        }
    }
}

/// Direct effect of the commands: `df/du(k+j-lag) du(k+j-lag)/dv_b`.
#[inline(always)]
pub(crate) fn enter_inputs<const NU: usize, const NY: usize, const ND: usize, const DD: usize>(
    by_input: &[[[f32; NU]; NY]; ND],
    inputs: &[Interpolation],
    blocks: &mut [[[[f32; NU]; NY]; DD]],
) {
    for (place, direct) in inputs.iter().rev().zip(by_input) {
        let Interpolation { block, weight } = *place;
        if let Some(lags) = blocks.get_mut(block) {
            add(lags, weight, direct);
        }
        if weight < 1.0 {
            if let Some(lags) = blocks.get_mut(block.wrapping_sub(1)) {
                add(lags, 1.0 - weight, direct);
            }
        }
    }
}

/// The step's part of gradient and Hessian.
#[inline(always)]
pub(crate) fn add_up<const NU: usize, const NY: usize, const DD: usize>(
    stage: &Stage<'_, NY>,
    sensitivities: &mut Sensitivities<'_, NU, NY, DD>,
) {
    let Some(weighted) = stage.weighted else {
        return;
    };
    // Copies: what lies behind references that might overlap would be read again for every product.
    let (weighted, tracking) = (*weighted, *stage.tracking);
    let mut pairs = sensitivities.pairs.iter_mut();
    let active = sensitivities.blocks.iter().take(stage.active);
    for (b, (lags, gradient)) in active.zip(sensitivities.gradient.iter_mut()).enumerate() {
        let Some(s) = lags.first() else { continue };
        let (mut qs, mut sum) = ([[0.0; NU]; NY], *gradient);
        for (((qs, s), q), weighted) in qs.iter_mut().zip(s).zip(&tracking).zip(&weighted) {
            for ((qs, s), sum) in qs.iter_mut().zip(s).zip(&mut sum) {
                *sum += s * weighted;
                *qs = s * q;
            }
        }
        *gradient = sum;
        for (lags, pair) in sensitivities.blocks.iter().take(b + 1).zip(&mut pairs) {
            let Some(s) = lags.first() else { continue };
            let s = *s;
            for (a, sums) in pair.iter_mut().enumerate() {
                let mut sum = *sums;
                for (qs, s) in qs.iter().zip(&s) {
                    for (sum, s) in sum.iter_mut().zip(s) {
                        *sum += qs[a] * s;
                    }
                }
                *sums = sum;
            }
        }
    }
}

/// `newest += weight direct`.
#[inline(always)]
fn add<const NU: usize, const NY: usize, const DD: usize>(
    lags: &mut [[[f32; NU]; NY]; DD],
    weight: f32,
    direct: &[[f32; NU]; NY],
) {
    if let Some(newest) = lags.first_mut() {
        add_scaled(newest, weight, direct);
    }
}

/// `sum += weight a`.
#[inline(always)]
pub(crate) fn add_scaled<const R: usize, const C: usize>(
    sum: &mut [[f32; C]; R],
    weight: f32,
    a: &[[f32; C]; R],
) {
    for (sum, a) in sum.iter_mut().zip(a) {
        for (sum, a) in sum.iter_mut().zip(a) {
            *sum += weight * a;
        }
    }
}

/// `sum += a b`.
#[inline(always)]
pub(crate) fn add_product<const R: usize, const K: usize, const C: usize>(
    sum: &mut [[f32; C]; R],
    a: &[[f32; K]; R],
    b: &[[f32; C]; K],
) {
    for (sum, a) in sum.iter_mut().zip(a) {
        for (a, b) in a.iter().zip(b) {
            for (sum, b) in sum.iter_mut().zip(b) {
                *sum += a * b;
            }
        }
    }
}
