//! What the controller asks of a predictor: the one trait that generated code implements.

use crate::mpc::prediction::{self, Trajectory};
use crate::mpc::tangent::{self, Stage, Tangent};
use crate::mpc::{Problem, Quadratic};

/// What a predictor looks at: the last `ND` inputs, the last `DD` outputs and `NS` sensor channels,
/// all in model units (scaled). Index 0 is the newest: `u[0]` is u(k), `y[1]` is y(k-1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regressor<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
> {
    /// Inputs u(k), u(k-1), ... u(k-ND+1).
    pub u: [[f32; NU]; ND],
    /// Outputs y(k), y(k-1), ... y(k-DD+1).
    pub y: [[f32; NY]; DD],
    /// Channels s(k): sensors, or what a recurrent network remembers. Over the horizon they hold their last
    /// value, or are predicted ([`Model::PREDICTS_CHANNELS`]).
    pub s: [f32; NS],
}

/// Derivatives of the next output: `u[i][r][c]` is dy_r(k+1)/du_c(k-i), `y[i][r][c]` is
/// dy_r(k+1)/dy_c(k-i).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jacobian<const NU: usize, const NY: usize, const ND: usize, const DD: usize> {
    /// With respect to the inputs, newest first.
    pub u: [[[f32; NU]; NY]; ND],
    /// With respect to the outputs, newest first.
    pub y: [[[f32; NY]; NY]; DD],
}

/// Derivatives that only predicted channels have: of the next output by the channels, and of the next
/// channels by everything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelJacobian<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
> {
    /// `[r][c]` is dy_r(k+1)/ds_c(k).
    pub y_by_s: [[f32; NS]; NY],
    /// `[i][r][c]` is ds_r(k+1)/du_c(k-i).
    pub u: [[[f32; NU]; NS]; ND],
    /// `[i][r][c]` is ds_r(k+1)/dy_c(k-i).
    pub y: [[[f32; NY]; NS]; DD],
    /// `[r][c]` is ds_r(k+1)/ds_c(k).
    pub s: [[f32; NS]; NS],
}

/// A one-step predictor y(k+1) = f(u(k)..u(k-ND+1), y(k)..y(k-DD+1), s(k)) (docs/explanation/controller.md, eq. 1).
///
/// Every function is pure, allocates nothing, does a fixed amount of work and never panics; a NaN in
/// the regressor reaches every output.
pub trait Model<const NU: usize, const NY: usize, const NS: usize, const ND: usize, const DD: usize>
{
    /// What a prediction leaves for its derivatives, so that nothing is computed twice: the
    /// activations of the layers.
    type Trace: Copy;

    /// A trace before any prediction.
    const TRACE: Self::Trace;

    /// Whether the channels follow [`Model::channels`] over the horizon, with derivatives (docs/explanation/controller.md,
    /// eq. 5a). What a recurrent network remembers is such a channel, one that nobody measures. Costs
    /// nothing where it is off.
    const PREDICTS_CHANNELS: bool = false;

    /// R: what the square of each planned command costs, in model units, so that inputs that can do each other's work share it
    /// (docs/explanation/controller.md, eq. 4c). Costs nothing where it is 0.
    const COMMAND_WEIGHT: f32 = 0.0;

    /// L: how much of a measurement enters the history, over 0 to 1; the rest is the prediction (docs/explanation/controller.md, eq. 10c). What is
    /// measured enters as it is where it is 1, at no cost.
    const OBSERVER_GAIN: f32 = 1.0;

    /// The next output; `trace` is overwritten.
    fn predict(&self, x: &Regressor<NU, NY, NS, ND, DD>, trace: &mut Self::Trace) -> [f32; NY];

    /// The exact derivatives of the prediction that left `trace`; `jacobian` is overwritten.
    fn jacobian(&self, trace: &Self::Trace, jacobian: &mut Jacobian<NU, NY, ND, DD>);

    /// The next channels s(k+1), from the prediction at `x` that left `trace`; `x.s` where they are held.
    fn channels(&self, x: &Regressor<NU, NY, NS, ND, DD>, _trace: &Self::Trace) -> [f32; NS] {
        x.s
    }

    /// Their derivatives, and those of the output by them; `jacobian` comes in all zero.
    fn channel_jacobian(
        &self,
        _trace: &Self::Trace,
        _jacobian: &mut ChannelJacobian<NU, NY, NS, ND, DD>,
    ) {
    }

