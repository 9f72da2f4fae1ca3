//! Layer kernels against plain f64 loops: values and Jacobians of deep, shallow and one-layer
//! networks.
#![allow(
    clippy::needless_range_loop,
    reason = "the indices are those of the equations, over several arrays at once"
)]

mod common;

use common::Random;
use sinew_mpc::model::{Jacobian, Regressor};
use sinew_mpc::network;

const NX: usize = 2 * 3 + 3 * 2 + 4;
type X = Regressor<2, 3, 4, 3, 2>;

#[derive(Clone, Copy, PartialEq, Debug)]
enum Act {
    Linear,
    Tanh,
    Relu,
    Sigmoid,
}

impl Act {
    fn exact(self, x: f64) -> f64 {
        match self {
            Act::Linear => x,
            Act::Tanh => f64::tanh(x),
            Act::Relu => x.max(0.0),
            Act::Sigmoid => 1.0 / (1.0 + f64::exp(-x)),
        }
    }

    fn apply<const N: usize>(self, y: &mut [f32; N]) -> [f32; N] {
        match self {
            Act::Linear => [1.0; N],
            Act::Tanh => {
                network::tanh(y);
                network::tanh_slope(y)
            }
            Act::Relu => {
                network::relu(y);
                network::relu_slope(y)
            }
            Act::Sigmoid => {
                network::sigmoid(y);
                network::sigmoid_slope(y)
            }
        }
    }
}

struct Deep {
    w1: [[f32; NX]; 7],
    b1: [f32; 7],
    w2: [[f32; 7]; 5],
    b2: [f32; 5],
    w3: [[f32; 5]; 3],
    b3: [f32; 3],
    acts: [Act; 3],
}

impl Deep {
    fn random(random: &mut Random, acts: [Act; 3]) -> Self {
        Self {
            w1: random.matrix(0.6),
            b1: random.array(0.5),
            w2: random.matrix(0.8),
            b2: random.array(0.5),
            w3: random.matrix(0.8),
            b3: random.array(0.5),
            acts,
        }
    }

    fn f32(&self, x: &X, jacobian: &mut Jacobian<2, 3, 3, 2>) -> [f32; 3] {
        let flat: [f32; NX] = network::flatten(x);
        let (mut a1, mut a2, mut y) = ([0.0; 7], [0.0; 5], [0.0; 3]);
        network::dense(&self.w1, &self.b1, &flat, &mut a1);
        let s1 = self.acts[0].apply(&mut a1);
        network::dense(&self.w2, &self.b2, &a1, &mut a2);
        let s2 = self.acts[1].apply(&mut a2);
        network::dense(&self.w3, &self.b3, &a2, &mut y);
        let s3 = self.acts[2].apply(&mut y);
        let (mut t2, mut t1) = ([[0.0; 3]; 5], [[0.0; 3]; 7]);
        network::seed(&self.w3, &s3, &s2, &mut t2);
        network::chain(&t2, &self.w2, &s1, &mut t1);
        network::input_jacobian(&t1, &self.w1, false, jacobian);
        y
    }

    fn f64(&self, x: &[f64; NX]) -> [f64; 3] {
        fn layer<const I: usize, const O: usize>(
            w: &[[f32; I]; O],
            b: &[f32; O],
            act: Act,
            x: &[f64; I],
        ) -> [f64; O] {
            core::array::from_fn(|r| {
                let sum: f64 = (0..I).map(|i| f64::from(w[r][i]) * x[i]).sum();
                act.exact(sum + f64::from(b[r]))
            })
        }
        let a1 = layer(&self.w1, &self.b1, self.acts[0], x);
        let a2 = layer(&self.w2, &self.b2, self.acts[1], &a1);
        layer(&self.w3, &self.b3, self.acts[2], &a2)
    }
}

fn random_x(random: &mut Random) -> X {
    Regressor {
        u: random.matrix(1.0),
        y: random.matrix(1.0),
        s: random.array(1.0),
    }
}

/// The flat column of every Jacobian entry, in the order of `flatten`.
fn columns(jacobian: &Jacobian<2, 3, 3, 2>) -> Vec<[f32; 3]> {
    let mut columns = Vec::new();
    for lag in &jacobian.u {
        for c in 0..2 {
            columns.push(core::array::from_fn(|r| lag[r][c]));
        }
    }
    for lag in &jacobian.y {
        for c in 0..3 {
            columns.push(core::array::from_fn(|r| lag[r][c]));
        }
    }
    columns
}

