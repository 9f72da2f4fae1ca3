//! What the controller asks of a predictor: the one trait that generated code implements.

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
/// Both functions are pure, allocate nothing, do a fixed amount of work and never panic; a NaN in
/// the regressor reaches every output.
pub trait Model<const NU: usize, const NY: usize, const NS: usize, const ND: usize, const DD: usize>
{
    /// The next output.
    fn predict(&self, x: &Regressor<NU, NY, NS, ND, DD>) -> [f32; NY];

    /// The next output, to the same bits as [`Model::predict`], and its exact derivatives.
    fn predict_with_jacobian(
        &self,
        x: &Regressor<NU, NY, NS, ND, DD>,
        jacobian: &mut Jacobian<NU, NY, ND, DD>,
    ) -> [f32; NY];
}
