//! From the fitted rig to a model: episodes, training, and the score on stretches that trained
//! nothing.

use std::path::Path;

use sinew_model::evaluate::advance;
use sinew_model::spec::limits::MAX_REGRESSOR;
use sinew_model::spec::{ControlSpec, ModelSpec, OutputForm, Signal};
use sinew_model::store;
use sinew_sim::{Plant, Rig};
use sinew_train::{FirstLayer, Form};

use super::learn_state::{has_a_state, learn_state};
pub use super::learned::{Learned, Record, crate_name};
use super::learned::{control, unit_of};
use super::plants::Plants;
use crate::closed_loop::control_problem::ControlProblem;
use crate::rig_file;
use sinew_ident::error::{Error, Result};
use sinew_train::dataset::{
    Episode, RolloutConfig, SampledState, Sensitivity, Stretch, draw, sensitivities,
};
use sinew_train::train::{
    Checkpoint, Epoch, Folded, Options, Scaled, Shape, Windows, gates, layers, scale, scaling,
    train,
};

/// File of an unfinished training, in the folder of its result.
pub const CHECKPOINT_FILE: &str = "training.checkpoint";

/// Steps of an episode beyond the history and the rollout.
const EPISODE_STEPS: usize = 60;
/// Episodes to train on, to choose the pass by, and to score on.
const EPISODES: [usize; 3] = [400, 80, 80];
/// States of the recordings from which episodes may begin.
pub const SAMPLED_STATES: usize = 4000;

/// Words about a training whose first progress was at this pass: it went on where one was stopped.
pub fn went_on(first: Option<usize>) -> String {
    match first {
        Some(pass) if pass > 1 => format!(", gone on from pass {pass} of a stopped training"),
        _ => String::new(),
    }
}

/// The rig's `[network]` table, what it leaves open filled in.
///
/// # Errors
/// The table is not sound.
pub fn options(rig: &Rig, horizon: usize, seed: u64) -> Result<(Shape, Options)> {
    let table = rig_file::network_table(rig)?;
    let table = table.as_ref();
    let shape = Shape {
        n_u: 0,
        n_y: 0,
        past_inputs: table.and_then(|t| t.past_inputs).unwrap_or(2),
        past_outputs: table.and_then(|t| t.past_outputs).unwrap_or(3),
        n_s: table.map_or(0, |t| t.channels.len()),
    };
    let hidden = table
        .and_then(|t| t.hidden.clone())
        .unwrap_or_else(|| vec![12]);
    let first = table
        .and_then(|t| t.first_layer)
        .unwrap_or(FirstLayer::Tanh);
    Ok((
        shape,
        Options {
            hidden,
            observer_gain: table.and_then(|t| t.observer_gain).unwrap_or(1.0),
            derivative_weight: table.and_then(|t| t.derivative_weight).unwrap_or(0.0),
            rollout: horizon.clamp(1, 12),
            seed,
            ..Options::of(first)
        },
    ))
}

/// Trains the model of `rig` on episodes of `plants`, begun at `sampled_states`, with
/// a seed and a file for its checkpoint.
///
/// # Errors
/// The rig asks for a form that training does not make, the plant diverges, or nothing is learned.
pub fn learn(
    rig: &Rig,
    plant: &Plant,
    plants: Plants<'_>,
    sampled_states: &[SampledState],
    task: &ControlProblem,
    (seed, checkpoint): (u64, &Path),
    mut progress: impl FnMut(usize, usize, Epoch),
) -> Result<Learned> {
    let form = rig_file::network_table(rig)?.and_then(|t| t.form);
    if form == Some(Form::State) {
        return learn_state(rig, plant, plants, sampled_states, task, seed, progress);
    }
    if form == Some(Form::Absolute) {
        return Err(
            Error::file(&rig.file, "`form = \"absolute\"` is for imported networks").expected(
                "`form = \"increment\"`, or no `form`: training learns the change of the output",
            ),
        );
    }
    fits(rig, plant, task)?;
    let mut attempt = |task: &ControlProblem| {
        learned(
            rig,
            plant,
            plants,
            sampled_states,
            task,
            (seed, checkpoint),
            &mut progress,
        )
    };
    let noise = roughened(&task.noise, &task.output_range);
    match attempt(task) {
        Err(_) if noise != task.noise => attempt(&ControlProblem {
            noise,
            ..task.clone()
        }),
        outcome => outcome,
    }
}

