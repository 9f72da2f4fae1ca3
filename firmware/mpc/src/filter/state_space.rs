//! State-space model of the controlled device: [`StateSpace`] and its derivatives.

use crate::budget::Budget;

/// Derivatives of the next state; each row is one state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransitionJacobian<const NX: usize, const NU: usize, const NP: usize> {
    /// `[r][c]` is dx_r(k+1)/dx_c(k).
    pub x: [[f32; NX]; NX],
    /// `[r][c]` is dx_r(k+1)/du_c(k).
    pub u: [[f32; NU]; NX],
    /// `[r][c]` is dx_r(k+1)/dtheta_c.
    pub theta: [[f32; NP]; NX],
}

/// Derivatives of the measurements; each row is one measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasurementJacobian<const NX: usize, const NM: usize, const NP: usize> {
    /// `[r][c]` is dm_r(k)/dx_c(k).
    pub x: [[f32; NX]; NM],
    /// `[r][c]` is dm_r(k)/dtheta_c.
    pub theta: [[f32; NP]; NM],
}

/// A model x(k+1) = f(x(k), u(k), theta), m(k) = h(x(k), theta) with `NX` states, `NU` inputs, `NM`
/// measurements and `NP` parameters (docs/explanation/controller.md, eq. 14).
///
/// The parameters are the few numbers in which devices differ: a mass, a stiffness, a sensor's
/// offset. All values are in model units, so that numbers near 1 are usual.
///
/// Every function is pure, allocates nothing, does a fixed amount of work and never panics.
pub trait StateSpace<const NX: usize, const NU: usize, const NM: usize, const NP: usize> {
    /// Intermediate values that a transition leaves for its derivatives, so that nothing is
    /// computed twice.
    type Trace: Copy;

    /// A trace before any transition.
    const TRACE: Self::Trace;

    /// Most work of the optimisation of a step of [`StateLoop`](crate::StateLoop), as
    /// [`Tuning::BUDGET`](crate::Tuning::BUDGET).
    const BUDGET: Option<Budget> = None;

    /// The next state; `trace` is overwritten.
    fn transition(
        &self,
        x: &[f32; NX],
        u: &[f32; NU],
        theta: &[f32; NP],
        trace: &mut Self::Trace,
    ) -> [f32; NX];

    /// The exact derivatives of the transition that left `trace`; `jacobian` comes in all zero.
    fn transition_jacobian(
        &self,
        trace: &Self::Trace,
        jacobian: &mut TransitionJacobian<NX, NU, NP>,
    );

    /// The measurements in state `x`, without noise.
    fn measure(&self, x: &[f32; NX], theta: &[f32; NP]) -> [f32; NM];

    /// Their exact derivatives; `jacobian` comes in all zero.
    fn measurement_jacobian(
        &self,
        x: &[f32; NX],
        theta: &[f32; NP],
        jacobian: &mut MeasurementJacobian<NX, NM, NP>,
    );
}

impl<const NX: usize, const NU: usize, const NP: usize> TransitionJacobian<NX, NU, NP> {
    /// All zero.
    pub const ZERO: Self = Self {
        x: [[0.0; NX]; NX],
        u: [[0.0; NU]; NX],
        theta: [[0.0; NP]; NX],
    };
}

impl<const NX: usize, const NM: usize, const NP: usize> MeasurementJacobian<NX, NM, NP> {
    /// All zero.
    pub const ZERO: Self = Self {
        x: [[0.0; NX]; NM],
        theta: [[0.0; NP]; NM],
    };
}
