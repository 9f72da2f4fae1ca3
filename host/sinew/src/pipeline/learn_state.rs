//! Training of a model with a state, and the noise and prior of its filter.

use sinew_ident::error::{Error, Result};
use sinew_model::spec::{
    Activation, ControlSpec, Dense, MAX_PARAMETERS, MAX_STATES, ModelSpec, OutputForm, Parameter,
    Signal, State, StateSpec,
};
use sinew_sim::{Plant, Rig, Stepper};
use sinew_train::dataset::{self, RolloutConfig, SampledState};
use sinew_train::state::{Population, Scale, StateEpisode, StateModel, StateOptions, draw, train};
use sinew_train::train::Epoch;

use super::learned::{Learned, Record, control, crate_name, unit_of};
use super::plants::Plants;
use crate::closed_loop::control_problem::ControlProblem;
use crate::rig_file;

/// Hidden units where the rig does not say.
const UNITS: usize = 6;
/// Steps of an episode beyond the rollout. Longer ones leave the states that control visits, and
/// what bends near rest is lost in the average.
const EPISODE_STEPS: usize = 4;
/// Episodes to train on, to choose the pass by, and to score on.
const EPISODES: [usize; 3] = [4000, 500, 500];
/// Standard deviation of a parameter over devices, as a part of its value, and the largest
/// deviation that the network is trained on, in standard deviations.
const SPREAD: f64 = 0.15;
/// See [`SPREAD`].
const REACH: f64 = 2.0;
/// Largest deviation that the filter may believe, in standard deviations.
const BOUND: f64 = 2.5;
/// Standard deviation of a parameter's change over one second, in standard deviations: a change of
/// 30 % is followed within seconds (docs/decisions/0080).
const DRIFT: f64 = 0.22;
/// Standard deviation of an input's disturbance before any reading, as a part of half its range.
const DISTURBANCE: f64 = 0.01;
/// Standard deviation of a velocity at rest, as a part of half its range: no device is quite
/// still.
const STILL: f64 = 0.01;
/// Least noise of a measurement, model units: simulated recordings may have none.
const QUIET: f64 = 1e-5;
/// Largest innovation that is believed, in standard deviations.
const GATE: f64 = 6.0;
/// Trainings from starts of their own, of which the best on validation is kept: of three seeds of
/// the demo one ended with an error after 12 steps of 3.6 in the place of 2.1 mm
/// (docs/decisions/0081).
const STARTS: usize = 3;
/// Episodes that say which parameters matter.
const TRIALS: usize = 40;

/// Refuses a rig whose state no filter on a chip could follow; said before anything is simulated.
///
/// # Errors
/// It has too many states.
pub(super) fn has_a_state(rig: &Rig, plant: &Plant) -> Result<()> {
    let states = plant.state_names().len();
    if states <= MAX_STATES {
        return Ok(());
    }
    let line = rig_file::network_table(rig)?.map_or(1, |table| table.line);
    let message = format!(
        "`form = \"state\"` of [network]: the rig has {states} states, and a filter on the chip \
         follows at most {MAX_STATES}"
    );
    Err(Error::file(&rig.file, message)
        .at(line, 1)
        .expected("`form = \"increment\"`, a network on past readings"))
}

/// Trains the transition of `rig` over a population of plants about the usual one.
///
/// # Errors
/// The rig has too many states, the plant diverges, or nothing is learned.
pub(super) fn learn_state(
    rig: &Rig,
    plant: &Plant,
    plants: Plants<'_>,
    sampled_states: &[SampledState],
    task: &ControlProblem,
    seed: u64,
    mut progress: impl FnMut(usize, usize, Epoch),
) -> Result<Learned> {
    has_a_state(rig, plant)?;
    let values = plants.usual;
    let hidden = rig_file::network_table(rig)?.and_then(|table| table.hidden);
    let options = StateOptions {
        units: hidden
            .and_then(|widths| widths.first().copied())
            .unwrap_or(UNITS),
        rollout: task.horizon.clamp(1, 12),
        // Velocities, after the positions.
        switching: (plant.bodies()..2 * plant.bodies()).collect(),
        seed,
        ..StateOptions::default()
    };
    let config = RolloutConfig {
        period_s: task.period_s,
        steps: EPISODE_STEPS + task.horizon.max(options.rollout),
        outputs: task.outputs.clone(),
        noise: vec![0.0; task.outputs.len()],
        channels: task.channels.clone(),
        channel_noise: vec![0.0; task.channels.len()],
        seed,
    };
    let population = Population {
        slots: influential(plant, values, sampled_states, task, &config)?,
        spread: SPREAD,
        reach: REACH,
        fleet: plants.fleet.cloned(),
    };
    let mut sets = Vec::new();
    for (set, count) in EPISODES.into_iter().enumerate() {
        let config = RolloutConfig {
            // Apart from the seeds of every other draw.
            seed: seed.wrapping_mul(8).wrapping_add(set as u64 + 1),
            ..config.clone()
        };
        sets.push(draw(
            plant,
            values,
            &population,
            sampled_states,
            &config,
            count,
        )?);
    }
    let n_m = task.outputs.len() + task.channels.len();
    let signals = (plant.inputs().len(), n_m);
    let (model, history) = best_of_starts(signals, &sets, &options, &mut progress)?;
    let spec = spec(rig, plant, values, &population, task, &model)?;
    let (one_step_rms, horizon_rms) = score(&model, task, &sets[2]);
    let best = |a: &(usize, &Epoch), b: &(usize, &Epoch)| a.1.validation.total_cmp(&b.1.validation);
    let kept = history
        .iter()
        .enumerate()
        .min_by(best)
        .map_or(0, |(pass, _)| pass);
    let record = Record {
        kept,
        history,
        parameters: spec.parameters(),
        one_step_rms,
        horizon_rms,
        horizon: task.horizon,
    };
    Ok(Learned { spec, record })
}

