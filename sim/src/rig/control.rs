//! `[control]` and `[network]`: what the controller and its network should look like. The plant
//! does not read them; they are checked here because their lines are known here.

use super::names::{Component, Names};
use super::reader::{Reader, Spanned};
use super::{Reads, Rig};
use crate::effects::Sign;
use crate::error::Error;

/// The `[control]` table; a key that is absent is `None`.
#[derive(Clone, Debug, PartialEq)]
pub struct ControlTable {
    /// Control steps a second.
    pub rate_hz: Option<f64>,
    /// Indices of the sensors to be tracked: those that are named, else all that read a position.
    pub outputs: Vec<usize>,
    /// Columns of the recording that hold the reference, one an output; empty: none.
    pub reference: Vec<String>,
    /// Steps that are predicted.
    pub horizon: Option<usize>,
    /// Steps with a command of their own; at most the horizon.
    pub control_horizon: Option<usize>,
    /// Weight of each output's error.
    pub tracking_weight: Option<Vec<f64>>,
    /// Weight of each input's change, one a distinct input column.
    pub move_suppression: Option<Vec<f64>>,
    /// Weight of the square of every command, for inputs that can do each other's work.
    pub command_weight: Option<f64>,
    /// Line of the table, for errors about what it asks.
    pub line: usize,
}

/// What the network gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The next output.
    Absolute,
    /// What is added to the present output.
    Increment,
}

/// The first hidden layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FirstLayer {
    /// Dense, with tanh.
    Tanh,
    /// Dense, with the rectifier.
    Relu,
    /// A GRU.
    Gru,
    /// An LSTM.
    Lstm,
}

/// The `[network]` table; a key that is absent is `None`.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkTable {
    /// Widths of the hidden layers.
    pub hidden: Option<Vec<usize>>,
    /// What the first of them is.
    pub first_layer: Option<FirstLayer>,
    /// Past inputs that it sees.
    pub past_inputs: Option<usize>,
    /// Past outputs that it sees.
    pub past_outputs: Option<usize>,
    /// How much of a measurement enters the past that it sees, over 0 to 1; the rest is its own prediction.
    pub observer_gain: Option<f64>,
    /// Weight of the simulator's derivatives in what it is trained by.
    pub derivative_weight: Option<f64>,
    /// What it gives.
    pub form: Option<Form>,
    /// Indices of the sensors that it sees beside the outputs, of which it has one reading and no past.
    pub channels: Vec<usize>,
    /// Line of the table, for errors about what it asks.
    pub line: usize,
}

/// Longest horizon and widest layer that a rig may ask for; far beyond what fits a small chip.
const MAX_STEPS: usize = 256;
const MAX_WIDTH: usize = 1024;
/// Largest weight of derivatives in a loss where errors have 1: with more, errors count for nothing.
const MAX_DERIVATIVE_WEIGHT: f64 = 1000.0;

pub(super) fn read_control(
    table: Option<Reader>,
    names: &Names,
    rig: &Rig,
) -> Result<Option<ControlTable>, Error> {
    let Some(table) = table else {
        return Ok(None);
    };
    table.allow(&[
        "rate_hz",
        "outputs",
        "reference",
        "horizon",
        "control_horizon",
        "tracking_weight",
        "move_suppression",
        "command_weight",
    ])?;
    let outputs = read_outputs(&table, names, rig)?;
    let reference = table.texts("reference")?.unwrap_or_default();
    let of_outputs =
        |key: &str, found: usize| expect_length(&table, key, found, outputs.len(), "output");
    if !reference.is_empty() {
        of_outputs("reference", reference.len())?;
    }
    let tracking_weight = table.numbers("tracking_weight", Sign::NonNegative)?;
    if let Some(weight) = &tracking_weight {
        of_outputs("tracking_weight", weight.len())?;
    }
    let move_suppression = table.numbers("move_suppression", Sign::NonNegative)?;
    if let Some(weight) = &move_suppression {
        let mut inputs: Vec<&str> = rig.actuators.iter().map(|a| a.input.as_str()).collect();
        inputs.sort_unstable();
        inputs.dedup();
        let found = weight.len();
        expect_length(&table, "move_suppression", found, inputs.len(), "input")?;
    }
    let horizon = table.count("horizon", 1, MAX_STEPS)?;
    let control_horizon = table.count("control_horizon", 1, MAX_STEPS)?;
    if let (Some(horizon), Some(control)) = (horizon, control_horizon)
        && control > horizon
    {
        return Err(table.error_at(
            "control_horizon",
            format!("control_horizon = {control} is longer than horizon = {horizon}"),
        ));
    }
    Ok(Some(ControlTable {
        rate_hz: table.number("rate_hz", Sign::Positive)?,
        outputs,
        reference: reference.into_iter().map(|text| text.value).collect(),
        horizon,
        control_horizon,
        tracking_weight,
        move_suppression,
        command_weight: table.number("command_weight", Sign::NonNegative)?,
        line: table.own_line(),
    }))
}

