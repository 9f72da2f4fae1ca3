//! Training data: short rollouts of the fitted rig's motion at the control period,
//! begun where the recordings went and a little beyond.
//!
//! Short stretches from many places suit plants that drift as well as those that settle: no
//! controller is needed to keep them in range.

mod sensitivities;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sinew_sim::{InputTrajectory, Plant, Stepper};

pub use sensitivities::{Sensitivity, Stretch, sensitivities};

use sinew_ident::error::{Error, Result};
use sinew_ident::noise::gaussian;

/// One stretch of motion; y(k+1) follows y(k) under u(k).
#[derive(Clone, Debug)]
pub struct Episode {
    /// State of the plant at the start.
    pub start: Vec<f64>,
    /// Inputs, `[steps][n_u]`, held for a period each.
    pub u: Vec<f64>,
    /// Outputs, `[steps + 1][n_y]`.
    pub y: Vec<f64>,
    /// The same with the noise of the sensors.
    pub measured: Vec<f64>,
    /// Channels with the noise of their sensors, `[steps + 1][n_s]`.
    pub channels: Vec<f64>,
}

/// Sampled state of the plant with the inputs at that time.
#[derive(Clone, Debug)]
pub struct SampledState {
    state: Vec<f64>,
    inputs: Vec<f64>,
}

/// Settings of the rollouts.
#[derive(Clone, Debug)]
pub struct RolloutConfig {
    /// Control period, seconds.
    pub period_s: f64,
    /// Steps an episode.
    pub steps: usize,
    /// Indices of the sensors that are outputs.
    pub outputs: Vec<usize>,
    /// Standard deviation of each output's noise.
    pub noise: Vec<f64>,
    /// Indices of the sensors that are channels.
    pub channels: Vec<usize>,
    /// Standard deviation of each channel's noise.
    pub channel_noise: Vec<f64>,
    /// Seed.
    pub seed: u64,
}

/// Simulates a recording with `values` and notes about `count` of the states on the way.
///
/// # Errors
/// The simulation diverges.
pub fn sampled_states(
    plant: &Plant,
    values: &[f64],
    start: &[f64],
    times: &[f64],
    inputs: &[&[f64]],
    count: usize,
) -> Result<Vec<SampledState>> {
    let drive = InputTrajectory::new(plant, times.len(), inputs)?;
    let every = (times.len() / count.max(1)).max(1);
    let mut sampled_states = Vec::with_capacity(count + 1);
    plant.simulate_with(values, start, &drive, times, |row, stepper| {
        if row % every == 0 {
            let inputs = inputs.iter().map(|column| column[row]).collect();
            sampled_states.push(SampledState {
                state: stepper.state(),
                inputs,
            });
        }
    })?;
    Ok(sampled_states)
}

/// Draws `count` episodes, of these plants in turn: the parameters of each. Inputs stay inside the
/// rig's limits and rate limits and go a little beyond what was recorded; episodes that leave the
/// finite are drawn again.
///
/// # Errors
/// [`Error`] when there is nowhere to start, or the plant diverges wherever it starts.
pub fn draw(
    plant: &Plant,
    plants: &[&[f64]],
    sampled_states: &[SampledState],
    config: &RolloutConfig,
    count: usize,
) -> Result<Vec<Episode>> {
    if sampled_states.is_empty() {
        return Err(Error::failed("no recording to start episodes from"));
    }
    if plants.is_empty() {
        return Err(Error::failed("no plant to draw episodes of"));
    }
    let ranges = Ranges::of(plant, sampled_states, config.period_s);
    let mut random = ChaCha8Rng::seed_from_u64(config.seed);
    let mut episodes = Vec::with_capacity(count);
    let mut refused = 0;
    while episodes.len() < count {
        let values = plants[episodes.len() % plants.len()];
        match episode(plant, values, sampled_states, config, &ranges, &mut random) {
            Ok(episode) => episodes.push(episode),
            Err(_) if refused < 10 * count => refused += 1,
            Err(error) => return Err(error),
        }
    }
    Ok(episodes)
}

/// Spreads of states and inputs over the sampled states, and what each input may do.
struct Ranges {
    state: Vec<f64>,
    input: Vec<InputRange>,
}

struct InputRange {
    low: f64,
    high: f64,
    /// Half the recorded range.
    spread: f64,
    /// Largest change a period.
    change: f64,
}

