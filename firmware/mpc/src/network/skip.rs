//! A linear path beside a network: `y += w x` (docs/reference/model-files.md, eq. 4). A nearly
//! linear plant leaves the network only what is not linear.

use crate::model::Jacobian;
use crate::network::dense::{LARGE, row};

/// Adds the path to what the network gives.
///
/// Shapes: `w` is `[NY][NX]`, `x` is `[NX]` in the order of [`crate::network::flatten`], `y` is
/// `[NY]`. Cost: `NX NY` multiply-adds.
#[inline(always)]
pub fn add<const NX: usize, const NY: usize>(
    w: &[[f32; NX]; NY],
    x: &[f32; NX],
    y: &mut [f32; NY],
) {
    for (y, w) in y.iter_mut().zip(w) {
        *y = if NX * NY > LARGE {
            row_apart(w, *y, x)
        } else {
            row(w, *y, x)
        };
    }
}

/// [`row`], one copy for all.
#[inline(never)]
fn row_apart<const NX: usize>(w: &[f32; NX], y: f32, x: &[f32; NX]) -> f32 {
    row(w, y, x)
}

/// Adds the path's derivative, its weights, to the network's, lag by lag.
#[inline(always)]
pub fn add_jacobian<
    const NX: usize,
    const NU: usize,
    const NY: usize,
    const ND: usize,
    const DD: usize,
>(
    w: &[[f32; NX]; NY],
    jacobian: &mut Jacobian<NU, NY, ND, DD>,
) {
    const {
        assert!(
            NX >= NU * ND + NY * DD,
            "the regressor fits the linear path"
        )
    };
    let large = NX * NY > LARGE;
    for (lag, block) in jacobian.u.iter_mut().enumerate() {
        if large {
            add_columns_apart(w, lag * NU, block);
        } else {
            add_columns(w, lag * NU, block);
        }
    }
    for (lag, block) in jacobian.y.iter_mut().enumerate() {
        let start = NU * ND + lag * NY;
        if large {
            add_columns_apart(w, start, block);
        } else {
            add_columns(w, start, block);
        }
    }
}

/// `block[r][c] += w[r][start + c]`.
#[inline(always)]
fn add_columns<const NX: usize, const NY: usize, const B: usize>(
    w: &[[f32; NX]; NY],
    start: usize,
    block: &mut [[f32; B]; NY],
) {
    for (block, row) in block.iter_mut().zip(w) {
        if let Some(row) = row.get(start..start + B) {
            for (value, w) in block.iter_mut().zip(row) {
                *value += w;
            }
        }
    }
}

/// [`add_columns`], one copy for all lags.
#[inline(never)]
fn add_columns_apart<const NX: usize, const NY: usize, const B: usize>(
    w: &[[f32; NX]; NY],
    start: usize,
    block: &mut [[f32; B]; NY],
) {
    add_columns(w, start, block);
}
