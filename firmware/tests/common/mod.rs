//! Random networks as predictors, in f32 by the kernels under test and in f64 by plain loops.
#![allow(dead_code, reason = "every test binary uses its own part")]

pub mod rollout;

use proptest::test_runner::{Config as ProptestConfig, RngSeed};
use sinew_firmware::model::{Jacobian, Model, Regressor, SecondOrder};
use sinew_firmware::network::{self, curvature};

/// The same cases in every run, and no file left behind.
pub fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        rng_seed: RngSeed::Fixed(2026),
        failure_persistence: None,
        ..ProptestConfig::with_cases(cases)
    }
}

/// Xorshift: the same cases on every machine.
pub struct Random(pub u64);

impl Random {
    /// Uniform in -1 to 1.
    pub fn signed(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1_u64 << 23) as f32 - 1.0
    }

    /// Uniform in 0 to 1.
    pub fn unit(&mut self) -> f32 {
        0.5 * (self.signed() + 1.0)
    }

    pub fn array<const N: usize>(&mut self, scale: f32) -> [f32; N] {
        core::array::from_fn(|_| scale * self.signed())
    }

    pub fn matrix<const N: usize, const M: usize>(&mut self, scale: f32) -> [[f32; N]; M] {
        core::array::from_fn(|_| self.array(scale))
    }
}

/// NX - H (tanh) - NY, as `y` or as an increment of it.
#[derive(Clone)]
pub struct Shallow<const NX: usize, const H: usize, const NY: usize> {
    pub w1: [[f32; NX]; H],
    pub b1: [f32; H],
    pub w2: [[f32; H]; NY],
    pub b2: [f32; NY],
    pub increment: bool,
}

impl<const NX: usize, const H: usize, const NY: usize> Shallow<NX, H, NY> {
    pub fn random(random: &mut Random, increment: bool) -> Self {
        let scale = 1.5 / (NX as f32).sqrt_by_newton();
        Self {
            w1: random.matrix(scale),
            b1: random.array(0.3),
            w2: random.matrix(if increment { 0.3 } else { 0.6 }),
            b2: random.array(0.1),
            increment,
        }
    }

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

trait Root {
    fn sqrt_by_newton(self) -> f32;
}
impl Root for f32 {
    fn sqrt_by_newton(self) -> f32 {
        f64::from(self).sqrt() as f32
    }
}

impl<
    const NX: usize,
    const H: usize,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
> Model<NU, NY, NS, ND, DD> for Shallow<NX, H, NY>
{
    type Trace = [f32; H];
    const TRACE: [f32; H] = [0.0; H];

    fn predict(&self, x: &Regressor<NU, NY, NS, ND, DD>, a: &mut [f32; H]) -> [f32; NY] {
        let flat: [f32; NX] = network::flatten(x);
        network::dense(&self.w1, &self.b1, &flat, a);
        network::tanh(a);
        let mut y = [0.0; NY];
        network::dense(&self.w2, &self.b2, a, &mut y);
        if self.increment {
            for (y, before) in y.iter_mut().zip(&x.y[0]) {
                *y += before;
            }
        }
        y
    }

    fn jacobian(&self, a: &[f32; H], jacobian: &mut Jacobian<NU, NY, ND, DD>) {
        let mut t = [[0.0; NY]; H];
        network::seed_linear(&self.w2, &network::tanh_slope(a), &mut t);
        network::input_jacobian(&t, &self.w1, false, jacobian);
        if self.increment {
            network::add_identity(jacobian);
        }
    }
}

impl<
    const NX: usize,
    const H: usize,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
> SecondOrder<NU, NY, NS, ND, DD> for Shallow<NX, H, NY>
{
    fn curvature(
        &self,
        a: &[f32; H],
        weights: &[f32; NY],
        direction: &Regressor<NU, NY, NS, ND, DD>,
    ) -> Regressor<NU, NY, NS, ND, DD> {
        let flat: [f32; NX] = network::flatten(direction);
        let slope = network::tanh_slope(a);
        let z = curvature::along(&self.w1, &flat);
        let after: [f32; H] = core::array::from_fn(|h| slope[h] * z[h]);
        let linear = ([1.0; NY], [0.0; NY], curvature::along(&self.w2, &after));
        let top = curvature::Adjoint {
            weights: *weights,
            change: [0.0; NY],
        };
        let hidden = curvature::back(&self.w2, &linear.0, &linear.1, &linear.2, &top);
        let bend = network::tanh_bend(a);
        let first = curvature::back(&self.w1, &slope, &bend, &z, &hidden);
        network::unflatten(&first.change).expect("NX fits the regressor")
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
