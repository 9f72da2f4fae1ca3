//! Plants that a model is trained on: the usual one, or devices of a fleet.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_ident::population::Fleet;
use sinew_sim::Plant;

/// Plants that a model is trained on.
#[derive(Clone, Copy)]
pub struct Plants<'a> {
    /// Parameters of the usual one.
    pub usual: &'a [f64],
    /// The fleet that each episode's plant is drawn from; without it the usual one is in all.
    pub fleet: Option<&'a Fleet>,
}

/// Seed of the plants of a fleet, beyond that of everything drawn.
const FLEET_SEED: u64 = 6000;

impl Plants<'_> {
    /// Parameters of the plants of `count` episodes: one for all without a fleet.
    pub(super) fn drawn(&self, plant: &Plant, seed: u64, count: usize) -> Vec<Vec<f64>> {
        let Some(fleet) = self.fleet else {
            return vec![self.usual.to_vec()];
        };
        let mut random = ChaCha8Rng::seed_from_u64(seed.wrapping_add(FLEET_SEED));
        (0..count)
            .map(|_| fleet.draw_plant(plant, &mut random))
            .collect()
    }
}
