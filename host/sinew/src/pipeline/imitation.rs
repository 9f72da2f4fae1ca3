//! From a demonstration to a policy: the task of the rig, plants, training, and the policy's
//! specification (docs/explanation/imitation.md).

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_ident::error::{Error, Result};
use sinew_ident::population::Fleet;
use sinew_ident::recording::{Column, Recording};
use sinew_imitate::{
    Inverse, Limits, Network, Options, Policy, Progress, Task, View, clone, inverse, train,
};
use sinew_model::policy::{Input, Output, PolicySpec};
use sinew_nn::{Activation, Dense, Op};
use sinew_sim::Plant;

use crate::closed_loop::control_problem::ControlProblem;
use crate::closed_loop::perturbed_plant::{of_fleet, perturbed};
use crate::closed_loop::reference::Reference;

/// Most weights of a policy.
pub const MOST_WEIGHTS: usize = 600;
/// Most states and commands together that the derivatives carry.
const MOST_STATES: usize = 24;
/// Samples of the outputs, earlier commands, and rows of the reference that a policy sees.
const VIEW: (usize, usize, usize) = (8, 6, 12);
/// Widest and narrowest first hidden layer, and the second.
const HIDDEN: (usize, usize, usize) = (14, 2, 8);
/// First seeds of the plants that train, choose and judge; those of `sinew compare` begin at 4000.
const SEEDS: [u64; 3] = [5000, 6000, 7000];
/// Plants that train, choose and judge.
const PLANTS: [u64; 3] = [16, 8, 10];
/// Noise of a recording that has none, as a part of half the range.
const LEAST_NOISE: f64 = 2e-4;
/// Passes of cloning over the demonstration.
const EPOCHS: usize = 300;

/// Plants that a policy learns on.
#[derive(Clone, Copy)]
pub struct Draws<'a> {
    /// Largest relative deviation of a free parameter.
    pub spread: f64,
    /// The fleet that plants are drawn from instead.
    pub fleet: Option<&'a Fleet>,
    /// Seed of everything drawn.
    pub seed: u64,
    /// Largest load on a command while it learns, as a part of half its range.
    pub load: f64,
}

/// A policy, and what it was measured to do.
pub struct Imitation {
    /// The policy.
    pub spec: PolicySpec,
    /// The motion, and the commands that make the rig as written go that way.
    pub motion: Inverse,
    /// RMS distance of that motion from the recorded one.
    pub miss: f64,
    /// RMS error of the policy on each plant that judges.
    pub policy: Vec<f64>,
    /// The same of cloning, where the demonstration has commands.
    pub cloning: Option<Vec<f64>>,
}

/// Refuses rigs that the derivatives of a period do not describe.
///
/// # Errors
/// What stands in the way.
pub fn refuse(plant: &Plant, task: &ControlProblem) -> Result<()> {
    if let Some(reason) = plant.only_recordings() {
        return Err(Error::failed(format!("nothing can be commanded: {reason}")));
    }
    if task.sensed {
        return Err(
            Error::failed("a policy sees its outputs, and this rig senses them")
                .help("leave `sensed_by` of [control] out, or train a controller: sinew train"),
        );
    }
    if plant.remembers_inputs() {
        return Err(Error::failed(
            "the rig remembers earlier commands beside its state: a delay, a lag or play of an \
             actuator",
        )
        .expected("a rig whose state says all that a period begins with")
        .help("leave it out of a copy of the rig for teaching, and judge with it: sinew compare"));
    }
    let count = plant.state_len() + plant.inputs().len();
    if count > MOST_STATES {
        return Err(Error::failed(format!(
            "{count} states and commands together: {MOST_STATES} at most"
        )));
    }
    Ok(())
}

/// Sizes of the network: as wide as the weights allow.
fn sizes(view: &View) -> Result<Vec<usize>> {
    let (widest, narrowest, second) = HIDDEN;
    let of = |first: usize| vec![view.len(), first, second, view.inputs];
    let fits = |first: &usize| Network::count(&of(*first)) <= MOST_WEIGHTS;
    match (narrowest..=widest).rev().find(fits) {
        Some(first) => Ok(of(first)),
        None => Err(Error::failed(format!(
            "{} outputs and {} commands need more than {MOST_WEIGHTS} weights",
            view.outputs, view.inputs
        ))),
    }
}

