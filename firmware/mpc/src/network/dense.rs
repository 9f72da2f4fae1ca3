//! Layer kernels that generated predictors call: forward, activations and the Jacobian product
//! chain.
//!
//! The Jacobian of a network is W_L D_{L-1} W_{L-1} ... D_1 W_1 with D the diagonal of activation
//! slopes. A network has fewer outputs than inputs, so the product is taken from the output side
//! (docs/explanation/controller.md, eq. 3): [`seed`] (or [`seed_linear`]) is W_L D_{L-1}, [`chain`]
//! one hidden layer further, [`input_jacobian`] the first layer, written where the controller wants
//! it. The chain is held transposed, `[hidden][OUT]`, so that each product reads its operands in
//! memory order.

use crate::math;
use crate::model::{Jacobian, Regressor};

/// The regressor as the network's input vector: u(k) .. u(k-ND+1), y(k) .. y(k-DD+1), channels;
/// each vector whole. `NX = NU ND + NY DD + NS`, checked when the caller is compiled.
#[inline(always)]
pub fn flatten<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const NX: usize,
>(
    regressor: &Regressor<NU, NY, NS, ND, DD>,
) -> [f32; NX] {
    const { assert!(NX == NU * ND + NY * DD + NS, "NX is NU ND + NY DD + NS") };
    let mut x = [0.0; NX];
    let (of_u, rest) = x.split_at_mut(NU * ND);
    let (of_y, of_s) = rest.split_at_mut(NY * DD);
    // Three copies of known length: one loop over a chain of them takes 20 instructions a value.
    of_u.copy_from_slice(regressor.u.as_flattened());
    of_y.copy_from_slice(regressor.y.as_flattened());
    of_s.copy_from_slice(&regressor.s);
    x
}

/// The inverse of [`flatten`].
pub fn unflatten<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
>(
    x: &[f32],
) -> Option<Regressor<NU, NY, NS, ND, DD>> {
    if x.len() != NU * ND + NY * DD + NS {
        return None;
    }
    let mut regressor = Regressor {
        u: [[0.0; NU]; ND],
        y: [[0.0; NY]; DD],
        s: [0.0; NS],
    };
    let places = regressor
        .u
        .as_flattened_mut()
        .iter_mut()
        .chain(regressor.y.as_flattened_mut())
        .chain(&mut regressor.s);
    for (place, x) in places.zip(x) {
        *place = *x;
    }
    Some(regressor)
}

/// One dense layer before its activation: `y = W x + b` (docs/explanation/controller.md, eq. 2).
///
/// Shapes: `w` is `[OUT][IN]`, `x` is `[IN]`, `b` and `y` are `[OUT]`; `y` is overwritten.
/// Units: none, the model's scaling has been applied. Cost: `IN OUT` multiply-adds.
/// Never fails; a NaN in `x` reaches every output, and `safety` catches it there.
#[inline(always)]
pub fn dense<const IN: usize, const OUT: usize>(
    w: &[[f32; IN]; OUT],
    b: &[f32; OUT],
    x: &[f32; IN],
    y: &mut [f32; OUT],
) {
    layer(w, b, x, y, |z| z);
}

/// [`dense`] with the hyperbolic sensitivities after it: `y = tanh(W x + b)`.
#[inline(always)]
pub fn dense_tanh<const IN: usize, const OUT: usize>(
    w: &[[f32; IN]; OUT],
    b: &[f32; OUT],
    x: &[f32; IN],
    y: &mut [f32; OUT],
) {
    layer(w, b, x, y, math::tanh);
}

/// [`dense`] with the rectifier after it.
#[inline(always)]
pub fn dense_relu<const IN: usize, const OUT: usize>(
    w: &[[f32; IN]; OUT],
    b: &[f32; OUT],
    x: &[f32; IN],
    y: &mut [f32; OUT],
) {
    layer(w, b, x, y, math::relu);
}

/// One layer, row by row: `y = act(W x + b)`.
#[inline(always)]
fn layer<const IN: usize, const OUT: usize>(
    w: &[[f32; IN]; OUT],
    b: &[f32; OUT],
    x: &[f32; IN],
    y: &mut [f32; OUT],
    act: impl Fn(f32) -> f32,
) {
    for ((w, b), y) in w.iter().zip(b).zip(y) {
        *y = act(row(w, *b, x));
    }
}

/// `w x + b`, first element first.
#[inline(always)]
pub(crate) fn row<const IN: usize>(w: &[f32; IN], b: f32, x: &[f32; IN]) -> f32 {
    let mut sum = b;
    for (w, x) in w.iter().zip(x) {
        sum += w * x;
    }
    sum
}

