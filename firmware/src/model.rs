//! What the controller asks of a predictor: the one trait that generated code implements.

use crate::mpc::prediction;
use crate::mpc::tangent::{self, Stage, Tangent};

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
    /// Sensor channels s(k); over the horizon they hold their last reading.
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

/// A one-step predictor y(k+1) = f(u(k)..u(k-ND+1), y(k)..y(k-DD+1), s(k)) (docs/mpc.md, eq. 1).
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

    /// The next output; `trace` is overwritten.
    fn predict(&self, x: &Regressor<NU, NY, NS, ND, DD>, trace: &mut Self::Trace) -> [f32; NY];

    /// The exact derivatives of the prediction that left `trace`; `jacobian` is overwritten.
    fn jacobian(&self, trace: &Self::Trace, jacobian: &mut Jacobian<NU, NY, ND, DD>);

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
        stage: &Stage<'_, NY, ND>,
        tangent: &mut Tangent<'_, NU, NY, DD>,
    ) {
        let mut jacobian = Jacobian::ZERO;
        self.jacobian(trace, &mut jacobian);
        tangent::carry(&jacobian, stage, tangent);
    }
}

impl<const NU: usize, const NY: usize, const ND: usize, const DD: usize> Jacobian<NU, NY, ND, DD> {
    /// All zero.
    pub const ZERO: Self = Self {
        u: [[[0.0; NU]; NY]; ND],
        y: [[[0.0; NY]; NY]; DD],
    };
}
