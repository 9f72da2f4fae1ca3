//! `[control]` of a rig file: the controller that its owner asks for.

use sinew_model::spec::limits::{MAX_BUDGET, MIN_BUDGET};
use sinew_model::spec::{MAX_POINTS, MAX_VALUE_ROWS};
use sinew_sim::effects::Sign;
use sinew_sim::rig::{Reads, TableReader, Tables};
use sinew_sim::{Error, Rig};

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
    /// Most instructions of the optimisation of a step.
    pub budget: Option<u32>,
    /// Indices of the sensors that say the outputs while the device runs; empty: they are measured.
    pub sensed_by: Vec<usize>,
    /// Cost-to-go at the end of the horizon.
    pub terminal: Option<TerminalTable>,
    /// Line of the table, for errors about what it asks.
    pub line: usize,
}

/// Keys of a cost-to-go, `terminal = "value"`; a key that is absent is `None`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TerminalTable {
    /// Rows of the cost-to-go.
    pub rows: Option<usize>,
    /// Rows of the reference behind the horizon that enter.
    pub ahead: Option<usize>,
    /// Most operating points.
    pub points: Option<usize>,
}

/// Longest horizon that a rig may ask for; far beyond what fits a small chip.
const MAX_STEPS: usize = 256;

impl ControlTable {
    /// The table of a rig, if there is one.
    ///
    /// # Errors
    /// The first thing in it that is wrong, with its line and column.
    pub fn read(rig: &Rig) -> Result<Option<Self>, Error> {
        rig.read_tables(|tables| read_control(tables, rig))
    }
}

fn read_control(tables: &Tables, rig: &Rig) -> Result<Option<ControlTable>, Error> {
    let Some(table) = tables.table("control")? else {
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
        "budget",
        "sensed_by",
        "terminal",
        "value_rows",
        "value_ahead",
        "value_points",
    ])?;
    let outputs = read_outputs(tables, &table, rig)?;
    let sensed_by = tables.sensors(&table, "sensed_by")?.unwrap_or_default();
    if sensed_by.iter().any(|sensor| outputs.contains(sensor)) {
        let message =
            "`sensed_by` names an output; expected the sensors that are read in its place";
        return Err(table.error_at("sensed_by", message));
    }
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
    let terminal = read_terminal(&table)?;
    Ok(Some(ControlTable {
        rate_hz: table.number("rate_hz", Sign::Positive)?,
        outputs,
        reference: reference.into_iter().map(|text| text.value).collect(),
        horizon,
        control_horizon,
        tracking_weight,
        move_suppression,
        command_weight: table.number("command_weight", Sign::NonNegative)?,
        budget: read_budget(&table)?,
        sensed_by,
        terminal,
        line: table.own_line(),
    }))
}

/// `budget`, in the range that a model may have.
fn read_budget(table: &TableReader) -> Result<Option<u32>, Error> {
    let (least, most) = (MIN_BUDGET as usize, MAX_BUDGET as usize);
    let budget = table.count("budget", least, most)?;
    Ok(budget.and_then(|budget| u32::try_from(budget).ok()))
}

/// `terminal` and the keys that it has; they are refused without it.
fn read_terminal(table: &TableReader) -> Result<Option<TerminalTable>, Error> {
    let terminal = table.word("terminal", &[("value", ())])?;
    let keys = TerminalTable {
        rows: table.count("value_rows", 1, MAX_VALUE_ROWS)?,
        ahead: table.count("value_ahead", 0, MAX_STEPS)?,
        points: table.count("value_points", 1, MAX_POINTS)?,
    };
    if terminal.is_some() {
        return Ok(Some(keys));
    }
    let given = ["value_rows", "value_ahead", "value_points"];
    match given.iter().find(|key| table.has(key)) {
        Some(key) => Err(table.error_at(
            key,
            format!(
                "`{key}` of [control] is for a cost-to-go; expected `terminal = \"value\"` beside it"
            ),
        )),
        None => Ok(None),
    }
}

fn expect_length(
    table: &TableReader,
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

fn read_outputs(tables: &Tables, table: &TableReader, rig: &Rig) -> Result<Vec<usize>, Error> {
    if let Some(outputs) = tables.sensors(table, "outputs")? {
        return Ok(outputs);
    }
    let reads_position = |index: &usize| matches!(rig.sensors[*index].reads, Reads::Position(_));
    Ok((0..rig.sensors.len()).filter(reads_position).collect())
}
