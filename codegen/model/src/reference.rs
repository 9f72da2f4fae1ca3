//! Reads the reference problem, `sinew-reference/1`: trained networks with golden vectors of
//! another program, and one control problem that fits them all. models/reference/ holds the files.

use serde::Deserialize;

use crate::spec::{
    Activation, ControlSpec, Dense, Golden, Layer, ModelSpec, OutputForm, RowsError, Signal,
    SpecError,
};

/// Format that the files name.
pub const FORMAT: &str = "sinew-reference/1";

/// Error of a reference file.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// It is not JSON of this form.
    #[error("{what}: {error}")]
    Json {
        /// Name of the file.
        what: &'static str,
        /// Line, column and cause.
        #[source]
        error: serde_json::Error,
    },
    /// It is of another format.
    #[error("{what}: the format is {found:?}: expected {FORMAT:?}")]
    Format {
        /// Name of the file.
        what: &'static str,
        /// As given.
        found: String,
    },
    /// The layers' sizes, stated and actual, differ.
    #[error("network: its sizes are {stated:?}, but the layers given are {found:?}")]
    Sizes {
        /// `sizes`.
        stated: Vec<usize>,
        /// By the weights.
        found: Vec<usize>,
    },
    /// The counts of past values do not leave a whole number of inputs.
    #[error("network: {inputs} inputs are not {rest} plus a whole number of {past} past values")]
    Inputs {
        /// Of the network.
        inputs: usize,
        /// Past outputs and channels.
        rest: usize,
        /// `inputs_past`.
        past: usize,
    },
    /// The horizon asked for is none of the problem's.
    #[error("problem: a horizon of {asked} is none of {offered:?}")]
    Horizon {
        /// By the caller.
        asked: usize,
        /// `N2`.
        offered: Vec<usize>,
    },
    /// Rows of a weight matrix differ in length.
    #[error("network: layer {layer}: {error}")]
    Rows {
        /// Index of the layer.
        layer: usize,
        /// Index of the row.
        #[source]
        error: RowsError,
    },
    /// A line of the trajectory is not numbers.
    #[error("reference.csv, line {line}: expected a time and a number for each output")]
    Row {
        /// The line, from 1.
        line: usize,
    },
    /// The model that comes out is not valid.
    #[error(transparent)]
    Spec(#[from] SpecError),
}

#[derive(Deserialize)]
struct Network {
    format: String,
    name: String,
    sizes: Vec<usize>,
    inputs_past: usize,
    outputs_past: usize,
    channels: usize,
    layers: Vec<LayerJson>,
    golden_f64: Vec<GoldenJson>,
}