    /// What a plan costs beside J: nothing, or the barrier of a [`Barred`](crate::mpc::barrier::Barred)
    /// model (docs/explanation/controller.md, eq. 4b).
    fn penalty<const N: usize, const NB: usize, const NV: usize>(
        _problem: &Problem<'_, Self, NU, NY, NS, ND, DD, N, NB, NV>,
        _plan: &[f32; NV],
    ) -> f32
    where
        Self: Sized,
    {
        0.0
    }

    /// Adds the penalty's halved derivatives, and to H what Gauss-Newton leaves out: nothing, or, for an
    /// [`Exact`](crate::mpc::exact::Exact) model, the second derivatives of the predictions (eq. 7a).
    fn curve<const N: usize, const NB: usize, const NV: usize>(
        _problem: &Problem<'_, Self, NU, NY, NS, ND, DD, N, NB, NV>,
        _plan: &[f32; NV],
        _trajectory: &Trajectory<Self::Trace, NY, N>,
        _quadratic: &mut Quadratic<NV>,
    ) where
        Self: Sized,
    {
    }

    /// A step of the horizon: enters u(k+j) into `x`, predicts, adds the disturbance, and enters the result.
    ///
    /// Generated models repeat this body, and that of [`Model::carry`], as code of their own crate: these
    /// two are most of a control step, and are compiled for speed where the rest is compiled for size.
    fn advance(
        &self,
        x: &mut Regressor<NU, NY, NS, ND, DD>,
        u: &[f32; NU],
        disturbance: &[f32; NY],
        trace: &mut Self::Trace,
    ) -> [f32; NY] {
        prediction::advance(self, x, u, disturbance, trace)
    }

    /// A step of the derivatives: those of the prediction that left `trace`, and what follows from them.
    fn carry(
        &self,
        trace: &Self::Trace,
        stage: &Stage<'_, NY>,
        tangent: &mut Tangent<'_, NU, NY, DD>,
    ) {
        let mut jacobian = Jacobian::ZERO;
        self.jacobian(trace, &mut jacobian);
        tangent::carry(&jacobian, stage, tangent);
    }

    /// As [`Model::carry`] where the channels are predicted: theirs are in `channels`
    /// ([`tangent::carry_channels`]).
    fn carry_channels(
        &self,
        trace: &Self::Trace,
        stage: &Stage<'_, NY>,
        tangent: &mut Tangent<'_, NU, NY, DD>,
        channels: &mut [[[f32; NU]; NS]],
    ) {
        let (mut jacobian, mut of_channels) = (Jacobian::ZERO, ChannelJacobian::ZERO);
        self.jacobian(trace, &mut jacobian);
        self.channel_jacobian(trace, &mut of_channels);
        tangent::carry_channels(&jacobian, &of_channels, stage, tangent, channels);
    }
}

impl<const NU: usize, const NY: usize, const ND: usize, const DD: usize> Jacobian<NU, NY, ND, DD> {
    /// All zero.
    pub const ZERO: Self = Self {
        u: [[[0.0; NU]; NY]; ND],
        y: [[[0.0; NY]; NY]; DD],
    };
}

impl<const NU: usize, const NY: usize, const NS: usize, const ND: usize, const DD: usize>
    ChannelJacobian<NU, NY, NS, ND, DD>
{
    /// All zero.
    pub const ZERO: Self = Self {
        y_by_s: [[0.0; NS]; NY],
        u: [[[0.0; NU]; NS]; ND],
        y: [[[0.0; NY]; NS]; DD],
        s: [[0.0; NS]; NS],
    };
}

/// A predictor with second derivatives: what [`Exact`](crate::mpc::exact::Exact) asks for.
pub trait SecondOrder<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
>: Model<NU, NY, NS, ND, DD>
{
    /// `(sum_r weights_r d2 y_r(k+1) / dx dx) direction` at the prediction that left `trace`: a vector over
    /// what the predictor looks at, as `direction` is.
    fn curvature(
        &self,
        trace: &Self::Trace,
        weights: &[f32; NY],
        direction: &Regressor<NU, NY, NS, ND, DD>,
    ) -> Regressor<NU, NY, NS, ND, DD>;
}
