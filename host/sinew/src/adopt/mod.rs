//! Numbers that a device has learned, taken back into its rig.
//!
//! The filter of a model with a state estimates parameters while it controls
//! (docs/explanation/controller.md, section 9). The device tells them with their variances, and
//! recordings have them as [`Columns`]. [`adopt`] puts the last ones of a recording into the rig.

mod columns;

pub use columns::{Columns, recorded};

use std::path::Path;

use sinew_ident::error::{Error, Result};
use sinew_ident::recording::Recording;
use sinew_ident::report::{exact, quantity};
use sinew_model::spec::{ModelSpec, Parameter};
use sinew_sim::{Plant, Rig};

/// Largest part of a parameter's variance that may be left of the prior's. Where more is left, the
/// estimate is more the model's than the device's.
const MOST_LEFT: f64 = 0.5;
/// Distance from a bound, in the prior's standard deviations, below which an estimate sits on it.
const AT_BOUND: f64 = 1e-3;
/// Standard deviations of a two-sided interval of 95 %.
const REACH: f64 = 1.96;
/// Mark of the comments that tell where a number comes from, after the parameter's name.
const PROVENANCE: &str = "as the device learned it:";

/// One parameter that the device has learned.
#[derive(Clone, Debug, PartialEq)]
pub struct Learned {
    /// Name in the rig.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Value in the rig before.
    pub before: f64,
    /// Value that was learned.
    pub value: f64,
    /// Interval of 95 %.
    pub interval: [f64; 2],
}

/// Recording with what a device learned, and the text that it was read from.
#[derive(Debug)]
pub struct Source<'a> {
    /// The recording, with the columns of [`Columns`].
    pub recording: &'a Recording,
    /// Its text: the comments name the model.
    pub text: &'a str,
    /// Folder of the model, for errors.
    pub model: &'a Path,
}

/// The rig with the numbers that the device learned last; with names in `only`, those alone.
///
/// # Errors
/// A model without parameters, a recording of another model or without an estimate, a name that
/// is none of the model's. One error names all parameters that are not to be adopted: the motion
/// did not show them, the estimate sits at its bound, or the rig has them as known numbers.
pub fn adopt(
    rig: &Rig,
    spec: &ModelSpec,
    source: &Source<'_>,
    only: &[String],
) -> Result<(Rig, Vec<Learned>)> {
    let columns = Columns::of(spec);
    let wanted = wanted(&columns, source, only)?;
    is_of(&columns, source)?;
    let row = last_row(&columns, source.recording)?;
    let plant = Plant::new(rig)?;
    let values = plant.values();
    let free = plant.free_slots();
    let (mut found, mut refused) = (Vec::new(), Vec::new());
    let mut shown = true;
    for parameter in wanted {
        let name = parameter.name.as_str();
        let slots = plant.parameters();
        let Some(slot) = slots.iter().position(|it| it.name == name) else {
            refused.push(format!("{name} is no parameter of {}", rig.file));
            continue;
        };
        let known = Estimate::read(parameter, source.recording, row)?;
        let unit = &slots[slot].unit;
        if let Some(reason) = known.at_bound(parameter, unit) {
            refused.push(reason);
        } else if let Some(reason) = known.not_shown(parameter, unit) {
            shown = false;
            refused.push(reason);
        } else if !free.contains(&slot) {
            refused.push(format!("{name} is a bare number in {}: known", rig.file));
        } else {
            let half = REACH * known.deviation;
            found.push(Learned {
                name: name.into(),
                unit: unit.clone(),
                before: values[slot],
                value: known.value,
                interval: [known.value - half, known.value + half],
            });
        }
    }
    if !refused.is_empty() {
        let rest: Vec<String> = found
            .iter()
            .map(|it| format!("--only {}", it.name))
            .collect();
        let error = Error::file(source.recording.path(), refused.join("; "));
        return Err(if !rest.is_empty() {
            error.help(format!("to adopt the rest: {}", rest.join(" ")))
        } else if shown {
            error
        } else {
            error.help("record a motion that shows it")
        });
    }
    let (file, model) = (source.recording.name(), columns.model_line());
    let comments: Vec<(String, String)> = found
        .iter()
        .map(|it| (it.name.clone(), provenance(it, &file, &model)))
        .collect();
    let values: Vec<(&str, f64)> = found
        .iter()
        .map(|it| (it.name.as_str(), it.value))
        .collect();
    let comments: Vec<(&str, &str)> = comments
        .iter()
        .map(|(name, text)| (name.as_str(), text.as_str()))
        .collect();
    let adopted = rig
        .with_values(&values)?
        .with_comments(PROVENANCE, &comments)?;
    Ok((adopted, found))
}

