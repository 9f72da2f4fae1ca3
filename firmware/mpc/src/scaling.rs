//! Physical units at the edge, model units within: `scaled = (physical - offset) / span`.

/// Scaling of one group of signals. A `span` is the physical range that one model unit stands for;
/// it is finite and not zero, or every scaled value of that signal is not finite and is treated as
/// missing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaling<const N: usize> {
    /// Physical units per model unit.
    pub span: [f32; N],
    /// Physical value of model zero.
    pub offset: [f32; N],
}

impl<const N: usize> Scaling<N> {
    /// Model units are the physical units.
    pub const IDENTITY: Self = Self {
        span: [1.0; N],
        offset: [0.0; N],
    };

    /// `(physical - offset) / span`, each operation rounded to nearest.
    #[inline]
    pub fn to_model(&self, physical: &[f32; N]) -> [f32; N] {
        let mut scaled = *physical;
        for ((value, span), offset) in scaled.iter_mut().zip(&self.span).zip(&self.offset) {
            *value = (*value - offset) / span;
        }
        scaled
    }

    /// `span * scaled + offset`, each operation rounded to nearest.
    #[inline]
    pub fn to_physical(&self, scaled: &[f32; N]) -> [f32; N] {
        let mut physical = *scaled;
        for ((value, span), offset) in physical.iter_mut().zip(&self.span).zip(&self.offset) {
            *value = span * *value + offset;
        }
        physical
    }
}

/// The scalings of a predictor: inputs, outputs and sensor channels.
///
/// ```
/// use sinew_mpc::scaling::{ModelScaling, Scaling};
///
/// // A command of 0 to 10 V becomes -1 to 1; the output is metres in either unit.
/// let scaling: ModelScaling<1, 1, 0> = ModelScaling {
///     u: Scaling { span: [5.0], offset: [5.0] },
///     ..ModelScaling::IDENTITY
/// };
/// assert_eq!(scaling.u.to_model(&[10.0]), [1.0]);
/// assert_eq!(scaling.u.to_physical(&[-1.0]), [0.0]);
/// assert_eq!(scaling.y.to_model(&[0.25]), [0.25]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelScaling<const NU: usize, const NY: usize, const NS: usize> {
    /// Commands.
    pub u: Scaling<NU>,
    /// Controlled outputs, and their references.
    pub y: Scaling<NY>,
    /// Sensor channels.
    pub s: Scaling<NS>,
}

impl<const NU: usize, const NY: usize, const NS: usize> ModelScaling<NU, NY, NS> {
    /// Model units are the physical units.
    pub const IDENTITY: Self = Self {
        u: Scaling::IDENTITY,
        y: Scaling::IDENTITY,
        s: Scaling::IDENTITY,
    };
}
