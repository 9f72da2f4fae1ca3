//! A network with one hidden layer as predictor, by the kernels that printed networks call.

use sinew_mpc::model::{Jacobian, Model, Regressor, SecondOrder};
use sinew_mpc::network::{self, curvature};
use sinew_mpc::sensitivity::Propagate;
use sinew_mpc::tuning::Tuning;

use super::random::Random;

/// NX - H (tanh) - NY, as `y` or as an increment of it.
#[derive(Clone)]
pub struct Shallow<const NX: usize, const H: usize, const NY: usize> {
    /// Weights of the hidden layer.
    pub w1: [[f32; NX]; H],
    /// Their biases.
    pub b1: [f32; H],
    /// Weights of the outputs.
    pub w2: [[f32; H]; NY],
    /// Their biases.
    pub b2: [f32; NY],
    /// Adds y(k).
    pub increment: bool,
}

impl<const NX: usize, const H: usize, const NY: usize> Shallow<NX, H, NY> {
    /// Weights that neither vanish nor saturate.
    pub fn random(random: &mut Random, increment: bool) -> Self {
        let scale = 1.5 / root(NX);
        Self {
            w1: random.matrix(scale),
            b1: random.array(0.3),
            w2: random.matrix(if increment { 0.3 } else { 0.6 }),
            b2: random.array(0.1),
            increment,
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
> Propagate<NU, NY, NS, ND, DD> for Shallow<NX, H, NY>
{
}

impl<const NX: usize, const H: usize, const NY: usize> Tuning for Shallow<NX, H, NY> {}

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

/// Square root of a small number, by Newton's iteration in double precision: `core` has none.
fn root(n: usize) -> f32 {
    let n = n as f64;
    let mut root = n;
    for _ in 0..12 {
        root = 0.5 * (root + n / root);
    }
    root as f32
}
