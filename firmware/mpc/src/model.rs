//! Predictor of the controlled device: [`Model`], what it sees and its derivatives.

/// Regressor of a predictor: the last `ND` inputs, the last `DD` outputs and `NS` sensor channels,
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
    /// Channels s(k): sensors, or what a recurrent network remembers. Over the horizon they hold
    /// their last value, or are predicted ([`Model::PREDICTS_CHANNELS`]).
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

/// Derivatives that only predicted channels have: of the next output by the channels, and of the
/// next channels by everything.
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

/// A one-step predictor y(k+1) = f(u(k)..u(k-ND+1), y(k)..y(k-DD+1), s(k))
/// (docs/explanation/controller.md, eq. 1).
///
/// Every function is pure, allocates nothing, does a fixed amount of work and never panics; a NaN
/// in the regressor reaches every output.
pub trait Model<const NU: usize, const NY: usize, const NS: usize, const ND: usize, const DD: usize>
{
    /// Intermediate values that a prediction leaves for its derivatives, so that nothing is
    /// computed twice: the activations of the layers.
    type Trace: Copy;

    /// A trace before any prediction.
    const TRACE: Self::Trace;

    /// True if the channels follow [`Model::channels`] over the horizon, with derivatives
    /// (docs/explanation/controller.md, eq. 5a). What a recurrent network remembers is such a
    /// channel, one that nobody measures. Costs nothing where it is off.
    const PREDICTS_CHANNELS: bool = false;

    /// The next output; `trace` is overwritten.
    fn predict(&self, x: &Regressor<NU, NY, NS, ND, DD>, trace: &mut Self::Trace) -> [f32; NY];

    /// The exact derivatives of the prediction that left `trace`; `jacobian` is overwritten.
    fn jacobian(&self, trace: &Self::Trace, jacobian: &mut Jacobian<NU, NY, ND, DD>);

    /// The next channels s(k+1), from the prediction at `x` that left `trace`; `x.s` where they are
    /// held.
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

/// A predictor with second derivatives: what [`Exact`](crate::exact_hessian::Exact) asks for.
pub trait SecondOrder<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
>: Model<NU, NY, NS, ND, DD>
{
    /// `(sum_r weights_r d2 y_r(k+1) / dx dx) direction` at the prediction that left `trace`: a
    /// vector over what the predictor looks at, as `direction` is.
    fn curvature(
        &self,
        trace: &Self::Trace,
        weights: &[f32; NY],
        direction: &Regressor<NU, NY, NS, ND, DD>,
    ) -> Regressor<NU, NY, NS, ND, DD>;
}
