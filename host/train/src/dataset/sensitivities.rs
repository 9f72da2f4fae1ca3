//! Exact sensitivities of a rollout: how its outputs change when its inputs do.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sinew_sim::{Dual, Plant, Scalar, Stepper};

use super::{Episode, RolloutConfig};
use sinew_ident::error::Result;

/// Places of an episode that are differentiated at once, each by a seed of its own.
const PLACES: usize = 8;

/// Response of the outputs of an episode when all inputs from a step on are moved along one
/// direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensitivity {
    /// The step k from which on the inputs move.
    pub from: usize,
    /// The direction, one entry an input.
    pub along: Vec<f64>,
    /// Derivatives of y(k+1) .. y(k+steps) along it, `[steps][n_y]`.
    pub of: Vec<f64>,
}

/// Start and length of a differentiated part of a rollout.
#[derive(Clone, Copy, Debug)]
pub struct Stretch<'a> {
    /// The first step from which on inputs may move.
    pub first: usize,
    /// Steps that they are followed for.
    pub steps: usize,
    /// Largest move of each input.
    pub reach: &'a [f64],
}

/// Sensitivities of every episode, at up to eight places each that `config`'s seed draws, along
/// directions within `stretch.reach`; the plants as [`draw`](super::draw) had them. None where an
/// input would leave its limits, or at a kink whose derivative is not finite.
///
/// # Errors
/// The plant diverges, or the episodes are not of this plant.
pub fn sensitivities(
    plant: &Plant,
    plants: &[&[f64]],
    episodes: &[Episode],
    config: &RolloutConfig,
    stretch: Stretch<'_>,
) -> Result<Vec<Vec<Sensitivity>>> {
    let each = episodes.par_iter().enumerate();
    each.map(|(number, episode)| {
        let mut random = ChaCha8Rng::seed_from_u64(config.seed);
        // Stream 0 drew the episodes.
        random.set_stream(1 + number as u64);
        let values = plants[number % plants.len()];
        of_one(plant, values, episode, config, stretch, &mut random)
    })
    .collect()
}

fn of_one(
    plant: &Plant,
    values: &[f64],
    episode: &Episode,
    config: &RolloutConfig,
    stretch: Stretch<'_>,
    random: &mut ChaCha8Rng,
) -> Result<Vec<Sensitivity>> {
    let n_u = plant.inputs().len();
    let steps = episode.u.len() / n_u;
    let Some(room) = (steps + 1).checked_sub(stretch.first + stretch.steps) else {
        return Ok(vec![]);
    };
    let mut sensitivities: Vec<Sensitivity> = (0..PLACES.min(room))
        .map(|_| Sensitivity {
            from: stretch.first + random.random_range(0..room),
            along: (stretch.reach.iter())
                .map(|reach| reach * random.random_range(-1.0..1.0))
                .collect(),
            of: Vec::with_capacity(stretch.steps * config.outputs.len()),
        })
        .collect();
    sensitivities.retain(|sensitivity| stays_inside(plant, episode, sensitivity, stretch.steps));
    let constant = |values: &[f64]| -> Vec<Dual<PLACES>> {
        values.iter().map(|v| Dual::constant(*v)).collect()
    };
    let mut stepper = Stepper::new(plant, &constant(values), &constant(&episode.start))?;
    for (k, row) in episode.u.chunks(n_u).enumerate() {
        let moving = |sensitivity: &Sensitivity| {
            (sensitivity.from..sensitivity.from + stretch.steps).contains(&k)
        };
        let mut inputs = constant(row);
        for (seed, sensitivity) in sensitivities.iter().enumerate().filter(|(_, s)| moving(s)) {
            for (input, along) in inputs.iter_mut().zip(&sensitivity.along) {
                input.derivative[seed] = *along;
            }
        }
        stepper.advance(config.period_s, &inputs)?;
        for (seed, sensitivity) in sensitivities
            .iter_mut()
            .enumerate()
            .filter(|(_, s)| moving(s))
        {
            let outputs = config.outputs.iter();
            sensitivity
                .of
                .extend(outputs.map(|sensor| stepper.signal(*sensor).derivative[seed]));
        }
    }
    sensitivities.retain(|sensitivity| sensitivity.of.iter().all(|v| v.is_finite()));
    Ok(sensitivities)
}

/// Part of a direction that inputs have to be able to move by for a derivative along it to be of
/// use.
const ROOM: f64 = 0.02;

/// True if all inputs of the stretch can be moved a little along the direction. Beyond a limit no
/// controller may ask, and what answers there, such as a pull that is flat at 0 V, is not what it
/// would get from the move it may make.
fn stays_inside(plant: &Plant, episode: &Episode, sensitivity: &Sensitivity, steps: usize) -> bool {
    let n_u = plant.inputs().len();
    let rows = episode.u.chunks(n_u).skip(sensitivity.from).take(steps);
    rows.flat_map(|row| row.iter().zip(&sensitivity.along).zip(plant.inputs()))
        .all(|((u, along), input)| {
            let moved = u + ROOM * along;
            input
                .limit
                .is_none_or(|(low, high)| (low..=high).contains(&moved))
        })
}