/// [`learn`], with the noise that the task says.
fn learned(
    rig: &Rig,
    plant: &Plant,
    plants: Plants<'_>,
    sampled_states: &[SampledState],
    task: &ControlProblem,
    (seed, checkpoint): (u64, &Path),
    progress: impl FnMut(usize, usize, Epoch),
) -> Result<Learned> {
    let (shape, options) = options(rig, task.rollout(), seed)?;
    let shape = Shape {
        n_u: plant.inputs().len(),
        n_y: task.outputs.len(),
        ..shape
    };
    let config = RolloutConfig {
        period_s: task.period_s,
        steps: EPISODE_STEPS + shape.history() + options.burn_in() + options.rollout,
        outputs: task.outputs.clone(),
        noise: task.noise.clone(),
        channels: task.seen_channels().0.to_vec(),
        channel_noise: task.seen_channels().1.to_vec(),
        seed,
    };
    let count = EPISODES.iter().sum();
    let plants = plants.drawn(plant, seed, count);
    let plants: Vec<&[f64]> = plants.iter().map(Vec::as_slice).collect();
    let drawn = draw(plant, &plants, sampled_states, &config, count)?;
    let scalings = Scalings::of(&drawn, &shape);
    let mut scaled = scale(&drawn, &scalings.u, &scalings.y, &scalings.s);
    if options.derivative_weight > 0.0 {
        let reach: Vec<f64> = scalings.u.iter().map(|(span, _)| *span).collect();
        let stretch = Stretch {
            first: shape.history() + options.burn_in(),
            steps: options.rollout,
            reach: &reach,
        };
        let sensitivities = sensitivities(
            plant,
            &plants,
            &drawn[..EPISODES[0] + EPISODES[1]],
            &config,
            stretch,
        )?;
        for (episode, sensitivities) in scaled.iter_mut().zip(sensitivities) {
            episode.sensitivities = in_model_units(sensitivities, &scalings.u, &scalings.y);
        }
    }
    let (training, rest) = scaled.split_at(EPISODES[0]);
    let (validation, test) = rest.split_at(EPISODES[1]);

    let mut checkpoint = Checkpoint::new(checkpoint);
    let checkpoint = Some(&mut checkpoint);
    let trained = train(shape, training, validation, &options, checkpoint, progress)?;
    let spec = spec(
        rig,
        plant,
        task,
        (shape, &options),
        &scalings,
        &trained.folded,
    )?;
    let (one_step_rms, horizon_rms) =
        score(&spec, shape, options.burn_in(), task, test, &scalings.y);
    let record = Record {
        history: trained.history,
        kept: trained.kept,
        parameters: spec.parameters(),
        one_step_rms,
        horizon_rms,
        horizon: task.rollout(),
    };
    Ok(Learned { spec, record })
}

/// Span and offset of each signal of a model.
struct Scalings {
    u: Vec<(f64, f64)>,
    y: Vec<(f64, f64)>,
    s: Vec<(f64, f64)>,
}

impl Scalings {
    fn of(episodes: &[Episode], shape: &Shape) -> Self {
        let columns = |values_of: fn(&Episode) -> &[f64], width: usize| {
            let column = |i: usize| {
                let values = episodes.iter().flat_map(move |episode| {
                    values_of(episode).iter().skip(i).step_by(width).copied()
                });
                scaling(values)
            };
            (0..width).map(column).collect()
        };
        Self {
            u: columns(|episode| &episode.u, shape.n_u),
            y: columns(|episode| &episode.y, shape.n_y),
            s: columns(|episode| &episode.channels, shape.n_s),
        }
    }
}

/// Model of a trained network, with its provisional settings.
fn spec(
    rig: &Rig,
    plant: &Plant,
    task: &ControlProblem,
    (shape, options): (Shape, &Options),
    scalings: &Scalings,
    folded: &Folded,
) -> Result<ModelSpec> {
    let signal = |name: &str, unit: &str, (span, offset): (f64, f64)| Signal {
        name: name.into(),
        unit: unit.into(),
        span,
        offset,
    };
    let inputs = plant.inputs().iter().zip(&scalings.u);
    let outputs = task
        .outputs
        .iter()
        .map(|s| &plant.sensors()[*s])
        .zip(&scalings.y);
    let mut spec = ModelSpec {
        name: crate_name(&rig.name),
        period_s: task.period_s,
        inputs: inputs
            .map(|(i, s)| signal(&i.column, unit_of(i.unit()), *s))
            .collect(),
        outputs: outputs
            .map(|(o, s)| signal(&o.column, &o.unit, *s))
            .collect(),
        channels: task
            .seen_channels()
            .0
            .iter()
            .map(|s| &plant.sensors()[*s])
            .zip(&scalings.s)
            .map(|(c, s)| signal(&c.column, &c.unit, *s))
            .collect(),
        past_inputs: shape.past_inputs,
        past_outputs: shape.past_outputs,
        form: OutputForm::Increment,
        skip: Some(folded.linear.concat()),
        layers: layers(folded)?,
        control: ControlSpec {
            observer_gain: options.observer_gain,
            ..control(task)
        },
        state: None,
        soft_sensor: None,
        golden: vec![],
    };
    spec.control.value = task.cost_to_go(&spec.outputs);
    spec.validate()
        .map_err(|e| Error::failed(format!("the trained model: {e}")))?;
    Ok(spec)
}

