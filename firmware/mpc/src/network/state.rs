//! Trained state-space model: a linear part and one hidden layer
//! (docs/explanation/controller.md, eq. 20).

use crate::filter::{MeasurementJacobian, StateSpace, TransitionJacobian};
use crate::math;

/// Weights of x(k+1) = x + A z + b + G tanh(W z + w), with z = (x, u, theta), and of m = C x + c
/// (docs/explanation/controller.md, eq. 20). Everything is in model units; scalings of a trainer
/// are folded into the weights. `NZ = NX + NU + NP`, `H` hidden units.
///
/// ```
/// use sinew_mpc::filter::StateSpace;
/// use sinew_mpc::network::state::StateNetwork;
///
/// // A damped mass of one state: v+ = v + 0.1 u - 0.2 tanh(2 v), read as it is.
/// let model = StateNetwork::<1, 1, 1, 0, 2, 1> {
///     linear: [[0.0, 0.1]],
///     bias: [0.0],
///     hidden: [[2.0, 0.0]],
///     hidden_bias: [0.0],
///     output: [[-0.2]],
///     measurement: [[1.0]],
///     measurement_bias: [0.0],
/// };
/// let mut trace = StateNetwork::<1, 1, 1, 0, 2, 1>::TRACE;
/// let [v] = model.transition(&[0.5], &[1.0], &[], &mut trace);
/// assert!((v - (0.6 - 0.2 * 0.761_594)).abs() < 1e-5);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateNetwork<
    const NX: usize,
    const NU: usize,
    const NM: usize,
    const NP: usize,
    const NZ: usize,
    const H: usize,
> {
    /// A: change of the state by z.
    pub linear: [[f32; NZ]; NX],
    /// b.
    pub bias: [f32; NX],
    /// W, a row a unit.
    pub hidden: [[f32; NZ]; H],
    /// w.
    pub hidden_bias: [f32; H],
    /// G, a row a state.
    pub output: [[f32; H]; NX],
    /// C, a row a measurement.
    pub measurement: [[f32; NX]; NM],
    /// c.
    pub measurement_bias: [f32; NM],
}

impl<
    const NX: usize,
    const NU: usize,
    const NM: usize,
    const NP: usize,
    const NZ: usize,
    const H: usize,
> StateSpace<NX, NU, NM, NP> for StateNetwork<NX, NU, NM, NP, NZ, H>
{
    /// Values of the hidden units.
    type Trace = [f32; H];
    const TRACE: Self::Trace = [0.0; H];

    /// Cost: `NZ (H + NX) + H NX` multiply-adds and `H` tanh.
    #[inline(always)]
    fn transition(
        &self,
        x: &[f32; NX],
        u: &[f32; NU],
        theta: &[f32; NP],
        trace: &mut Self::Trace,
    ) -> [f32; NX] {
        const { assert!(NZ == NX + NU + NP, "z is state, inputs and parameters") };
        let mut z = [0.0; NZ];
        for (place, value) in z.iter_mut().zip(x.iter().chain(u).chain(theta)) {
            *place = *value;
        }
        super::dense_tanh(&self.hidden, &self.hidden_bias, &z, trace);
        let mut next = *x;
        for (i, next) in next.iter_mut().enumerate() {
            let mut change = self.bias[i];
            for (a, z) in self.linear[i].iter().zip(&z) {
                change += a * z;
            }
            for (g, unit) in self.output[i].iter().zip(trace.iter()) {
                change += g * unit;
            }
            *next += change;
        }
        next
    }

    /// I + A + G diag(1 - tanh^2) W, in three blocks, of which the parameters' is not computed
    /// where nothing asks for it. Cost: `NX NZ (H + 1)` multiply-adds.
    #[inline(always)]
    fn transition_jacobian(
        &self,
        trace: &Self::Trace,
        jacobian: &mut TransitionJacobian<NX, NU, NP>,
    ) {
        let mut by_unit = self.output;
        for row in &mut by_unit {
            for (g, unit) in row.iter_mut().zip(trace) {
                *g *= math::tanh_slope(*unit);
            }
        }
        self.columns(&by_unit, 0, &mut jacobian.x);
        for (i, row) in jacobian.x.iter_mut().enumerate() {
            row[i] += 1.0;
        }
        self.columns(&by_unit, NX, &mut jacobian.u);
        self.columns(&by_unit, NX + NU, &mut jacobian.theta);
    }

    #[inline(always)]
    fn measure(&self, x: &[f32; NX], _: &[f32; NP]) -> [f32; NM] {
        let mut m = self.measurement_bias;
        for (m, row) in m.iter_mut().zip(&self.measurement) {
            for (c, x) in row.iter().zip(x) {
                *m += c * x;
            }
        }
        m
    }

    #[inline(always)]
    fn measurement_jacobian(
        &self,
        _: &[f32; NX],
        _: &[f32; NP],
        jacobian: &mut MeasurementJacobian<NX, NM, NP>,
    ) {
        jacobian.x = self.measurement;
    }
}

impl<
    const NX: usize,
    const NU: usize,
    const NM: usize,
    const NP: usize,
    const NZ: usize,
    const H: usize,
> StateNetwork<NX, NU, NM, NP, NZ, H>
{
    /// Derivatives by the part of z from `first` on.
    #[inline(always)]
    fn columns<const C: usize>(
        &self,
        by_unit: &[[f32; H]; NX],
        first: usize,
        block: &mut [[f32; C]; NX],
    ) {
        for (block, (linear, by_unit)) in block.iter_mut().zip(self.linear.iter().zip(by_unit)) {
            for (place, a) in block.iter_mut().zip(linear.iter().skip(first)) {
                *place = *a;
            }
            for (g, weights) in by_unit.iter().zip(&self.hidden) {
                for (place, w) in block.iter_mut().zip(weights.iter().skip(first)) {
                    *place += g * w;
                }
            }
        }
    }
}