/// Columns of the commands of a demonstration, a row a period, SI; none without one.
fn commands(
    demonstration: &Recording,
    plant: &Plant,
    task: &ControlProblem,
) -> Result<Option<Vec<Vec<f64>>>> {
    let recorded = |column: &str| demonstration.column(column).is_some();
    if !plant.inputs().iter().all(|input| recorded(&input.column)) {
        return Ok(None);
    }
    let columns = plant.inputs().iter();
    let columns = columns.map(|input| Ok(demonstration.input(input)?.values));
    let columns = columns.collect::<Result<Vec<_>>>()?;
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let rows = Reference::recorded(demonstration.t(), &columns, task.period_s).rows;
    Ok(Some(rows))
}

/// Teaches a policy the motion of `task.reference`. `progress` hears of each look; false ends the
/// training with the best policy so far.
///
/// # Errors
/// A plant that diverges, or one that is refused.
pub fn imitate(
    name: &str,
    (plant, task): (&Plant, &ControlProblem),
    demonstration: &Recording,
    draws: Draws<'_>,
    options: &Options,
    progress: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Imitation> {
    refuse(plant, task)?;
    let wanted = &task.reference.rows;
    let noise: Vec<f64> = (task.noise.iter().zip(&task.output_range))
        .map(|(noise, half)| noise.max(LEAST_NOISE * half))
        .collect();
    let limits = limits(task);
    let mut first = vec![None; plant.sensors().len()];
    for (i, sensor) in task.outputs.iter().enumerate() {
        first[*sensor] = Some(wanted[0][i]);
    }
    let values = plant.values();
    let start = plant.initial_state(&values, &first)?;
    let motion = inverse(
        plant,
        &values,
        &start,
        &task.outputs,
        wanted,
        &noise,
        &limits,
        task.period_s,
    )?;
    let [teach, choose, judge] = [0, 1, 2].map(|role| plants(plant, task, draws, role));
    let load: Vec<f64> = task
        .input_range
        .iter()
        .map(|half| draws.load * half)
        .collect();
    let lesson = Task {
        plant,
        outputs: &task.outputs,
        motion: &motion,
        period_s: task.period_s,
        noise: &task.noise,
        load: &load,
        train: &teach,
        select: &choose,
    };
    let view = View {
        outputs: task.outputs.len(),
        inputs: plant.inputs().len(),
        past_outputs: VIEW.0,
        past_inputs: VIEW.1,
        ahead: VIEW.2,
    };
    let mut random = ChaCha8Rng::seed_from_u64(draws.seed);
    let network = Network::new(&sizes(&view)?, &mut random);
    let fresh = Policy::new(view, network, limits, (&motion.y, &motion.u));
    let trained = train(&lesson, fresh.clone(), options, progress);
    let seed = 2_000_000 + draws.seed;
    let cloning = commands(demonstration, plant, task)?.map(|u| {
        let mut cloned = fresh;
        let rows = u.len().min(wanted.len()) - 1;
        let pairs = (&wanted[..=rows], &u[..rows]);
        clone(&mut cloned, pairs, &motion.y, EPOCHS, draws.seed);
        lesson.judge(&cloned, &judge, seed)
    });
    Ok(Imitation {
        spec: specification(name, &trained.policy, plant, task),
        miss: sinew_imitate::rms(&motion.y, wanted),
        policy: lesson.judge(&trained.policy, &judge, seed),
        cloning,
        motion,
    })
}

/// Limits of the task; loops begin at zero, or where that is outside, at the nearest limit.
fn limits(task: &ControlProblem) -> Limits {
    let of = |part: fn(&(f64, f64, f64)) -> f64| task.limits.iter().map(part).collect();
    Limits {
        lower: of(|limit| limit.0),
        upper: of(|limit| limit.1),
        rate: of(|limit| limit.2),
        safe: of(|limit| 0.0_f64.clamp(limit.0, limit.1)),
    }
}

/// Plants of a role: the first of those that train is the rig as written.
fn plants(plant: &Plant, task: &ControlProblem, draws: Draws<'_>, role: usize) -> Vec<Vec<f64>> {
    let drawn = (0..PLANTS[role]).map(|k| {
        let seed = draws.seed.wrapping_add(SEEDS[role] + k);
        match draws.fleet {
            None => perturbed(plant, &task.calibrated, (0.0, draws.spread), seed).0,
            Some(fleet) => of_fleet(plant, &task.calibrated, fleet, seed).0,
        }
    });
    let written = (role == 0).then(|| plant.values());
    written.into_iter().chain(drawn).collect()
}

/// The policy as files have it: features and units folded into the network, limits rounded inwards.
fn specification(name: &str, policy: &Policy, plant: &Plant, task: &ControlProblem) -> PolicySpec {
    let view = policy.view;
    let ends = |i: usize| {
        let column = task.reference.rows.iter().map(|row| row[i]);
        column.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        })
    };
    let outputs = task.outputs.iter().enumerate().map(|(i, sensor)| {
        let (low, high) = ends(i);
        let sensor = &plant.sensors()[*sensor];
        Output {
            name: sensor.column.clone(),
            unit: sensor.unit.clone(),
            low,
            high,
        }
    });
    let inputs = plant.inputs().iter().enumerate().map(|(i, input)| {
        let limits = &policy.limits;
        Input {
            name: input.column.clone(),
            unit: input.unit().into(),
            lower: at_least(limits.lower[i]),
            upper: at_most(limits.upper[i]),
            rate: at_most(limits.rate[i]),
            safe: limits.safe[i] as f32,
        }
    });
    PolicySpec {
        name: name.into(),
        period_s: task.period_s,
        outputs: outputs.collect(),
        inputs: inputs.collect(),
        past_outputs: view.past_outputs,
        past_inputs: view.past_inputs,
        ahead: view.ahead,
        network: network(name, &policy.folded()),
    }
}