/// Sensitivities with inputs and outputs in units of their spans.
fn in_model_units(
    mut sensitivities: Vec<Sensitivity>,
    u_scaling: &[(f64, f64)],
    y_scaling: &[(f64, f64)],
) -> Vec<Sensitivity> {
    let divide = |values: &mut [f64], scaling: &[(f64, f64)]| {
        let each = values.iter_mut().zip(scaling.iter().cycle());
        each.for_each(|(value, (span, _))| *value /= span);
    };
    for sensitivity in &mut sensitivities {
        divide(&mut sensitivity.along, u_scaling);
        divide(&mut sensitivity.of, y_scaling);
    }
    sensitivities
}

/// Checks that the memory of a network fits a frame beside the regressor, before anything is
/// simulated.
///
/// # Errors
/// It does not.
pub fn fits(rig: &Rig, plant: &Plant, task: &ControlProblem) -> Result<()> {
    if rig_file::network_table(rig)?.and_then(|t| t.form) == Some(Form::State) {
        unsensed(
            rig,
            task,
            "a model with a state",
            "`form = \"increment\"` of [network]",
        )?;
        return has_a_state(rig, plant);
    }
    let (shape, options) = options(rig, task.rollout(), 0)?;
    let shape = Shape {
        n_u: plant.inputs().len(),
        n_y: task.outputs.len(),
        ..shape
    };
    let line = rig_file::network_table(rig)?.map_or(1, |table| table.line);
    if gates(options.first).is_some() && options.observer_gain < 1.0 {
        let message = "`observer_gain` of [network] is for networks without memory: one that remembers filters for itself";
        return Err(Error::file(&rig.file, message)
            .at(line, 1)
            .expected("`first_layer = \"tanh\"` or `\"relu\"`, or no `observer_gain`"));
    }
    if gates(options.first).is_some() {
        let wanted = "`first_layer = \"tanh\"` or `\"relu\"` of [network]";
        unsensed(rig, task, "a network that remembers", wanted)?;
    }
    let vectors = match options.first {
        FirstLayer::Tanh | FirstLayer::Relu => 0,
        FirstLayer::Gru => 1,
        FirstLayer::Lstm => 2,
    };
    let remembered = vectors * options.hidden.first().copied().unwrap_or(0);
    let looked_at = shape.regressor_len();
    if remembered == 0 || looked_at + remembered <= MAX_REGRESSOR {
        return Ok(());
    }
    let message = format!(
        "[network] looks at {looked_at} numbers and remembers {remembered}, more than the {MAX_REGRESSOR} of a frame"
    );
    Err(Error::file(&rig.file, message)
        .at(line, 1)
        .expected("a smaller first width in `hidden`, or fewer `past_inputs` and `past_outputs`"))
}

/// Refuses a soft sensor where the model has no place for one.
fn unsensed(rig: &Rig, task: &ControlProblem, what: &str, wanted: &str) -> Result<()> {
    if !task.sensed {
        return Ok(());
    }
    let line = rig_file::ControlTable::read(rig)?.map_or(1, |table| table.line);
    let message = format!("`sensed_by` of [control] is not for {what}");
    Err(Error::file(&rig.file, message)
        .at(line, 1)
        .expected(format!("{wanted}, or no `sensed_by`")))
}

/// Writes a model's files, each whole or not at all.
///
/// # Errors
/// The specification is not valid, or a file cannot be written.
pub fn save(folder: &Path, spec: &ModelSpec) -> Result<()> {
    for (file, contents) in store::print(spec).map_err(Error::refused)? {
        sinew_files::write(folder.join(file), contents)?;
    }
    Ok(())
}

/// Least noise of a second attempt, as a part of half an output's range. Not of the first: real
/// sensors can be quieter, and what they say is worth learning.
const QUIET: f64 = 1e-5;

/// At least a little noise on every output. Simulated recordings have none: the past of a smooth
/// signal is all but linearly dependent, and weights that rely on its last digits may make rollouts
/// that f32 cannot follow.
fn roughened(noise: &[f64], range: &[f64]) -> Vec<f64> {
    let each = noise.iter().zip(range);
    each.map(|(noise, range)| noise.max(QUIET * range))
        .collect()
}

