//! Predictors and problems of the controller drawn from seeds, and what the controller makes of
//! them: the same numbers on this computer and on a Cortex-M4F, bit by bit.
//!
//! `firmware/mpc/tests/hessian.rs` and `firmware/mpc/tests/recurrent` hold thousands of the same
//! cases, of the same seeds, against double precision; `tests/tests/vectors.rs` runs the program of
//! this crate in QEMU and compares bits.

#![no_std]

pub mod case;
pub mod cells;
pub mod differenced;
pub mod random;
pub mod shallow;

/// The kernels, by the names that they have in a printed network.
mod layers {
    pub use sinew_kernels::layers::{activation as sigmoid, activation as tanh, gru, lstm};
}

use sinew_mpc::exact_hessian::Exact;
use sinew_mpc::model::SecondOrder;
use sinew_mpc::{Horizons, Propagate, Quadratic};

use case::{Case, FAR, REMEMBERED};
use cells::{Drawn, GruNet, LstmNet};
use random::Random;
use shallow::Shallow;

/// Cases of each kind.
pub const CASES: usize = 20;

/// Says J, half of its gradient and half of its Hessian of every case, kind by kind.
pub fn every(mut say: impl FnMut(f32)) {
    dense::<12, 10, 2, 3, 0, 3, 2, 10, 4, 8>(21, &Horizons::new(1, [2, 2, 3, 3]), &mut say);
    dense::<12, 8, 2, 3, 0, 3, 2, 7, 2, 4>(23, &Horizons::new(3, [1, 2]), &mut say);
    dense::<5, 6, 1, 1, 1, 2, 2, 8, 1, 1>(24, &Horizons::every_step(), &mut say);
    recurrent::<GruNet<5, 5, 3>, 2, 3, 5, 6>(51, &mut say);
    recurrent::<LstmNet<5, 4, 3>, 2, 3, 8, 6>(53, &mut say);
}

/// The exact Hessian, then Gauss-Newton's.
fn dense<
    const NX: usize,
    const H: usize,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
>(
    seed: u64,
    horizons: &Horizons<N, NB>,
    say: &mut impl FnMut(f32),
) where
    Shallow<NX, H, NY>: SecondOrder<NU, NY, NS, ND, DD>,
{
    let mut random = Random(seed);
    for case in 0..CASES {
        let net = Exact(Shallow::<NX, H, NY>::random(&mut random, case % 2 == 1));
        let drawn = Case::<NU, NY, NS, ND, DD, N, NV>::draw(&mut random, FAR);
        tell(&drawn.derive(&net, horizons), say);
        tell(&drawn.derive(&net.0, horizons), say);
    }
}

/// Gauss-Newton's Hessian through outputs and memory.
fn recurrent<M, const NU: usize, const NY: usize, const NS: usize, const NV: usize>(
    seed: u64,
    say: &mut impl FnMut(f32),
) where
    M: Drawn + Propagate<NU, NY, NS, 1, 1>,
{
    let mut random = Random(seed);
    for _ in 0..CASES {
        let model = M::random(&mut random);
        let drawn = Case::<NU, NY, NS, 1, 1, 8, NV>::draw(&mut random, REMEMBERED);
        tell(&drawn.derive(&model, &Horizons::new(1, [1, 2, 3])), say);
    }
}

fn tell<const NV: usize>((cost, quadratic): &(f32, Quadratic<NV>), say: &mut impl FnMut(f32)) {
    say(*cost);
    let values = quadratic.gradient.iter();
    values
        .chain(quadratic.hessian.as_flattened())
        .for_each(|value| say(*value));
}