/// Trains from several starts, and keeps the model that is best on the second of the `sets`, with
/// its history. `signals`: the counts of inputs and of measurements.
fn best_of_starts(
    signals: (usize, usize),
    sets: &[Vec<StateEpisode>],
    options: &StateOptions,
    progress: &mut impl FnMut(usize, usize, Epoch),
) -> Result<(StateModel, Vec<Epoch>)> {
    let least = |history: &[Epoch]| {
        let losses = history.iter().map(|losses| losses.validation);
        losses.fold(f64::INFINITY, f64::min)
    };
    let mut best: Option<(StateModel, Vec<Epoch>)> = None;
    for start in 0..STARTS {
        let options = StateOptions {
            seed: options.seed.wrapping_add(1000 * start as u64),
            ..options.clone()
        };
        let mut history = Vec::new();
        let model = train(
            signals,
            [&sets[0], &sets[1], &sets[2]],
            &options,
            |done, of, losses| {
                let losses = Epoch {
                    training: losses.training,
                    validation: losses.validation,
                };
                history.push(losses);
                progress(start * of + done, STARTS * of, losses);
            },
        )?;
        let better = |(_, known): &(StateModel, Vec<Epoch>)| least(&history) < least(known);
        if best.as_ref().is_none_or(better) {
            best = Some((model, history));
        }
    }
    best.ok_or_else(|| Error::failed("no training was started"))
}

/// Slots of the free parameters that move the outputs most, at most [`MAX_PARAMETERS`]: the root
/// mean square change of the outputs over an episode, in their ranges, when one parameter is a
/// standard deviation larger.
fn influential(
    plant: &Plant,
    values: &[f64],
    sampled_states: &[SampledState],
    task: &ControlProblem,
    config: &RolloutConfig,
) -> Result<Vec<usize>> {
    let episodes = dataset::draw(plant, &[values], sampled_states, config, TRIALS)?;
    let outputs = |values: &[f64]| -> Result<Vec<f64>> {
        let mut all = Vec::new();
        for episode in &episodes {
            let mut stepper = Stepper::new(plant, values, &episode.start)?;
            for u in episode.u.chunks_exact(plant.inputs().len()) {
                stepper.advance(config.period_s, u)?;
                let ranges = task.outputs.iter().zip(&task.output_range);
                all.extend(ranges.map(|(sensor, range)| stepper.signal(*sensor) / range));
            }
        }
        Ok(all)
    };
    let usual = outputs(values)?;
    let mut effects = Vec::new();
    for slot in plant.free_slots() {
        // theta is relative: a number that is 0 has no other value.
        if values[slot] == 0.0 {
            continue;
        }
        let mut moved = values.to_vec();
        moved[slot] *= 1.0 + SPREAD;
        let changes = outputs(&moved)?;
        let squares = changes.iter().zip(&usual).map(|(a, b)| (a - b) * (a - b));
        effects.push((squares.sum::<f64>(), slot));
    }
    effects.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut slots: Vec<usize> = effects.into_iter().map(|(_, slot)| slot).collect();
    slots.truncate(MAX_PARAMETERS);
    slots.sort_unstable();
    Ok(slots)
}

fn signal(name: &str, unit: &str, scale: Scale) -> Signal {
    Signal {
        name: name.into(),
        unit: unit.into(),
        span: scale.span,
        offset: scale.offset,
    }
}

fn dense(rows: &[Vec<f32>], bias: &[f32], activation: Activation) -> Result<Dense> {
    Dense::from_rows(rows, bias.to_vec(), activation).map_err(|e| Error::failed(e.to_string()))
}

