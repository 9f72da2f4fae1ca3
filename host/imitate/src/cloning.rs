//! Cloning: a policy that repeats the commands of a demonstration where it sees what was seen
//! (docs/explanation/imitation.md, eq. 9). The baseline of imitation.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::adam::Adam;
use crate::policy::{Memory, Policy};

/// Rows of one step.
const BATCH: usize = 128;

/// Fits a policy to commands `u` that were given where `y` was measured; rows of `reference` stand
/// beside those of `y`. `epochs` passes over all rows.
pub fn clone(
    policy: &mut Policy,
    (y, u): (&[Vec<f64>], &[Vec<f64>]),
    reference: &[Vec<f64>],
    epochs: usize,
    seed: u64,
) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut memory = Memory::resting(&policy.view, &y[0], &policy.limits.safe);
    let last = reference.len() - 1;
    let mut rows = Vec::new();
    for (k, u) in u.iter().enumerate() {
        memory.measure(&y[k]);
        let raw = policy.raw(&memory, |j| &reference[(k + j).min(last)]);
        let before = &memory.u[0];
        let each = u.iter().zip(before).zip(&policy.step);
        let wanted: Vec<f64> = each
            .map(|((u, before), step)| (u - before) / step)
            .collect();
        rows.push((policy.z(&raw), wanted));
        memory.apply(u);
    }
    let count = policy.network.weights.len();
    let mut adam = Adam::new(count);
    for epoch in 0..epochs {
        rows.shuffle(&mut random);
        let rate = 3e-3 * (1.0 - epoch as f64 / epochs as f64);
        for batch in rows.chunks(BATCH) {
            let mut gradient = vec![0.0; count];
            let (mut kept, mut out) = (Vec::new(), vec![0.0; policy.step.len()]);
            for (z, wanted) in batch {
                policy.network.forward(z, &mut kept, &mut out);
                let by: Vec<f64> = out.iter().zip(wanted).map(|(a, b)| a - b).collect();
                let mut by_z = vec![0.0; z.len()];
                policy
                    .network
                    .backward(&kept, &by, &mut gradient, &mut by_z);
            }
            adam.step(&mut policy.network.weights, &gradient, rate);
        }
    }
}
