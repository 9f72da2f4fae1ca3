//! As the firmware has them: factors of the covariance, arrays, tanh by a rational function.

use core::hint::black_box;

use sinew_mpc::filter::Covariance;
use sinew_mpc::math::tanh;

use crate::{CHANNEL_STATES, CHANNELS, F, H, NOISE, NX, Q, START, UNITS, counted, entry};

/// Time update, measurement update in one form, measurement model, hidden layer, no square root.
pub fn count(say: &mut impl FnMut((u32, f32))) {
    let mut covariance = Covariance::diagonal(START);
    // Twice: the second time U is full.
    for _ in 0..2 {
        covariance.propagate::<NX>(&F, &Q);
        let projection = covariance.project(&H, NOISE);
        covariance.update(&projection, NOISE);
    }
    let (spent, ()) = counted(|| covariance.propagate::<NX>(black_box(&F), black_box(&Q)));
    say((spent, covariance.variance(1)));
    let (spent, gain) = counted(|| {
        let projection = covariance.project(black_box(&H), black_box(NOISE));
        covariance.update(&projection, black_box(NOISE)).gain
    });
    black_box(gain);
    say((spent, covariance.variance(1)));
    // There is one form, which is definite.
    say((0, 0.0));

    let c: [[f32; CHANNEL_STATES]; CHANNELS] =
        core::array::from_fn(|i| core::array::from_fn(|j| entry(i * CHANNEL_STATES + j)));
    let x: [f32; CHANNEL_STATES] = core::array::from_fn(entry);
    let (spent, read) = counted(|| measure(black_box(&c), black_box(&x)));
    say((spent, read[3]));

    let z: [f32; UNITS] = core::array::from_fn(entry);
    let (spent, units) = counted(|| black_box(z).map(tanh));
    say((spent, units.iter().sum()));
    // The factors do without roots.
    say((0, 0.0));
}

#[inline(never)]
fn measure(c: &[[f32; CHANNEL_STATES]; CHANNELS], x: &[f32; CHANNEL_STATES]) -> [f32; CHANNELS] {
    let mut read = [0.0; CHANNELS];
    for (read, row) in read.iter_mut().zip(c) {
        for (c, x) in row.iter().zip(x) {
            *read += c * x;
        }
    }
    read
}
