//! With nalgebra's matrices of fixed size: the covariance itself, symmetric by copying.

use core::hint::black_box;

use nalgebra::{SMatrix, SVector};

use crate::{CHANNEL_STATES, CHANNELS, F, H, NOISE, NX, NZ, Q, START, UNITS, counted, entry};

type Covariance = SMatrix<f32, NZ, NZ>;
type Rows = SMatrix<f32, NX, NZ>;
type Row = SVector<f32, NZ>;

/// Time update, measurement update in two forms, measurement model, hidden layer (none: 0), square
/// root.
pub fn count(say: &mut impl FnMut((u32, f32))) {
    let mut covariance = Covariance::from_diagonal(&Row::from_column_slice(&START));
    let f = Rows::from_fn(|i, j| F[i][j]);
    let h = Row::from_column_slice(&H);
    for _ in 0..2 {
        propagate(&mut covariance, &f);
        update(&mut covariance, &h, NOISE);
    }
    let (spent, ()) = counted(|| propagate(&mut covariance, black_box(&f)));
    say((spent, covariance[(1, 1)]));
    let (spent, gain) = counted(|| update(&mut covariance, black_box(&h), black_box(NOISE)));
    black_box(gain);
    say((spent, covariance[(1, 1)]));
    let (spent, gain) = counted(|| short_update(&mut covariance, black_box(&h), black_box(NOISE)));
    black_box(gain);
    say((spent, covariance[(1, 1)]));

    let c: SMatrix<f32, CHANNELS, CHANNEL_STATES> =
        SMatrix::from_fn(|i, j| entry(i * CHANNEL_STATES + j));
    let x: SVector<f32, CHANNEL_STATES> = SVector::from_fn(|i, _| entry(i));
    let (spent, read) = counted(|| measure(black_box(&c), black_box(&x)));
    say((spent, read[3]));

    let z: SVector<f32, UNITS> = SVector::from_fn(|i, _| entry(i));
    say((0, z.sum()));
    // A factor of two by two, with the square roots of libm.
    let p = SMatrix::<f32, 2, 2>::new(2.0, 0.5, 0.5, 1.0);
    let (spent, root) = counted(|| black_box(p).cholesky().map_or(0.0, |it| it.l()[(0, 0)]));
    say((spent, root));
}

/// P = F P F' + Q of the first rows; the others stay.
#[inline(never)]
fn propagate(p: &mut Covariance, f: &Rows) {
    let rows = f * *p;
    let block = rows * f.transpose() + SMatrix::<f32, NX, NX>::from_diagonal(&SVector::from(Q));
    p.fixed_rows_mut::<NX>(0).copy_from(&rows);
    p.fixed_columns_mut::<NX>(0).copy_from(&rows.transpose());
    p.fixed_view_mut::<NX, NX>(0, 0).copy_from(&block);
}

/// P = (I - K H) P (I - K H)' + K r K' (Joseph), which keeps P definite where P - K H P does not.
#[inline(never)]
fn update(p: &mut Covariance, h: &Row, r: f32) -> Row {
    let ph = *p * h;
    let s = h.dot(&ph) + r;
    let gain = ph / s;
    let rest = Covariance::identity() - gain * h.transpose();
    *p = rest * *p * rest.transpose() + gain * gain.transpose() * r;
    gain
}

/// P = P - K H P, which rounding takes out of the definite matrices.
#[inline(never)]
fn short_update(p: &mut Covariance, h: &Row, r: f32) -> Row {
    let ph = *p * h;
    let s = h.dot(&ph) + r;
    let gain = ph / s;
    *p -= gain * ph.transpose();
    gain
}

#[inline(never)]
fn measure(
    c: &SMatrix<f32, CHANNELS, CHANNEL_STATES>,
    x: &SVector<f32, CHANNEL_STATES>,
) -> SVector<f32, CHANNELS> {
    c * x
}
