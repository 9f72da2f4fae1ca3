//! `model.toml`: everything of a model but its numbers.

use std::fmt::Write;
use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::quote::string;
use super::{FORMAT, MODEL_FILE, StoreError, WEIGHTS_FILE, state};
use crate::spec::limits::{MAX_PARAMETERS, MAX_WIDTH};
use crate::spec::{
    Activation, ControlSpec, Dense, Layer, ModelSpec, OutputForm, Role, Signal, SoftSensorSpec,
    SpecError, ValueSpec, WatchSpec, gru_cell, lstm_cell, unfilled,
};
use sinew_nn::{Cell, Recurrent};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    #[serde(rename = "format")]
    _format: String,
    name: String,
    period_s: f64,
    past_inputs: usize,
    past_outputs: usize,
    form: FormKey,
    #[serde(default)]
    shortcut: bool,
    input: Vec<SignalTable>,
    output: Vec<SignalTable>,
    #[serde(default)]
    channel: Vec<SignalTable>,
    #[serde(default)]
    state: Vec<state::StateTable>,
    #[serde(default)]
    parameter: Vec<state::ParameterTable>,
    filter: Option<state::FilterTable>,
    soft_sensor: Option<SoftSensorTable>,
    layer: Vec<Spanned<LayerTable>>,
    control: ControlTable,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum FormKey {
    Absolute,
    Increment,
    State,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SignalTable {
    name: String,
    unit: String,
    span: f64,
    offset: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LayerTable {
    kind: LayerKey,
    inputs: usize,
    outputs: usize,
    activation: Option<ActivationKey>,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum LayerKey {
    Dense,
    Gru,
    Lstm,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SoftSensorTable {
    error: Vec<f64>,
    #[serde(default)]
    watched: bool,
}

/// The gain of no observer.
fn whole() -> f64 {
    1.0
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum ActivationKey {
    Linear,
    Tanh,
    Relu,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ControlTable {
    horizon: usize,
    control_horizon: usize,
    #[serde(default)]
    move_blocks: Vec<usize>,
    #[serde(default = "one")]
    first_step: usize,
    tracking_weight: Vec<f64>,
    move_suppression: Vec<f64>,
    #[serde(default)]
    command_weight: f64,
    lower: Vec<f64>,
    upper: Vec<f64>,
    rate_limit: Vec<f64>,
    safe: Vec<f64>,
    disturbance_gain: f64,
    #[serde(default = "whole")]
    observer_gain: f64,
    iterations: u8,
    budget: Option<u32>,
    // The older name.
    #[serde(alias = "gap_limit")]
    max_missing_samples: u16,
    terminal: Option<TerminalKey>,
    value: Option<ValueTable>,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum TerminalKey {
    Value,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ValueTable {
    rows: usize,
    ahead: usize,
    points: Vec<Vec<f64>>,
}

/// N1 where the file does not say it: the first predicted step counts.
const fn one() -> usize {
    1
}

/// The model that `text` describes, its layers still without weights.
pub(super) fn parse(text: &str) -> Result<ModelSpec, StoreError> {
    check_format(text)?;
    let document: Document = toml::from_str(text)
        .map_err(|error| refuse(text, error.span().unwrap_or(0..0), error.message()))?;
    let layers = document.layer.into_iter().map(|layer| {
        let span = layer.span();
        empty_layer(layer.into_inner(), |message| refuse(text, span, message))
    });
    let measurements = match document.soft_sensor {
        None => document.output.len() + document.channel.len(),
        Some(_) => document.output.len(),
    };
    let filter = document.filter;
    let (states, parameters) = (document.state, document.parameter);
    // Tables that nothing would read are no less wrong than unknown keys.
    if filter.is_none() && !(states.is_empty() && parameters.is_empty()) {
        let message = "[[state]] and [[parameter]] need [filter] beside them";
        return Err(refuse(text, 0..0, message));
    }
    if document.control.terminal.is_some() != document.control.value.is_some() {
        let message = "`terminal = \"value\"` of [control] and [control.value] need each other";
        return Err(refuse(text, 0..0, message));
    }
    let state = filter.map(|filter| state::spec(states, parameters, filter, measurements));
    let signals = |tables: Vec<SignalTable>| tables.into_iter().map(Signal::from).collect();
    Ok(ModelSpec {
        name: document.name,
        period_s: document.period_s,
        inputs: signals(document.input),
        outputs: signals(document.output),
        channels: signals(document.channel),
        past_inputs: document.past_inputs,
        past_outputs: document.past_outputs,
        form: match document.form {
            FormKey::Absolute => OutputForm::Absolute,
            FormKey::Increment => OutputForm::Increment,
            FormKey::State => OutputForm::State,
        },
        // Its weights come with those of the layers.
        skip: document.shortcut.then(Vec::new),
        layers: layers.collect::<Result<_, _>>()?,
        control: document.control.into(),
        state,
        // Its weights come with those of the layers.
        soft_sensor: document.soft_sensor.map(|table| SoftSensorSpec {
            error: table.error,
            bias: Vec::new(),
            linear: Vec::new(),
            quadratic: Vec::new(),
            watch: table.watched.then(|| WatchSpec {
                bias: Vec::new(),
                weights: Vec::new(),
                spread: Vec::new(),
            }),
        }),
        golden: Vec::new(),
    })
}

/// The format comes first: a later one may have any keys, and an unknown key is not what is wrong.
fn check_format(text: &str) -> Result<(), StoreError> {
    let document = DeTable::parse(text)
        .map_err(|error| refuse(text, error.span().unwrap_or(0..0), error.message()))?;
    let (span, found) = match document.get_ref().get("format") {
        Some(value) => (value.span(), value.get_ref().as_str()),
        None => (0..0, None),
    };
    match found {
        Some(FORMAT) => Ok(()),
        Some(other) => Err(refuse(
            text,
            span,
            &format!("the format is {other:?}: this program reads {FORMAT:?}"),
        )),
        None => Err(refuse(
            text,
            span,
            &format!("this is no model: it does not say `format = {FORMAT:?}`"),
        )),
    }
}

/// Shapes are judged here, before the weights of that size are looked for; `refuse` adds the place.
fn empty_layer(
    table: LayerTable,
    refuse: impl FnOnce(&str) -> StoreError,
) -> Result<Layer, StoreError> {
    let cell = match table.kind {
        LayerKey::Dense => None,
        LayerKey::Gru => Some(gru_cell()),
        LayerKey::Lstm => Some(lstm_cell()),
    };
    let gates = cell.map_or(1, Cell::gates);
    let parameters = table
        .outputs
        .checked_mul(table.inputs)
        .and_then(|n| n.checked_mul(gates));
    if table.outputs > MAX_WIDTH || parameters.is_none_or(|n| n > MAX_PARAMETERS) {
        return Err(refuse(&format!(
            "a layer of {} -> {} is too large: at most {MAX_WIDTH} outputs and {MAX_PARAMETERS} weights",
            table.inputs, table.outputs
        )));
    }
    if let Some(cell) = cell {
        if table.activation.is_some() {
            return Err(refuse(
                "a gru or lstm has its own activations: expected no `activation` here",
            ));
        }
        return Ok(Layer::Recurrent(Recurrent {
            // Its length tells the inputs.
            kernel: vec![0.0; gates * table.outputs * table.inputs],
            ..unfilled(cell, table.outputs)
        }));
    }
    let Some(activation) = table.activation else {
        return Err(refuse("missing field `activation`"));
    };
    Ok(Layer::Dense(Dense {
        inputs: table.inputs,
        outputs: table.outputs,
        weights: Vec::new(),
        bias: Vec::new(),
        activation: match activation {
            ActivationKey::Linear => Activation::Linear,
            ActivationKey::Tanh => Activation::Tanh,
            ActivationKey::Relu => Activation::Relu,
        },
    }))
}

/// `error` with the file that states its cause, and the line if that is `text`.
pub(super) fn locate(text: &str, error: SpecError) -> StoreError {
    let key = error.key();
    let line = DeTable::parse(text)
        .ok()
        .and_then(|document| find(&document, &key))
        .map(|span| line_of(text.as_bytes(), span.start));
    // What has no key is a number, and numbers stand in the other file.
    let file = if key.is_empty() {
        WEIGHTS_FILE
    } else {
        MODEL_FILE
    };
    StoreError::Spec {
        file: file.into(),
        line,
        error,
    }
}

/// Range of the value at `path`, or of the innermost existing table around it.
fn find(document: &Spanned<DeTable<'_>>, path: &[String]) -> Option<Range<usize>> {
    let (first, rest) = path.split_first()?;
    let mut value = document.get_ref().get(first.as_str())?;
    for key in rest {
        let inner = match value.get_ref() {
            DeValue::Table(table) => table.get(key.as_str()),
            DeValue::Array(array) => key.parse().ok().and_then(|index: usize| array.get(index)),
            _ => None,
        };
        match inner {
            Some(inner) => value = inner,
            None => break,
        }
    }
    Some(value.span())
}

/// The line, from 1, on which the byte at `offset` stands.
pub(super) fn line_of(text: &[u8], offset: usize) -> usize {
    let before = &text[..offset.min(text.len())];
    1 + before.iter().filter(|&&byte| byte == b'\n').count()
}

fn refuse(text: &str, span: Range<usize>, message: &str) -> StoreError {
    StoreError::Text {
        file: MODEL_FILE.into(),
        line: line_of(text.as_bytes(), span.start),
        // The parser's longer messages have a line of their own for what it expected.
        message: message.trim_end().replace('\n', ": "),
    }
}

/// `model.toml` of `spec`; the same model gives the same bytes.
pub(super) fn print(spec: &ModelSpec) -> String {
    let mut text = String::new();
    write_model(&mut text, spec).expect("writing to a String cannot fail");
    text
}

fn write_model(text: &mut String, spec: &ModelSpec) -> std::fmt::Result {
    writeln!(text, "format = {}", string(FORMAT))?;
    writeln!(text, "name = {}", string(&spec.name))?;
    writeln!(text, "period_s = {:?}", spec.period_s)?;
    writeln!(text, "past_inputs = {}", spec.past_inputs)?;
    writeln!(text, "past_outputs = {}", spec.past_outputs)?;
    writeln!(text, "form = {}", string(spec.form.name()))?;
    if spec.skip.is_some() {
        writeln!(text, "shortcut = true")?;
    }
    for role in Role::ALL {
        for signal in spec.signals(role) {
            writeln!(text, "\n[[{role}]]")?;
            writeln!(text, "name = {}", string(&signal.name))?;
            writeln!(text, "unit = {}", string(&signal.unit))?;
            writeln!(text, "span = {:?}", signal.span)?;
            writeln!(text, "offset = {:?}", signal.offset)?;
        }
    }
    for layer in &spec.layers {
        writeln!(text, "\n[[layer]]")?;
        writeln!(text, "kind = {}", string(layer.kind()))?;
        writeln!(text, "inputs = {}", layer.inputs())?;
        writeln!(text, "outputs = {}", layer.outputs())?;
        if let Some(activation) = layer.activation() {
            writeln!(text, "activation = {}", string(activation.name()))?;
        }
    }
    if let Some(spec) = &spec.state {
        state::write(text, spec)?;
    }
    if let Some(sensor) = &spec.soft_sensor {
        writeln!(text, "\n[soft_sensor]")?;
        writeln!(text, "error = {:?}", sensor.error)?;
        if sensor.watch.is_some() {
            writeln!(text, "watched = true")?;
        }
    }
    let control = &spec.control;
    writeln!(text, "\n[control]")?;
    writeln!(text, "horizon = {}", control.horizon)?;
    writeln!(text, "control_horizon = {}", control.control_horizon)?;
    if !control.move_blocks.is_empty() {
        writeln!(text, "move_blocks = {:?}", control.move_blocks)?;
    }
    if control.first_step != 1 {
        writeln!(text, "first_step = {}", control.first_step)?;
    }
    writeln!(text, "tracking_weight = {:?}", control.tracking_weight)?;
    writeln!(text, "move_suppression = {:?}", control.move_suppression)?;
    if control.command_weight != 0.0 {
        writeln!(text, "command_weight = {:?}", control.command_weight)?;
    }
    writeln!(text, "lower = {:?}", control.lower)?;
    writeln!(text, "upper = {:?}", control.upper)?;
    writeln!(text, "rate_limit = {:?}", control.rate_limit)?;
    writeln!(text, "safe = {:?}", control.safe)?;
    writeln!(text, "disturbance_gain = {:?}", control.disturbance_gain)?;
    if control.observer_gain != 1.0 {
        writeln!(text, "observer_gain = {:?}", control.observer_gain)?;
    }
    writeln!(text, "iterations = {}", control.iterations)?;
    if let Some(budget) = control.budget {
        writeln!(text, "budget = {budget}")?;
    }
    writeln!(
        text,
        "max_missing_samples = {}",
        control.max_missing_samples
    )?;
    if let Some(value) = &control.value {
        writeln!(text, "terminal = \"value\"")?;
        writeln!(text, "\n[control.value]")?;
        writeln!(text, "rows = {}", value.rows)?;
        writeln!(text, "ahead = {}", value.ahead)?;
        writeln!(text, "points = [")?;
        for point in &value.points {
            writeln!(text, "    {point:?},")?;
        }
        writeln!(text, "]")?;
    }
    Ok(())
}

impl From<SignalTable> for Signal {
    fn from(table: SignalTable) -> Self {
        Self {
            name: table.name,
            unit: table.unit,
            span: table.span,
            offset: table.offset,
        }
    }
}

impl From<ControlTable> for ControlSpec {
    fn from(table: ControlTable) -> Self {
        Self {
            horizon: table.horizon,
            control_horizon: table.control_horizon,
            move_blocks: table.move_blocks,
            first_step: table.first_step,
            tracking_weight: table.tracking_weight,
            move_suppression: table.move_suppression,
            command_weight: table.command_weight,
            observer_gain: table.observer_gain,
            lower: table.lower,
            upper: table.upper,
            rate_limit: table.rate_limit,
            safe: table.safe,
            disturbance_gain: table.disturbance_gain,
            iterations: table.iterations,
            budget: table.budget,
            max_missing_samples: table.max_missing_samples,
            value: table.value.map(|value| ValueSpec {
                rows: value.rows,
                ahead: value.ahead,
                points: value.points,
            }),
        }
    }
}