/// Hyperbolic sensitivities of every element, in place.
#[inline(always)]
pub fn tanh<const N: usize>(y: &mut [f32; N]) {
    for y in y {
        *y = math::tanh(*y);
    }
}

/// Logistic sigmoid of every element, in place.
#[inline(always)]
pub fn sigmoid<const N: usize>(y: &mut [f32; N]) {
    for y in y {
        *y = math::sigmoid(*y);
    }
}

/// Rectifier of every element, in place.
#[inline(always)]
pub fn relu<const N: usize>(y: &mut [f32; N]) {
    for y in y {
        *y = math::relu(*y);
    }
}

/// Slopes of [`tanh`] from its values: `1 - y^2`.
#[inline(always)]
pub fn tanh_slope<const N: usize>(y: &[f32; N]) -> [f32; N] {
    core::array::from_fn(|i| math::tanh_slope(y[i]))
}

/// Second derivatives of [`tanh`] from its values: `-2 y (1 - y^2)`.
#[inline(always)]
pub fn tanh_bend<const N: usize>(y: &[f32; N]) -> [f32; N] {
    core::array::from_fn(|i| math::tanh_bend(y[i]))
}

/// Slopes of [`sigmoid`] from its values: `y (1 - y)`.
#[inline(always)]
pub fn sigmoid_slope<const N: usize>(y: &[f32; N]) -> [f32; N] {
    core::array::from_fn(|i| math::sigmoid_slope(y[i]))
}

/// Slopes of [`relu`] from its values: 1 where positive, else 0.
#[inline(always)]
pub fn relu_slope<const N: usize>(y: &[f32; N]) -> [f32; N] {
    core::array::from_fn(|i| math::relu_slope(y[i]))
}

/// Start of the chain at a linear output layer: `t[h][r] = w[r][h] slope[h]`.
///
/// Shapes: `w` is the last layer, `[OUT][H]`; `slope` is that of the hidden layer before it.
#[inline(always)]
pub fn seed_linear<const H: usize, const OUT: usize>(
    w: &[[f32; H]; OUT],
    slope: &[f32; H],
    t: &mut [[f32; OUT]; H],
) {
    for (r, row) in w.iter().enumerate() {
        for ((t, w), slope) in t.iter_mut().zip(row).zip(slope) {
            t[r] = w * slope;
        }
    }
}

/// Start of the chain at an output layer with an activation:
/// `t[h][r] = slope_out[r] w[r][h] slope[h]`.
#[inline(always)]
pub fn seed<const H: usize, const OUT: usize>(
    w: &[[f32; H]; OUT],
    slope_out: &[f32; OUT],
    slope: &[f32; H],
    t: &mut [[f32; OUT]; H],
) {
    for (r, (row, slope_out)) in w.iter().zip(slope_out).enumerate() {
        for ((t, w), slope) in t.iter_mut().zip(row).zip(slope) {
            t[r] = slope_out * (w * slope);
        }
    }
}

/// Start of the chain for a network of one layer: `t` is the diagonal of `slope_out` (all ones
/// where the layer is linear).
#[inline(always)]
pub fn seed_diagonal<const OUT: usize>(slope_out: &[f32; OUT], t: &mut [[f32; OUT]; OUT]) {
    for (h, (t, slope)) in t.iter_mut().zip(slope_out).enumerate() {
        *t = [0.0; OUT];
        t[h] = *slope;
    }
}

/// One hidden layer towards the input: `t[h][r] = slope[h] sum_g t_next[g][r] w[g][h]`.
///
/// Shapes: `w` is the layer between them, `[G][H]`; `slope` is that of its input side.
/// Cost: `G H OUT` multiply-adds.
#[inline(always)]
pub fn chain<const G: usize, const H: usize, const OUT: usize>(
    t_next: &[[f32; OUT]; G],
    w: &[[f32; H]; G],
    slope: &[f32; H],
    t: &mut [[f32; OUT]; H],
) {
    for (h, (t, slope)) in t.iter_mut().zip(slope).enumerate() {
        let mut sum = [0.0; OUT];
        for (t_next, row) in t_next.iter().zip(w) {
            let w = row[h];
            for (sum, t_next) in sum.iter_mut().zip(t_next) {
                *sum += t_next * w;
            }
        }
        for (t, sum) in t.iter_mut().zip(&sum) {
            *t = slope * sum;
        }
    }
}

