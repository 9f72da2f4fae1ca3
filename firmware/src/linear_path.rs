//! A linear path beside a network: `y += w x` (docs/codegen.md, eq. 4). A nearly linear plant leaves
//! the network only what is not linear.

use crate::model::Jacobian;

/// Adds the path to what the network gives.
///
/// Shapes: `w` is `[NY][NX]`, `x` is `[NX]` in the order of [`crate::network::flatten`], `y` is `[NY]`.
/// Cost: `NX NY` multiply-adds.
#[inline(always)]
pub fn add<const NX: usize, const NY: usize>(
    w: &[[f32; NX]; NY],
    x: &[f32; NX],
    y: &mut [f32; NY],
) {
    for (y, row) in y.iter_mut().zip(w) {
        let mut sum = *y;
        for (w, x) in row.iter().zip(x) {
            sum += w * x;
        }
        *y = sum;
    }
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
    for (lag, block) in jacobian.u.iter_mut().enumerate() {
        add_columns(w, lag * NU, block);
    }
    for (lag, block) in jacobian.y.iter_mut().enumerate() {
        add_columns(w, NU * ND + lag * NY, block);
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