/// The largest f32 that is no larger.
fn at_most(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) > value {
        near.next_down()
    } else {
        near
    }
}

/// The smallest f32 that is no smaller.
fn at_least(value: f64) -> f32 {
    -at_most(-value)
}

/// The network as `sinew-nn` has it: a dense layer of all features runs beside the tanh layers.
fn network(name: &str, network: &Network) -> sinew_nn::Network {
    let push = |to: &mut sinew_nn::Network, layer: &str, op: Op, from: Vec<usize>| {
        to.push(layer, op, from)
            .expect("layers of these sizes fit each other")
    };
    let n = network.sizes[0];
    let mut result = sinew_nn::Network::new(&format!("{name}-network"), "seen", vec![n]);
    let numbers = |of: &[f64]| -> Vec<f32> { of.iter().map(|w| *w as f32).collect() };
    let (mut first, mut from) = (0, 0);
    let last = network.sizes.len() - 2;
    for (layer, pair) in network.sizes.windows(2).enumerate() {
        let biases = first + pair[0] * pair[1];
        let end = biases + pair[1];
        let dense = Dense {
            weights: numbers(&network.weights[first..biases]),
            bias: numbers(&network.weights[biases..end]),
        };
        from = push(
            &mut result,
            &format!("dense-{}", layer + 1),
            Op::Dense(dense),
            vec![from],
        );
        if layer < last {
            let tanh = Op::Activation(Activation::Tanh);
            from = push(
                &mut result,
                &format!("tanh-{}", layer + 1),
                tanh,
                vec![from],
            );
        }
        first = end;
    }
    let path = Dense {
        weights: numbers(&network.weights[first..]),
        bias: vec![0.0; network.sizes[last + 1]],
    };
    let path = push(&mut result, "linear-path", Op::Dense(path), vec![0]);
    push(&mut result, "change", Op::Add, vec![from, path]);
    result
}

/// The commands of a motion and what the rig as written makes of them, as a recording in the
/// columns' own units.
///
/// # Errors
/// As [`Recording::new`].
pub fn recording(
    motion: &Inverse,
    plant: &Plant,
    task: &ControlProblem,
    path: &std::path::Path,
) -> Result<Recording> {
    let rows = motion.y.len();
    let t = (0..rows).map(|k| k as f64 * task.period_s).collect();
    // The last command holds where the motion ends.
    let u = motion.u.iter().chain(motion.u.last());
    let inputs = plant.inputs().iter().enumerate().map(|(i, input)| Column {
        name: input.column.clone(),
        values: u.clone().map(|u| u[i] / input.column_factor).collect(),
    });
    let outputs = task.outputs.iter().enumerate().map(|(i, sensor)| {
        let sensor = &plant.sensors()[*sensor];
        Column {
            name: sensor.column.clone(),
            values: motion
                .y
                .iter()
                .map(|y| y[i] / sensor.column_factor)
                .collect(),
        }
    });
    Recording::new(path, t, inputs.chain(outputs).collect())
}
