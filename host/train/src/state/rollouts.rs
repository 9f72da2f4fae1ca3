//! Rollouts of plants drawn from a population, with their whole state.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sinew_ident::error::Result;
use sinew_ident::population::Fleet;
use sinew_sim::{Plant, Stepper};

use crate::dataset::{self, RolloutConfig, SampledState};

/// Parameters in which devices differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Population {
    /// Their slots in the plant.
    pub slots: Vec<usize>,
    /// Standard deviation of each over the devices, as a part of its value; above 0.
    pub spread: f64,
    /// Largest distance of a drawn plant from the usual one, in standard deviations.
    pub reach: f64,
    /// The fleet to draw from, in place of a uniform distribution within the reach.
    pub fleet: Option<Fleet>,
}

/// One stretch of motion of one drawn plant; x(k+1) follows x(k) under u(k).
#[derive(Clone, Debug)]
pub struct StateEpisode {
    /// Parameters, in standard deviations from the usual device, `[p]`.
    pub theta: Vec<f64>,
    /// Inputs, `[steps][n_u]`, held for a period each.
    pub u: Vec<f64>,
    /// States in the order of [`Plant::state_names`], `[steps + 1][n]`.
    pub x: Vec<f64>,
    /// Readings of the configured outputs, then of its channels, without noise,
    /// `[steps + 1][n_m]`.
    pub m: Vec<f64>,
}

impl Population {
    /// Parameter values of a device.
    pub fn values(&self, usual: &[f64], theta: &[f64]) -> Vec<f64> {
        let mut values = usual.to_vec();
        for (slot, theta) in self.slots.iter().zip(theta) {
            values[*slot] *= 1.0 + self.spread * theta;
        }
        values
    }

    /// Parameters of a device from its values; the inverse of [`Population::values`].
    pub fn theta(&self, usual: &[f64], values: &[f64]) -> Vec<f64> {
        let slots = self.slots.iter();
        slots
            .map(|slot| (values[*slot] / usual[*slot] - 1.0) / self.spread)
            .collect()
    }
}

/// Draws `count` episodes, each of a plant of its own: parameters uniform within the population's
/// reach or, brought within it, those of a device of its fleet; inputs and starts as
/// [`dataset::draw`] draws them.
///
/// # Errors
/// As [`dataset::draw`].
pub fn draw(
    plant: &Plant,
    usual: &[f64],
    population: &Population,
    sampled_states: &[SampledState],
    config: &RolloutConfig,
    count: usize,
) -> Result<Vec<StateEpisode>> {
    let sensors: Vec<usize> = config
        .outputs
        .iter()
        .chain(&config.channels)
        .copied()
        .collect();
    (0..count)
        .into_par_iter()
        .map(|i| {
            let seed = config.seed.wrapping_mul(1 << 20).wrapping_add(i as u64);
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let reach = population.reach;
            let theta: Vec<f64> = match &population.fleet {
                None => (0..population.slots.len())
                    .map(|_| random.random_range(-reach..=reach))
                    .collect(),
                Some(fleet) => {
                    let device = fleet.draw_plant(plant, &mut random);
                    let theta = population.theta(usual, &device).into_iter();
                    theta.map(|theta| theta.clamp(-reach, reach)).collect()
                }
            };
            let values = population.values(usual, &theta);
            let config = RolloutConfig {
                seed,
                ..config.clone()
            };
            let episodes = dataset::draw(plant, &[&values], sampled_states, &config, 1)?;
            let mut drawn = StateEpisode {
                theta,
                u: Vec::new(),
                x: Vec::new(),
                m: Vec::new(),
            };
            for episode in episodes {
                let mut stepper = Stepper::new(plant, &values, &episode.start)?;
                let n_u = plant.inputs().len();
                let observe = |drawn: &mut StateEpisode, stepper: &Stepper<f64>| {
                    drawn.x.extend(stepper.state());
                    drawn.m.extend(sensors.iter().map(|s| stepper.signal(*s)));
                };
                observe(&mut drawn, &stepper);
                for u in episode.u.chunks_exact(n_u) {
                    stepper.advance(config.period_s, u)?;
                    observe(&mut drawn, &stepper);
                }
                drawn.u = episode.u;
            }
            Ok(drawn)
        })
        .collect()
}