impl Ranges {
    fn of(plant: &Plant, sampled_states: &[SampledState], period: f64) -> Self {
        let spread = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) = values
                .filter(|v| v.is_finite())
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
                    (l.min(v), h.max(v))
                });
            if high > low { (low, high) } else { (-1.0, 1.0) }
        };
        let state = (0..plant.state_len()).map(|i| {
            let (low, high) = spread(&mut sampled_states.iter().map(|v| v.state[i]));
            (high - low) / 2.0
        });
        let input = plant.inputs().iter().enumerate().map(|(i, input)| {
            let (low, high) = spread(&mut sampled_states.iter().map(|v| v.inputs[i]));
            let half = (high - low) / 2.0;
            let middle = (high + low) / 2.0;
            let (least, most) = input.limit.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
            InputRange {
                low: (middle - 2.0 * half).max(least),
                high: (middle + 2.0 * half).min(most),
                spread: half,
                change: input.rate_limit.map_or(f64::INFINITY, |rate| rate * period),
            }
        });
        Self {
            state: state.collect(),
            input: input.collect(),
        }
    }
}

fn episode(
    plant: &Plant,
    values: &[f64],
    sampled_states: &[SampledState],
    config: &RolloutConfig,
    ranges: &Ranges,
    random: &mut ChaCha8Rng,
) -> Result<Episode> {
    let sampled = &sampled_states[random.random_range(0..sampled_states.len())];
    let bodies = plant.bodies();
    // A quarter begins at rest: there friction holds, and a controller has to know how to break
    // free.
    let at_rest = random.random_bool(0.25);
    let speed_factor = if at_rest {
        0.0
    } else {
        random.random_range(0.3..1.5)
    };
    let start: Vec<f64> = sampled
        .state
        .iter()
        .zip(&ranges.state)
        .enumerate()
        .map(|(i, (x, range))| {
            if i < bodies {
                x + range * random.random_range(-0.1..0.1)
            } else {
                x * speed_factor
            }
        })
        .collect();
    // Small and large excitation alike: friction shows in the small, limits in the large.
    let amplitude = 10_f64.powf(random.random_range(-1.3..0.3));
    let centres: Vec<f64> = sampled
        .inputs
        .iter()
        .map(|u| if at_rest || !u.is_finite() { 0.0 } else { *u })
        .collect();
    let mut inputs: Vec<f64> = centres
        .iter()
        .zip(&ranges.input)
        .map(|(centre, range)| {
            let away = if at_rest {
                amplitude * range.spread * random.random_range(-1.0..1.0)
            } else {
                0.0
            };
            (centre + away).clamp(range.low, range.high)
        })
        .collect();
    let mut targets = inputs.clone();
    let mut stepper = Stepper::new(plant, values, &start)?;
    let mut episode = Episode {
        start,
        u: Vec::new(),
        y: Vec::new(),
        measured: Vec::new(),
        channels: Vec::new(),
    };
    let observe = |episode: &mut Episode, stepper: &Stepper<f64>, random: &mut ChaCha8Rng| {
        for (sensor, noise) in config.outputs.iter().zip(&config.noise) {
            let y = stepper.signal(*sensor);
            episode.y.push(y);
            episode.measured.push(y + noise * gaussian(random));
        }
        for (sensor, noise) in config.channels.iter().zip(&config.channel_noise) {
            let s = stepper.signal(*sensor);
            episode.channels.push(s + noise * gaussian(random));
        }
    };
    for _ in 0..config.steps {
        for (i, range) in ranges.input.iter().enumerate() {
            if random.random_bool(0.1) {
                let centre = if random.random_bool(0.5) {
                    centres[i]
                } else {
                    inputs[i]
                };
                let reach = amplitude * range.spread;
                targets[i] =
                    (centre + reach * random.random_range(-1.0..1.0)).clamp(range.low, range.high);
            }
            let change = (targets[i] - inputs[i]) * random.random_range(0.2..1.0);
            inputs[i] += change.clamp(-range.change, range.change);
        }
        observe(&mut episode, &stepper, random);
        episode.u.extend_from_slice(&inputs);
        stepper.advance(config.period_s, &inputs)?;
    }
    observe(&mut episode, &stepper, random);
    Ok(episode)
}
