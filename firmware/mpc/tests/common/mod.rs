//! Random networks as predictors, in f32 by the kernels under test and in f64 by plain loops.
#![allow(
    dead_code,
    unused_imports,
    reason = "every test binary uses its own part"
)]

#[path = "../../../../tests/vectors/src/case.rs"]
pub mod case;
pub mod counting;
#[path = "../../../../tests/vectors/src/random.rs"]
pub mod random;
pub mod rollout;
#[path = "../../../../tests/vectors/src/shallow.rs"]
pub mod shallow;

use proptest::test_runner::{Config as ProptestConfig, RngSeed};
pub use random::Random;
pub use shallow::Shallow;
use sinew_mpc::cost::CostTerm;
use sinew_mpc::model::{Jacobian, Model, Regressor};
use sinew_mpc::rollout::Trajectory;
use sinew_mpc::sensitivity::Propagate;
use sinew_mpc::{Problem, Quadratic};

/// Cost, half gradient and half Hessian of a plan.
pub fn quadratic<
    M: CostTerm<NU, NY, NS, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
>(
    problem: &Problem<'_, M, NU, NY, NS, ND, DD, N, NB, NV>,
    plan: &[f32; NV],
) -> (f32, Quadratic<NV>) {
    let mut trajectory = Trajectory::new(M::Model::TRACE, M::RESIDUALS);
    let mut quadratic = Quadratic::new();
    let cost = problem.rollout(plan, &mut trajectory);
    problem.linearise(plan, &trajectory, &mut quadratic);
    (cost, quadratic)
}

/// The same cases in every run, and no file left behind.
pub fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        rng_seed: RngSeed::Fixed(2026),
        failure_persistence: None,
        ..ProptestConfig::with_cases(cases)
    }
}

impl<const NX: usize, const H: usize, const NY: usize> Shallow<NX, H, NY> {
    /// The same network in double precision, x flattened.
    pub fn exact(&self, x: &[f64]) -> [f64; NY] {
        let hidden: [f64; H] = core::array::from_fn(|h| {
            let sum: f64 = (0..NX).map(|i| f64::from(self.w1[h][i]) * x[i]).sum();
            f64::tanh(sum + f64::from(self.b1[h]))
        });
        core::array::from_fn(|r| {
            let sum: f64 = (0..H).map(|h| f64::from(self.w2[r][h]) * hidden[h]).sum();
            sum + f64::from(self.b2[r])
        })
    }
}

/// y(k+1) = a y(k) + b u(k) + b1 u(k-1) per channel: a predictor that a plant can equal.
#[derive(Clone, Copy, Debug)]
pub struct Linear {
    pub a: f32,
    pub b: f32,
    pub b1: f32,
}

impl<const NU: usize, const NS: usize> Model<NU, NU, NS, 2, 1> for Linear {
    type Trace = ();
    const TRACE: () = ();

    fn predict(&self, x: &Regressor<NU, NU, NS, 2, 1>, (): &mut ()) -> [f32; NU] {
        core::array::from_fn(|i| self.a * x.y[0][i] + self.b * x.u[0][i] + self.b1 * x.u[1][i])
    }

    fn jacobian(&self, (): &(), jacobian: &mut Jacobian<NU, NU, 2, 1>) {
        for r in 0..NU {
            for c in 0..NU {
                let here = if r == c { 1.0 } else { 0.0 };
                jacobian.u[0][r][c] = self.b * here;
                jacobian.u[1][r][c] = self.b1 * here;
                jacobian.y[0][r][c] = self.a * here;
            }
        }
    }
}

impl<const NU: usize, const NS: usize> Propagate<NU, NU, NS, 2, 1> for Linear {}
impl sinew_mpc::Tuning for Linear {}