/// The first layer: `dy_r/dx_c = sum_h t[h][r] w[h][c]`, written lag by lag; the columns of the
/// sensor channels, which the controller holds, are not computed.
///
/// `first`: of the first prediction of a horizon, on which u(k) alone has an effect; the rest stays
/// as it came.
///
/// Shapes: `w` is the first layer, `[H][NX]` in the order of [`flatten`].
/// Cost: `H OUT (NU ND + NY DD)` multiply-adds, `H OUT NU` for the first.
#[inline(always)]
pub fn input_jacobian<
    const NX: usize,
    const H: usize,
    const NU: usize,
    const NY: usize,
    const ND: usize,
    const DD: usize,
>(
    t: &[[f32; NY]; H],
    w: &[[f32; NX]; H],
    first: bool,
    jacobian: &mut Jacobian<NU, NY, ND, DD>,
) {
    const {
        assert!(
            NX >= NU * ND + NY * DD,
            "the regressor fits the first layer"
        )
    };
    let large = NY * (NU * ND + NY * DD) > LARGE;
    if first {
        if let Some(newest) = jacobian.u.first_mut() {
            lag(large, t, w, 0, newest);
        }
        return;
    }
    sums(large, t, w, 0, &mut jacobian.u);
    sums(large, t, w, NU * ND, &mut jacobian.y);
}

/// More elements of a Jacobian, or weights of a linear path, than this are not written out where
/// they are needed: one copy of the loop serves every lag, for 2 % of the instructions and
/// kilobytes less flash (docs/lab/0064).
pub(crate) const LARGE: usize = 48;

/// Sums that fit the floating-point registers beside their operands.
const REGISTERS: usize = 24;

/// All lags at once where their sums fit the registers, so that each element of `t` is read once.
#[inline(always)]
fn sums<const NX: usize, const H: usize, const OUT: usize, const B: usize, const LAGS: usize>(
    large: bool,
    t: &[[f32; OUT]; H],
    w: &[[f32; NX]; H],
    start: usize,
    blocks: &mut [[[f32; B]; OUT]; LAGS],
) {
    if LAGS * OUT * B > REGISTERS {
        for (index, block) in blocks.iter_mut().enumerate() {
            lag(large, t, w, start + index * B, block);
        }
        return;
    }
    let mut sum = [[[0.0; B]; OUT]; LAGS];
    for (t, row) in t.iter().zip(w) {
        if let Some(row) = row.get(start..start + LAGS * B) {
            for (sum, row) in sum.iter_mut().zip(row.chunks_exact(B)) {
                for (sum, t) in sum.iter_mut().zip(t) {
                    for (sum, w) in sum.iter_mut().zip(row) {
                        *sum += t * w;
                    }
                }
            }
        }
    }
    *blocks = sum;
}

/// One lag's block of [`columns`], `large`: by the copy that all lags share.
#[inline(always)]
fn lag<const NX: usize, const H: usize, const OUT: usize, const B: usize>(
    large: bool,
    t: &[[f32; OUT]; H],
    w: &[[f32; NX]; H],
    start: usize,
    block: &mut [[f32; B]; OUT],
) {
    if large {
        columns_apart(t, w, start, block);
    } else {
        columns(t, w, start, block);
    }
}

/// `block[r][c] = sum_h t[h][r] w[h][start + c]`; the sums of a block stay in registers.
#[inline(always)]
fn columns<const NX: usize, const H: usize, const OUT: usize, const B: usize>(
    t: &[[f32; OUT]; H],
    w: &[[f32; NX]; H],
    start: usize,
    block: &mut [[f32; B]; OUT],
) {
    let mut sum = [[0.0; B]; OUT];
    for (t, row) in t.iter().zip(w) {
        if let Some(row) = row.get(start..start + B) {
            for (sum, t) in sum.iter_mut().zip(t) {
                for (sum, w) in sum.iter_mut().zip(row) {
                    *sum += t * w;
                }
            }
        }
    }
    *block = sum;
}

/// [`columns`], one copy for all lags.
#[inline(never)]
fn columns_apart<const NX: usize, const H: usize, const OUT: usize, const B: usize>(
    t: &[[f32; OUT]; H],
    w: &[[f32; NX]; H],
    start: usize,
    block: &mut [[f32; B]; OUT],
) {
    columns(t, w, start, block);
}

/// Turns the Jacobian of an increment into that of the next output: `y(k+1) = y(k) + network`.
#[inline(always)]
pub fn add_identity<const NU: usize, const NY: usize, const ND: usize, const DD: usize>(
    jacobian: &mut Jacobian<NU, NY, ND, DD>,
) {
    if let Some(newest) = jacobian.y.first_mut() {
        for (r, row) in newest.iter_mut().enumerate() {
            row[r] += 1.0;
        }
    }
}