/// States, estimated parameters and measurement of the model, with their noise.
fn state_spec(
    plant: &Plant,
    values: &[f64],
    population: &Population,
    task: &ControlProblem,
    model: &StateModel,
) -> Result<StateSpec> {
    let noise = task.noise.iter().chain(&task.channel_noise);
    let noise = noise.zip(&model.measurements).zip(&model.measurement_error);
    // What a linear measurement leaves is noise to the filter.
    let measurement_noise = noise
        .map(|((noise, scale), error)| (noise / scale.span).hypot(*error).max(QUIET))
        .collect();
    let names = plant.state_names();
    let states = names.iter().zip(&model.states).zip(&model.one_step_error);
    let parameters = population.slots.iter().map(|slot| Parameter {
        name: plant.parameters()[*slot].name.clone(),
        value: values[*slot],
        spread: population.spread,
        noise: DRIFT * task.period_s.sqrt(),
        lower: -BOUND,
        upper: BOUND,
    });
    Ok(StateSpec {
        states: states
            .enumerate()
            .map(|(i, ((name, scale), error))| {
                // Rest says what a velocity is, and nothing of a position or a charge.
                let velocity = (plant.bodies()..2 * plant.bodies()).contains(&i);
                State {
                    signal: signal(name, "SI", *scale),
                    rest: if velocity { scale.scaled(0.0) } else { 0.0 },
                    rest_deviation: if velocity { STILL } else { 1.0 },
                    deviation: 1.0,
                    noise: *error,
                }
            })
            .collect(),
        parameters: parameters.collect(),
        measurement: dense(
            &model.measurement,
            &model.measurement_bias,
            Activation::Linear,
        )?,
        measurement_noise,
        disturbance_deviation: DISTURBANCE,
        gate: GATE,
    })
}

fn spec(
    rig: &Rig,
    plant: &Plant,
    values: &[f64],
    population: &Population,
    task: &ControlProblem,
    model: &StateModel,
) -> Result<ModelSpec> {
    let sensors = plant.sensors();
    let measured = |columns: &[usize], first: usize| -> Vec<Signal> {
        let scales = columns.iter().zip(&model.measurements[first..]);
        scales
            .map(|(s, scale)| signal(&sensors[*s].column, unit_of(&sensors[*s].unit), *scale))
            .collect()
    };
    let n_x = plant.state_len();
    let n_u = plant.inputs().len();
    // The trainer's columns are (x, u, theta), those of a model file (u, x, theta).
    let ordered = |row: &Vec<f32>| -> Vec<f32> {
        let (x, rest) = row.split_at(n_x);
        let (u, theta) = rest.split_at(n_u);
        [u, x, theta].concat()
    };
    let hidden: Vec<Vec<f32>> = model.hidden.iter().map(ordered).collect();
    let linear: Vec<Vec<f32>> = model.linear.iter().map(ordered).collect();
    let state = state_spec(plant, values, population, task, model)?;
    let inputs = plant.inputs().iter().zip(&model.inputs);
    let spec = ModelSpec {
        name: crate_name(&rig.name),
        period_s: task.period_s,
        inputs: inputs
            .map(|(i, s)| signal(&i.column, unit_of(i.unit()), *s))
            .collect(),
        outputs: measured(&task.outputs, 0),
        channels: measured(&task.channels, task.outputs.len()),
        past_inputs: 1,
        past_outputs: 1,
        form: OutputForm::State,
        skip: Some(linear.concat()),
        layers: vec![
            sinew_model::spec::Layer::Dense(dense(&hidden, &model.hidden_bias, Activation::Tanh)?),
            sinew_model::spec::Layer::Dense(dense(&model.output, &model.bias, Activation::Linear)?),
        ],
        control: ControlSpec {
            disturbance_gain: 0.02,
            ..control(task)
        },
        state: Some(state),
        soft_sensor: None,
        golden: vec![],
    };
    spec.validate()
        .map_err(|e| Error::failed(format!("the trained model: {e}")))?;
    Ok(spec)
}

/// Root mean square errors of the outputs one step ahead and at the horizon, physical units: from
/// the true state, with the true parameters.
fn score(model: &StateModel, task: &ControlProblem, test: &[StateEpisode]) -> (Vec<f64>, Vec<f64>) {
    let n_y = task.outputs.len();
    let (n_x, n_u) = (model.states.len(), model.inputs.len());
    let n_m = model.measurements.len();
    let scaled = |scales: &[Scale], values: &[f64]| -> Vec<f64> {
        scales
            .iter()
            .zip(values)
            .map(|(scale, value)| scale.scaled(*value))
            .collect()
    };
    let mut squares = [vec![0.0; n_y], vec![0.0; n_y]];
    for episode in test {
        let mut x = scaled(&model.states, &episode.x[..n_x]);
        for j in 0..task.horizon {
            let u = scaled(&model.inputs, &episode.u[j * n_u..(j + 1) * n_u]);
            x = model.next(
                &[&x, &u, &episode.theta]
                    .map(|part: &Vec<f64>| part.clone())
                    .concat(),
            );
            let places = [j == 0, j + 1 == task.horizon];
            for y in 0..n_y {
                let (row, scale) = (&model.measurement[y], &model.measurements[y]);
                let sum: f64 = row.iter().zip(&x).map(|(c, x)| f64::from(*c) * x).sum();
                let read = scale.span * (sum + f64::from(model.measurement_bias[y])) + scale.offset;
                let error = read - episode.m[(j + 1) * n_m + y];
                for (squares, counts) in squares.iter_mut().zip(places) {
                    squares[y] += if counts { error * error } else { 0.0 };
                }
            }
        }
    }
    let count = test.len().max(1) as f64;
    let rms = |s: &[f64]| s.iter().map(|v| (v / count).sqrt()).collect();
    (rms(&squares[0]), rms(&squares[1]))
}
