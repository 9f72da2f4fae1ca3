//! The predictors of `cells` in double precision, from their equations (docs/reference/networks.md,
//! eq. 5 and 6).

use crate::cells::{Drawn, GruNet, LstmNet, Readout};

/// A predictor that is known in double precision too.
pub trait Exact<const NY: usize, const NS: usize>: Drawn {
    /// The next output and channels from (u, y) and the channels.
    fn exact(&self, x: &[f64], s: &[f64]) -> ([f64; NY], [f64; NS]);
}

impl<C, const H: usize, const NY: usize> Readout<C, H, NY> {
    fn exact_output(&self, h: &[f64]) -> [f64; NY] {
        core::array::from_fn(|r| {
            (0..H).map(|k| f64::from(self.w[r][k]) * h[k]).sum::<f64>() + f64::from(self.b[r])
        })
    }
}

fn sigmoid(z: f64) -> f64 {
    1.0 / (1.0 + (-z).exp())
}

/// `W x + U h + b` of one gate and unit.
fn sum<const NX: usize, const H: usize>(
    w: &[f32; NX],
    u: &[f32; H],
    b: f32,
    x: &[f64],
    h: &[f64],
) -> f64 {
    let product =
        |w: &[f32], x: &[f64]| w.iter().zip(x).map(|(w, x)| f64::from(*w) * x).sum::<f64>();
    f64::from(b) + product(w, x) + product(u, h)
}

impl<const NX: usize, const H: usize, const NY: usize> Exact<NY, H> for GruNet<NX, H, NY> {
    fn exact(&self, x: &[f64], h: &[f64]) -> ([f64; NY], [f64; H]) {
        let c = &self.cell;
        let next = core::array::from_fn(|k| {
            let gate = |g: usize| sum(&c.kernel[g][k], &c.recurrent[g][k], c.bias[g][k], x, h);
            let (z, r) = (sigmoid(gate(0)), sigmoid(gate(1)));
            let inner = sum(&[0.0; NX], &c.recurrent[2][k], c.inner_bias[k], x, h);
            let n = (sum(&c.kernel[2][k], &[0.0; H], c.bias[2][k], x, h) + r * inner).tanh();
            z * h[k] + (1.0 - z) * n
        });
        (self.exact_output(&next), next)
    }
}

impl<const NX: usize, const H: usize, const NY: usize, const NS: usize> Exact<NY, NS>
    for LstmNet<NX, H, NY>
{
    fn exact(&self, x: &[f64], s: &[f64]) -> ([f64; NY], [f64; NS]) {
        let cell = &self.cell;
        let (h, c) = s.split_at(H);
        let mut next = [0.0; NS];
        for k in 0..H {
            let gate = |g: usize| {
                sum(
                    &cell.kernel[g][k],
                    &cell.recurrent[g][k],
                    cell.bias[g][k],
                    x,
                    h,
                )
            };
            next[H + k] = sigmoid(gate(1)) * c[k] + sigmoid(gate(0)) * gate(2).tanh();
            next[k] = sigmoid(gate(3)) * next[H + k].tanh();
        }
        (self.exact_output(&next[..H]), next)
    }
}