/// Root mean square errors on `test`, one step ahead and at the horizon, in physical units. What a
/// network remembers follows from the measured past of the episode, from rest on, as in the
/// firmware; the first `burn_in` steps are not scored.
pub(super) fn score(
    spec: &ModelSpec,
    shape: Shape,
    burn_in: usize,
    task: &ControlProblem,
    test: &[Scaled],
    y_scaling: &[(f64, f64)],
) -> (Vec<f64>, Vec<f64>) {
    let test = observed(spec, shape, test);
    let windows = Windows::new(shape, burn_in, task.rollout(), &test);
    let mut warm = vec![0.0; spec.hidden_state_len()];
    let mut squares = [vec![0.0; shape.n_y], vec![0.0; shape.n_y]];
    let newest = shape.n_u * shape.past_inputs;
    for w in 0..windows.len() {
        let mut x = Vec::new();
        let first = windows.begins_episode(w);
        if first {
            warm.fill(0.0);
        }
        for back in (1..=if first { burn_in } else { burn_in.min(1) }).rev() {
            windows.regressor_before(w, back, &mut x);
            x.extend_from_slice(&warm);
            warm = advance(spec, &x).1;
            x.clear();
        }
        windows.regressor(w, &mut x);
        x.extend_from_slice(&warm);
        let seen = x.len() - warm.len();
        for (j, target) in windows.targets(w).chunks(shape.n_y).enumerate() {
            if j > 0 {
                x.copy_within(..newest - shape.n_u, shape.n_u);
                x[..shape.n_u]
                    .copy_from_slice(&windows.inputs(w)[j * shape.n_u..(j + 1) * shape.n_u]);
            }
            let (y, memory) = advance(spec, &x);
            x[seen..].copy_from_slice(&memory);
            let last = seen - shape.n_s - shape.n_y;
            x.copy_within(newest..last, newest + shape.n_y);
            x[newest..newest + shape.n_y].copy_from_slice(&y);
            let place = match j {
                0 => 0,
                j if j + 1 == task.rollout() => 1,
                _ => continue,
            };
            for r in 0..shape.n_y {
                squares[place][r] += ((y[r] - target[r]) * y_scaling[r].0).powi(2);
            }
        }
    }
    let count = windows.len().max(1) as f64;
    let rms = |s: &[f64]| s.iter().map(|v| (v / count).sqrt()).collect();
    if task.rollout() == 1 {
        return (rms(&squares[0]), rms(&squares[0]));
    }
    (rms(&squares[0]), rms(&squares[1]))
}

/// Episodes as the firmware's history holds them: what is measured entered by the observer
/// (docs/explanation/controller.md, eq. 10c), no disturbance.
fn observed(spec: &ModelSpec, shape: Shape, episodes: &[Scaled]) -> Vec<Scaled> {
    let gain = spec.control.observer_gain;
    let mut episodes = episodes.to_vec();
    if gain == 1.0 {
        return episodes;
    }
    for episode in &mut episodes {
        let mut memory = vec![0.0; spec.hidden_state_len()];
        for k in shape.history()..episode.steps {
            let mut x = Vec::new();
            episode.regressor(&shape, k, &mut x);
            x.extend_from_slice(&memory);
            let (predicted, next) = advance(spec, &x);
            memory = next;
            let place = &mut episode.measured[(k + 1) * shape.n_y..(k + 2) * shape.n_y];
            for (place, predicted) in place.iter_mut().zip(&predicted) {
                *place = predicted + gain * (*place - predicted);
            }
        }
    }
    episodes
}

#[cfg(test)]
mod tests {
    use super::{crate_name, roughened, went_on};

    #[test]
    fn a_training_that_went_on_says_from_where() {
        assert_eq!(went_on(None), "");
        assert_eq!(went_on(Some(1)), "");
        assert_eq!(
            went_on(Some(31)),
            ", gone on from pass 31 of a stopped training"
        );
    }

    #[test]
    fn an_output_without_noise_gets_a_little() {
        assert_eq!(roughened(&[0.0, 0.2], &[2.0, 1.0]), [2e-5, 0.2]);
    }

    #[test]
    fn any_rig_name_becomes_a_crate_name() {
        assert_eq!(crate_name("EMPS positioning axis"), "emps-positioning-axis");
        assert_eq!(crate_name("  ümläut (2) "), "ml-ut-2");
        assert_eq!(crate_name("***"), "rig");
    }
}