fn expect_length(
    table: &Reader,
    key: &str,
    found: usize,
    expected: usize,
    what: &str,
) -> Result<(), Error> {
    if found == expected {
        return Ok(());
    }
    Err(table.error_at(
        key,
        format!("`{key}` has {found} entries; expected {expected}, one for each {what}"),
    ))
}

fn read_outputs(table: &Reader, names: &Names, rig: &Rig) -> Result<Vec<usize>, Error> {
    if let Some(outputs) = read_sensors(table, names, "outputs", "`outputs` of [control]")? {
        return Ok(outputs);
    }
    let reads_position = |index: &usize| matches!(rig.sensors[*index].reads, Reads::Position(_));
    Ok((0..rig.sensors.len()).filter(reads_position).collect())
}

/// The sensors that `key` names, each once; `said` is how errors call the key.
fn read_sensors(
    table: &Reader,
    names: &Names,
    key: &str,
    said: &str,
) -> Result<Option<Vec<usize>>, Error> {
    let Some(texts) = table.texts(key)? else {
        return Ok(None);
    };
    let mut sensors = Vec::new();
    for text in &texts {
        let name = Spanned {
            value: text.value.as_str(),
            span: text.span.clone(),
        };
        let sensor =
            names.resolve(
                table.source,
                &name,
                said,
                "sensors",
                |component| match component {
                    Component::Sensor(sensor) => Some(sensor),
                    _ => None,
                },
            )?;
        if sensors.contains(&sensor) {
            let what = key.trim_end_matches('s');
            return Err(table.source.error(
                name.span,
                format!("the {what} `{}` is there twice", name.value),
            ));
        }
        sensors.push(sensor);
    }
    Ok(Some(sensors))
}

pub(super) fn read_network(
    table: Option<Reader>,
    names: &Names,
    control: Option<&ControlTable>,
) -> Result<Option<NetworkTable>, Error> {
    let Some(table) = table else {
        return Ok(None);
    };
    table.allow(&[
        "hidden",
        "first_layer",
        "past_inputs",
        "past_outputs",
        "observer_gain",
        "derivative_weight",
        "form",
        "channels",
    ])?;
    let channels = read_sensors(&table, names, "channels", "`channels` of [network]")?;
    let channels = channels.unwrap_or_default();
    let outputs = control.map_or(&[][..], |control| &control.outputs);
    if channels.iter().any(|channel| outputs.contains(channel)) {
        return Err(table.error_at(
            "channels",
            "`channels` of [network] names an output of [control]; expected sensors beside the outputs, whose past the \
             network sees already"

        ));
    }
    let forms = [("absolute", Form::Absolute), ("increment", Form::Increment)];
    let first_layers = [
        ("tanh", FirstLayer::Tanh),
        ("relu", FirstLayer::Relu),
        ("gru", FirstLayer::Gru),
        ("lstm", FirstLayer::Lstm),
    ];
    let first_layer = table.word("first_layer", &first_layers)?;
    let hidden = table
        .numbers("hidden", Sign::Positive)?
        .map(|widths| {
            widths
                .into_iter()
                .map(|width| {
                    let whole = width.fract() == 0.0 && width <= MAX_WIDTH as f64;
                    whole.then_some(width as usize).ok_or_else(|| {
                        table.error_at(
                            "hidden",
                            format!(
                                "`hidden` of [network]: expected whole numbers from 1 to \
                                 {MAX_WIDTH}, found {width}"
                            ),
                        )
                    })
                })
                .collect::<Result<Vec<usize>, Error>>()
        })
        .transpose()?;
    if first_layer.is_some() && hidden.as_ref().is_some_and(Vec::is_empty) {
        return Err(table.error_at(
            "first_layer",
            "`first_layer` of [network] is about a hidden layer, and `hidden` has none; expected a width, or no \
             `first_layer`",
        ));
    }
    let observer_gain = table.number("observer_gain", Sign::Positive)?;
    // The firmware's numbers are of single precision: what is nothing there would be refused after a training.
    let taken = |gain: &f64| *gain as f32 > 0.0 && *gain <= 1.0;
    if let Some(gain) = observer_gain.filter(|gain| !taken(gain)) {
        return Err(table.error_at(
            "observer_gain",
            format!(
                "`observer_gain` of [network]: expected more than 0 and at most 1, found {gain:?}"
            ),
        ));
    }
    let derivative_weight = table.number("derivative_weight", Sign::NonNegative)?;
    if let Some(weight) = derivative_weight.filter(|weight| *weight > MAX_DERIVATIVE_WEIGHT) {
        return Err(table.error_at(
            "derivative_weight",
            format!(
                "`derivative_weight` of [network]: expected 0 to {MAX_DERIVATIVE_WEIGHT}, found {weight:?}"
            ),
        ));
    }
    Ok(Some(NetworkTable {
        hidden,
        first_layer,
        past_inputs: table.count("past_inputs", 1, MAX_STEPS)?,
        past_outputs: table.count("past_outputs", 1, MAX_STEPS)?,
        observer_gain,
        derivative_weight,
        form: table.word("form", &forms)?,
        channels,
        line: table.own_line(),
    }))
}