const NOTHING: Jacobian<2, 3, 3, 2> = Jacobian {
    u: [[[f32::NAN; 2]; 3]; 3],
    y: [[[f32::NAN; 3]; 3]; 2],
};

#[test]
fn deep_networks_agree_with_f64_in_value_and_jacobian() {
    let acts = [
        [Act::Tanh, Act::Tanh, Act::Linear],
        [Act::Relu, Act::Tanh, Act::Tanh],
        [Act::Sigmoid, Act::Relu, Act::Sigmoid],
    ];
    let mut random = Random(7);
    let mut largest = 0.0_f64;
    for case in 0..600 {
        let net = Deep::random(&mut random, acts[case % 3]);
        let x = random_x(&mut random);
        let flat: [f32; NX] = network::flatten(&x);
        let exact_x = flat.map(f64::from);
        let mut jacobian = NOTHING;
        let y = net.f32(&x, &mut jacobian);
        let exact = net.f64(&exact_x);
        for (y, exact) in y.iter().zip(&exact) {
            assert!(
                (f64::from(*y) - exact).abs() < 2e-5,
                "case {case}: {y} and {exact}"
            );
        }
        for (c, column) in columns(&jacobian).iter().enumerate() {
            let step = 1e-6;
            let (mut above, mut below) = (exact_x, exact_x);
            above[c] += step;
            below[c] -= step;
            let (above, below) = (net.f64(&above), net.f64(&below));
            for r in 0..3 {
                let difference = (above[r] - below[r]) / (2.0 * step);
                largest = largest.max(difference.abs());
                let error = (f64::from(column[r]) - difference).abs();
                assert!(
                    error < 1e-4,
                    "case {case}, dy{r}/dx{c}: {} and {difference}",
                    column[r]
                );
            }
        }
    }
    assert!(largest > 0.1, "all Jacobians vanish: nothing was compared");
}

#[test]
fn one_layer_and_increment_have_their_jacobian() {
    let mut random = Random(11);
    let w: [[f32; NX]; 3] = random.matrix(1.0);
    let mut jacobian = NOTHING;
    let mut t = [[0.0; 3]; 3];
    network::seed_diagonal(&[1.0; 3], &mut t);
    network::input_jacobian(&t, &w, false, &mut jacobian);
    let flat = columns(&jacobian);
    for r in 0..3 {
        for c in 0..12 {
            assert_eq!(flat[c][r], w[r][c]);
        }
    }
    network::add_identity(&mut jacobian);
    let increment = columns(&jacobian);
    for r in 0..3 {
        assert_eq!(increment[6 + r][r], w[r][6 + r] + 1.0);
        assert_eq!(increment[9 + r][r], w[r][9 + r]);
    }
}

#[test]
fn seed_linear_is_seed_with_unit_output_slopes() {
    let mut random = Random(13);
    let w: [[f32; 5]; 3] = random.matrix(1.0);
    let slope: [f32; 5] = random.array(1.0);
    let (mut a, mut b) = ([[0.0; 3]; 5], [[1.0; 3]; 5]);
    network::seed_linear(&w, &slope, &mut a);
    network::seed(&w, &[1.0; 3], &slope, &mut b);
    assert_eq!(a, b);
}

#[test]
fn flatten_and_unflatten_are_inverse_and_check_the_length() {
    let x = random_x(&mut Random(3));
    let flat: [f32; NX] = network::flatten(&x);
    assert_eq!(flat[..2], x.u[0]);
    assert_eq!(flat[6..9], x.y[0]);
    assert_eq!(flat[12..], x.s);
    assert_eq!(network::unflatten(&flat), Some(x));
    assert_eq!(network::unflatten::<2, 3, 4, 3, 2>(&flat[1..]), None);
}

#[test]
fn nan_reaches_every_output() {
    let mut random = Random(5);
    let net = Deep::random(&mut random, [Act::Tanh, Act::Relu, Act::Tanh]);
    let mut x = random_x(&mut random);
    x.y[1][2] = f32::NAN;
    let y = net.f32(&x, &mut NOTHING.clone());
    assert!(y.iter().all(|y| y.is_nan()), "{y:?}");
}
