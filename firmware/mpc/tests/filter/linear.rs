//! Linear model with a matrix for each of its parts, which may change between two periods.

use sinew_mpc::filter::{MeasurementJacobian, StateSpace, TransitionJacobian};

use crate::common::Random;

/// x+ = A x + B u + G theta, m = C x + E theta.
#[derive(Clone, Copy, Debug)]
pub struct Linear<const NX: usize, const NU: usize, const NM: usize, const NP: usize> {
    pub transition: TransitionJacobian<NX, NU, NP>,
    pub measurement: MeasurementJacobian<NX, NM, NP>,
}

fn product<const R: usize, const C: usize>(a: &[[f32; C]; R], b: &[f32; C]) -> [f32; R] {
    core::array::from_fn(|r| a[r].iter().zip(b).map(|(a, b)| a * b).sum())
}

fn sum<const N: usize>(a: [f32; N], b: [f32; N]) -> [f32; N] {
    core::array::from_fn(|i| a[i] + b[i])
}

impl<const NX: usize, const NU: usize, const NM: usize, const NP: usize> Linear<NX, NU, NM, NP> {
    /// Random; A keeps a half of the state and mixes it.
    pub fn random(random: &mut Random) -> Self {
        let mut x: [[f32; NX]; NX] = random.matrix(0.4 / NX as f32);
        for (i, row) in x.iter_mut().enumerate() {
            row[i] += 0.55;
        }
        Self {
            transition: TransitionJacobian {
                x,
                u: random.matrix(1.0),
                theta: random.matrix(1.0),
            },
            measurement: MeasurementJacobian {
                x: random.matrix(1.0),
                theta: random.matrix(1.0),
            },
        }
    }
}

impl<const NX: usize, const NU: usize, const NM: usize, const NP: usize> StateSpace<NX, NU, NM, NP>
    for Linear<NX, NU, NM, NP>
{
    type Trace = ();
    const TRACE: () = ();

    fn transition(
        &self,
        x: &[f32; NX],
        u: &[f32; NU],
        theta: &[f32; NP],
        (): &mut (),
    ) -> [f32; NX] {
        let state = sum(
            product(&self.transition.x, x),
            product(&self.transition.u, u),
        );
        sum(state, product(&self.transition.theta, theta))
    }

    fn transition_jacobian(&self, (): &(), jacobian: &mut TransitionJacobian<NX, NU, NP>) {
        *jacobian = self.transition;
    }

    fn measure(&self, x: &[f32; NX], theta: &[f32; NP]) -> [f32; NM] {
        sum(
            product(&self.measurement.x, x),
            product(&self.measurement.theta, theta),
        )
    }

    fn measurement_jacobian(
        &self,
        _: &[f32; NX],
        _: &[f32; NP],
        jacobian: &mut MeasurementJacobian<NX, NM, NP>,
    ) {
        *jacobian = self.measurement;
    }
}