#[derive(Deserialize)]
struct LayerJson {
    activation: ActivationJson,
    w: Vec<Vec<f32>>,
    b: Vec<f32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum ActivationJson {
    Linear,
    Tanh,
    Relu,
}

#[derive(Deserialize)]
struct GoldenJson {
    x: Vec<f32>,
    y: Vec<f64>,
}

#[derive(Deserialize)]
struct Problem {
    format: String,
    period_s: f64,
    #[serde(rename = "N2")]
    horizons: Vec<usize>,
    #[serde(rename = "Q")]
    tracking_weight: Vec<f64>,
    #[serde(rename = "Lambda")]
    move_suppression: Vec<f64>,
    u_min: Vec<f64>,
    u_max: Vec<f64>,
    du_max_per_step: Vec<f64>,
    newton_iterations: u8,
}

/// The model of a network file and the problem file, with a horizon that the problem offers, or 1,
/// and the whole of it decided in blocks of equal moves (`blocks` empty: one step each). Signals
/// are scaled already: spans are 1. Its name is that of the network, and the horizon unless that is
/// the longest.
///
/// The problem names no disturbance estimate, so the gain is 0; a gap of missing samples may be as
/// long as the horizon that predicts across it.
///
/// # Errors
/// [`ReferenceError`], whichever of its kinds comes first.
pub fn import(
    network: &str,
    problem: &str,
    horizon: usize,
    blocks: &[usize],
) -> Result<ModelSpec, ReferenceError> {
    let network: Network = read("network", network)?;
    let problem: Problem = read("problem", problem)?;
    expect_format("network", &network.format)?;
    expect_format("problem", &problem.format)?;
    if horizon != 1 && !problem.horizons.contains(&horizon) {
        return Err(ReferenceError::Horizon {
            asked: horizon,
            offered: problem.horizons,
        });
    }
    let layers = layers(network.layers, &network.sizes)?;
    let n_x = network.sizes.first().copied().unwrap_or(0);
    let n_y = network.sizes.last().copied().unwrap_or(0);
    let n_u = inputs(
        n_x,
        n_y,
        network.inputs_past,
        network.outputs_past,
        network.channels,
    )?;
    let spec = ModelSpec {
        name: if problem.horizons.iter().any(|longer| *longer > horizon) {
            format!("reference-{}-n{horizon}", network.name.to_lowercase())
        } else {
            format!("reference-{}", network.name.to_lowercase())
        },
        period_s: problem.period_s,
        inputs: signals("u", n_u),
        outputs: signals("y", n_y),
        channels: signals("s", network.channels),
        past_inputs: network.inputs_past,
        past_outputs: network.outputs_past,
        form: OutputForm::Absolute,
        state: None,
        soft_sensor: None,
        skip: None,
        layers,
        control: ControlSpec {
            horizon,
            control_horizon: if blocks.is_empty() {
                horizon
            } else {
                blocks.iter().sum()
            },
            move_blocks: blocks.to_vec(),
            first_step: 1,
            tracking_weight: problem.tracking_weight,
            move_suppression: problem.move_suppression,
            command_weight: 0.0,
            budget: None,
            observer_gain: 1.0,
            lower: problem.u_min,
            upper: problem.u_max,
            rate_limit: problem
                .du_max_per_step
                .iter()
                .map(|step| step / problem.period_s)
                .collect(),
            safe: vec![0.0; n_u],
            disturbance_gain: 0.0,
            iterations: problem.newton_iterations,
            max_missing_samples: horizon as u16,
            value: None,
        },
        golden: network
            .golden_f64
            .into_iter()
            .map(|golden| Golden {
                x: golden.x,
                y: golden.y,
            })
            .collect(),
    };
    spec.validate()?;
    Ok(spec)
}

/// Rows of the reference trajectory, `reference.csv`: a header, then t and the outputs.
///
/// # Errors
/// The first line that is not numbers.
pub fn motions(text: &str) -> Result<Vec<Vec<f64>>, ReferenceError> {
    let rows = text.lines().enumerate().skip(1).map(|(index, line)| {
        let numbers: Result<Vec<f64>, _> = line.split(',').skip(1).map(str::parse).collect();
        match numbers {
            Ok(row) if !row.is_empty() => Ok(row),
            _ => Err(ReferenceError::Row { line: index + 1 }),
        }
    });
    rows.collect()
}

fn read<'a, T: Deserialize<'a>>(what: &'static str, text: &'a str) -> Result<T, ReferenceError> {
    serde_json::from_str(text).map_err(|error| ReferenceError::Json { what, error })
}

fn expect_format(what: &'static str, found: &str) -> Result<(), ReferenceError> {
    if found == FORMAT {
        return Ok(());
    }
    Err(ReferenceError::Format {
        what,
        found: found.into(),
    })
}

fn layers(layers: Vec<LayerJson>, stated: &[usize]) -> Result<Vec<Layer>, ReferenceError> {
    let layers = layers.into_iter().enumerate().map(|(index, layer)| {
        let activation = match layer.activation {
            ActivationJson::Linear => Activation::Linear,
            ActivationJson::Tanh => Activation::Tanh,
            ActivationJson::Relu => Activation::Relu,
        };
        Dense::from_rows(&layer.w, layer.b, activation)
            .map(Layer::Dense)
            .map_err(|error| ReferenceError::Rows {
                layer: index,
                error,
            })
    });
    let layers: Vec<Layer> = layers.collect::<Result<_, _>>()?;
    let found: Vec<usize> = layers
        .first()
        .map(Layer::inputs)
        .into_iter()
        .chain(layers.iter().map(Layer::outputs))
        .collect();
    if found != stated {
        return Err(ReferenceError::Sizes {
            stated: stated.to_vec(),
            found,
        });
    }
    Ok(layers)
}

/// The file does not say how many commands there are; what the outputs and channels leave does.
fn inputs(
    n_x: usize,
    n_y: usize,
    inputs_past: usize,
    outputs_past: usize,
    channels: usize,
) -> Result<usize, ReferenceError> {
    let rest = outputs_past.saturating_mul(n_y).saturating_add(channels);
    let left = n_x.checked_sub(rest);
    let whole = |n: &usize| n.checked_rem(inputs_past) == Some(0);
    left.filter(whole)
        .map(|n| n / inputs_past)
        .ok_or(ReferenceError::Inputs {
            inputs: n_x,
            rest,
            past: inputs_past,
        })
}

fn signals(letter: &str, count: usize) -> Vec<Signal> {
    (1..=count)
        .map(|i| Signal {
            name: format!("{letter}{i}"),
            unit: "1".into(),
            span: 1.0,
            offset: 0.0,
        })
        .collect()
}