#[cfg(test)]
mod tests {
    use sinew_sim::Rig;

    use super::*;
    use crate::dataset::{draw, sampled_states};

    /// Pulls that go with the square of a voltage.
    const RIG: &str = include_str!("../../../../rigs/hasel.toml");
    const STEPS: usize = 40;
    const STRETCH: usize = 12;

    fn config() -> RolloutConfig {
        RolloutConfig {
            period_s: 0.008,
            steps: STEPS,
            outputs: vec![0, 1, 2],
            noise: vec![0.0; 3],
            channels: vec![],
            channel_noise: vec![],
            seed: 5,
        }
    }

    #[test]
    fn where_an_input_cannot_move_there_is_no_slope() {
        let rig = Rig::parse(RIG, "hasel.toml").expect("the rig is sound");
        let plant = Plant::new(&rig).expect("the rig is whole");
        let stretch = Stretch {
            first: 4,
            steps: STRETCH,
            reach: &[500.0; 6],
        };
        let count = |volts: f64| {
            let episode = Episode {
                start: vec![0.0; plant.state_len()],
                u: vec![volts; 6 * STEPS],
                y: vec![],
                measured: vec![],
                channels: vec![],
            };
            let found = sensitivities(&plant, &[&plant.values()], &[episode], &config(), stretch);
            found.expect("the motion stays finite")[0].len()
        };
        assert_eq!([count(0.0), count(4000.0), count(8000.0)], [0, PLACES, 0]);
    }

    #[test]
    fn a_slope_is_what_two_simulations_differ_by() {
        let rig = Rig::parse(RIG, "hasel.toml").expect("the rig is sound");
        let plant = Plant::new(&rig).expect("the rig is whole");
        let values = plant.values();
        let times: Vec<f64> = (0..100).map(|k| f64::from(k) * 0.008).collect();
        let column = |i: usize| -> Vec<f64> {
            let wave = |t: &f64| 4000.0 + 2500.0 * (9.0 * t + i as f64).sin();
            times.iter().map(wave).collect()
        };
        let columns: Vec<Vec<f64>> = (0..6).map(column).collect();
        let inputs: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let start = vec![0.0; plant.state_len()];
        let seen = sampled_states(&plant, &values, &start, &times, &inputs, 50)
            .expect("the motion stays finite");
        let config = config();
        let episodes =
            draw(&plant, &[&values], &seen, &config, 4).expect("the motion stays finite");
        let stretch = Stretch {
            first: 4,
            steps: STRETCH,
            reach: &[500.0; 6],
        };
        let found = sensitivities(&plant, &[&values], &episodes, &config, stretch)
            .expect("the motion stays finite");
        assert_eq!(
            found,
            sensitivities(&plant, &[&values], &episodes, &config, stretch).expect("the same")
        );

        let mut compared = 0;
        for (episode, sensitivities) in episodes.iter().zip(&found) {
            for sensitivity in sensitivities {
                assert!((4..=STEPS - STRETCH).contains(&sensitivity.from));
                assert!(sensitivity.along.iter().all(|v| v.abs() <= 500.0));
                let [ahead, behind] = [1e-4, -1e-4].map(|part| {
                    let mut stepper =
                        Stepper::new(&plant, &values, &episode.start).expect("a start");
                    let mut y = Vec::new();
                    for (k, row) in episode.u.chunks(6).enumerate() {
                        let moves = sensitivity.from <= k;
                        let part = if moves { part } else { 0.0 };
                        let row: Vec<f64> = (row
                            .iter()
                            .zip(&sensitivity.along)
                            .map(|(u, d)| u + part * d))
                        .collect();
                        stepper
                            .advance(config.period_s, &row)
                            .expect("the motion stays finite");
                        if moves && k < sensitivity.from + STRETCH {
                            y.extend((0..3).map(|sensor| stepper.signal(sensor)));
                        }
                    }
                    y
                });
                let size = sensitivity
                    .of
                    .iter()
                    .fold(0.0_f64, |most, v| most.max(v.abs()));
                for ((ahead, behind), exact) in ahead.iter().zip(&behind).zip(&sensitivity.of) {
                    let difference = (ahead - behind) / 2e-4;
                    assert!(
                        (difference - exact).abs() < 1e-4 * size + 1e-9,
                        "{difference} {exact}"
                    );
                    compared += usize::from(exact.abs() > 0.1 * size);
                }
            }
        }
        assert!(compared > 300, "{compared}");
    }
}
