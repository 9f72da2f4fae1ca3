//! Position of a recurrent first layer in a model: its hidden state is the last of the channels,
//! which it predicts and nobody measures (docs/explanation/controller.md, eq. 1a). The layer itself
//! is a kernel of the printed crate.

use crate::model::{ChannelJacobian, Jacobian, Regressor};
use crate::sensitivity::Direction;

/// The layer's input: u(k) .., y(k) .., and the channels before the memory.
#[inline(always)]
pub fn input<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const NX: usize,
>(
    regressor: &Regressor<NU, NY, NS, ND, DD>,
) -> [f32; NX] {
    const {
        assert!(
            NX >= NU * ND + NY * DD && NX <= NU * ND + NY * DD + NS,
            "NX is NU ND + NY DD and the channels that are measured"
        )
    };
    let mut x = [0.0; NX];
    let (of_u, rest) = x.split_at_mut(NU * ND);
    let (of_y, of_s) = rest.split_at_mut(NY * DD);
    // Copies of known length: one loop over a chain of them takes 20 instructions a value.
    of_u.copy_from_slice(regressor.u.as_flattened());
    of_y.copy_from_slice(regressor.y.as_flattened());
    if let Some(measured) = regressor.s.get(..of_s.len()) {
        of_s.copy_from_slice(measured);
    }
    x
}

/// The values of the memory that begin at channel `start`.
#[inline(always)]
pub fn at<T: Copy, const NS: usize, const H: usize>(s: &[T; NS], start: usize, none: T) -> [T; H] {
    core::array::from_fn(|i| s.get(start + i).copied().unwrap_or(none))
}

/// Enters the values of the memory that begin at channel `start`.
#[inline(always)]
pub fn enter<T: Copy, const NS: usize, const H: usize>(
    memory: &[T; H],
    start: usize,
    s: &mut [T; NS],
) {
    for (place, value) in s.iter_mut().skip(start).zip(memory) {
        *place = *value;
    }
}

/// A direction of all that is looked at, as that of the layer's input. Channels that are measured
/// hold.
#[inline(always)]
pub fn input_along<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const NX: usize,
>(
    direction: &Direction<'_, NU, NY, NS, ND, DD>,
) -> [[f32; NU]; NX] {
    let mut x = [[0.0; NU]; NX];
    let (of_u, rest) = x.split_at_mut(NU * ND);
    for (rows, u) in of_u.chunks_exact_mut(NU).zip(&direction.u) {
        for (c, row) in rows.iter_mut().enumerate() {
            row[c] = *u;
        }
    }
    for (row, y) in rest.iter_mut().zip(direction.y.as_flattened()) {
        *row = *y;
    }
    x
}

/// `d += W d_x` along `R` directions; `w` may look at less than there is.
#[inline(always)]
pub fn add_along<const NX: usize, const NY: usize, const R: usize>(
    w: &[[f32; NX]; NY],
    d_x: &[[f32; R]; NX],
    d: &mut [[f32; R]; NY],
) {
    for (d, row) in d.iter_mut().zip(w) {
        for (w, d_x) in row.iter().zip(d_x) {
            for (d, d_x) in d.iter_mut().zip(d_x) {
                *d += w * d_x;
            }
        }
    }
}

/// `diag(slope) W d_x` along `R` directions: a dense layer and its activation.
#[inline(always)]
pub fn dense_along<const IN: usize, const OUT: usize, const R: usize>(
    w: &[[f32; IN]; OUT],
    slope: &[f32; OUT],
    d_x: &[[f32; R]; IN],
) -> [[f32; R]; OUT] {
    let mut d = [[0.0; R]; OUT];
    add_along(w, d_x, &mut d);
    for (d, slope) in d.iter_mut().zip(slope) {
        for d in d {
            *d *= slope;
        }
    }
    d
}

/// Adjoints of the layer's input, a column for each output, as derivatives of the outputs.
#[inline(always)]
pub fn enter_jacobian<
    const NX: usize,
    const NU: usize,
    const NY: usize,
    const ND: usize,
    const DD: usize,
>(
    t_x: &[[f32; NY]; NX],
    jacobian: &mut Jacobian<NU, NY, ND, DD>,
) {
    turn_lags(t_x, &mut jacobian.u, &mut jacobian.y);
}