/// Comment of a number: interval, recording, model, and the number before.
fn provenance(learned: &Learned, file: &str, model: &str) -> String {
    let [low, high] = learned.interval.map(|end| quantity(end, &learned.unit));
    // A line break in a file's name would end the comment.
    let file = file.replace(char::is_control, "?");
    format!(
        "95 % from {low} to {high}, by {file}, {}; before {}",
        model.trim_start_matches(['#', ' ']),
        exact(learned.before)
    )
}

/// Parameters of the model, or those in `only`.
fn wanted<'a>(
    columns: &'a Columns,
    source: &Source<'_>,
    only: &[String],
) -> Result<Vec<&'a Parameter>> {
    let all = columns.parameters();
    if all.is_empty() {
        return Err(Error::file(
            source.model,
            "this model estimates no parameter while it runs",
        )
        .expected("one with a state: `form = \"state\"` of [network]"));
    }
    let names: Vec<&str> = all.iter().map(|it| it.name.as_str()).collect();
    if let Some(name) = only.iter().find(|name| !names.contains(&name.as_str())) {
        return Err(Error::arguments(format!(
            "--only {name}: the model estimates no parameter of that name"
        ))
        .expected(names.join(", ")));
    }
    let asked = |it: &&Parameter| only.is_empty() || only.contains(&it.name);
    Ok(all.iter().filter(asked).collect())
}

/// Refuses a recording of another model.
fn is_of(columns: &Columns, source: &Source<'_>) -> Result<()> {
    let wanted = columns.model_line();
    let wanted = columns::model_of(&wanted).unwrap_or_default();
    let file = source.recording.path();
    match columns::model_of(source.text) {
        Some(said) if said == wanted => Ok(()),
        Some(said) => Err(
            Error::file(file, format!("the device carried model {said}")).expected(format!(
                "model {wanted}, that of {}",
                source.model.display()
            )),
        ),
        None => Err(
            Error::file(file, "the file does not say which model the device carried")
                .expected("a recording of `sinew record`, `sinew monitor` or `sinew pil`"),
        ),
    }
}

/// Last row with an estimate of every parameter.
fn last_row(columns: &Columns, recording: &Recording) -> Result<usize> {
    let names = columns.names();
    let all = names.map(|name| recording.require(&name, "sinew adopt"));
    let all = all.collect::<Result<Vec<&[f64]>>>()?;
    let whole = |row: &usize| all.iter().all(|column| column[*row].is_finite());
    (0..recording.len()).rev().find(whole).ok_or_else(|| {
        Error::file(recording.path(), "the device told no estimate in this file")
            .help("record for a second or more")
    })
}

/// Estimate of one parameter, SI.
struct Estimate {
    value: f64,
    deviation: f64,
}

impl Estimate {
    fn read(parameter: &Parameter, recording: &Recording, row: usize) -> Result<Self> {
        let at = |name: String| recording.require(&name, "sinew adopt");
        Ok(Self {
            value: at(columns::estimate(&parameter.name))?[row],
            deviation: at(columns::deviation(&parameter.name))?[row],
        })
    }

    /// Reason against an estimate that a bound of the model holds.
    fn at_bound(&self, parameter: &Parameter, unit: &str) -> Option<String> {
        let theta = (self.value - parameter.value) / (parameter.value * parameter.spread);
        let bounds = [parameter.lower, parameter.upper];
        let held = bounds.iter().any(|bound| (theta - bound).abs() < AT_BOUND);
        held.then(|| {
            format!(
                "{} sits at its bound, {}: the device is further from the usual one than the model \
                 was trained for",
                parameter.name,
                quantity(self.value, unit)
            )
        })
    }

    /// Reason against an estimate that the device's motion has hardly moved.
    fn not_shown(&self, parameter: &Parameter, unit: &str) -> Option<String> {
        let part = self.deviation / (parameter.value * parameter.spread).abs();
        (part * part > MOST_LEFT).then(|| {
            format!(
                "{} was not shown by this motion: its deviation is {}, {:.0} % of the one before \
                 any reading",
                parameter.name,
                quantity(self.deviation, unit),
                100.0 * part
            )
        })
    }
}

#[cfg(test)]
pub(crate) use columns::tests as examples;
#[cfg(test)]
mod tests;