/// Adjoints of the layer's input and memory, a column for each output, as derivatives of the
/// outputs by the channels.
pub fn enter_by_channels<
    const NX: usize,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
>(
    t_x: &[[f32; NY]; NX],
    memory: &[&[[f32; NY]]],
    jacobian: &mut ChannelJacobian<NU, NY, NS, ND, DD>,
) {
    turn_channels::<NX, NY, NS>(t_x, NU * ND + NY * DD, memory, &mut jacobian.y_by_s);
}

/// Adjoints of the layer's input and memory, a column for each value of the new memory, as
/// derivatives of the channels; those that are measured hold.
pub fn enter_of_channels<
    const NX: usize,
    const M: usize,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
>(
    t_x: &[[f32; M]; NX],
    memory: &[&[[f32; M]]],
    jacobian: &mut ChannelJacobian<NU, NY, NS, ND, DD>,
) {
    let held = NS.saturating_sub(M);
    let (mut u, mut y) = ([[[0.0; NU]; M]; ND], [[[0.0; NY]; M]; DD]);
    turn_lags(t_x, &mut u, &mut y);
    for (block, rows) in jacobian.u.iter_mut().zip(&u) {
        enter(rows, held, block);
    }
    for (block, rows) in jacobian.y.iter_mut().zip(&y) {
        enter(rows, held, block);
    }
    let mut s = [[0.0; NS]; M];
    turn_channels(t_x, NU * ND + NY * DD, memory, &mut s);
    enter(&s, held, &mut jacobian.s);
    for (r, row) in jacobian.s.iter_mut().take(held).enumerate() {
        row[r] = 1.0;
    }
}

/// Adds the direction's part of y(k), which an increment is added to.
#[inline(always)]
pub fn add_present<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
>(
    direction: &Direction<'_, NU, NY, NS, ND, DD>,
    d: &mut [[f32; NU]; NY],
) {
    if let Some(present) = direction.y.first() {
        for (d, present) in d.as_flattened_mut().iter_mut().zip(present.as_flattened()) {
            *d += present;
        }
    }
}

/// Adds the linear path's derivatives by the channels that are measured.
pub fn add_path<
    const NX: usize,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
>(
    w: &[[f32; NX]; NY],
    jacobian: &mut ChannelJacobian<NU, NY, NS, ND, DD>,
) {
    for (by_s, w) in jacobian.y_by_s.iter_mut().zip(w) {
        for (d, w) in by_s.iter_mut().zip(w.iter().skip(NU * ND + NY * DD)) {
            *d += w;
        }
    }
}

/// Adjoints that give the values from `start` on themselves.
pub fn unit<const H: usize, const M: usize>(start: usize) -> [[f32; M]; H] {
    core::array::from_fn(|k| core::array::from_fn(|r| if r == start + k { 1.0 } else { 0.0 }))
}

/// Adjoints `[place][result]` to derivatives `[lag][result][place]`.
#[inline(always)]
fn turn_lags<
    const NX: usize,
    const R: usize,
    const NU: usize,
    const NY: usize,
    const ND: usize,
    const DD: usize,
>(
    t_x: &[[f32; R]; NX],
    u: &mut [[[f32; NU]; R]; ND],
    y: &mut [[[f32; NY]; R]; DD],
) {
    let mut places = t_x.iter();
    for block in u {
        turn(&mut places, block);
    }
    for block in y {
        turn(&mut places, block);
    }
}

#[inline(always)]
fn turn<'a, const R: usize, const C: usize>(
    places: &mut impl Iterator<Item = &'a [f32; R]>,
    block: &mut [[f32; C]; R],
) {
    for (c, t) in (0..C).zip(places) {
        for (row, t) in block.iter_mut().zip(t) {
            row[c] = *t;
        }
    }
}

/// Adjoints of the measured channels, from `start` of the layer's input on, and of the memory.
fn turn_channels<const NX: usize, const R: usize, const NS: usize>(
    t_x: &[[f32; R]; NX],
    start: usize,
    memory: &[&[[f32; R]]],
    by_s: &mut [[f32; NS]; R],
) {
    let measured = t_x.iter().skip(start);
    let places = measured.chain(memory.iter().copied().flatten());
    for (c, t) in (0..NS).zip(places) {
        for (row, t) in by_s.iter_mut().zip(t) {
            row[c] = *t;
        }
    }
}
