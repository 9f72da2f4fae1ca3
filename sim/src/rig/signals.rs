//! Columns of the recording that parameters depend on: the `[[signal]]` tables of a rig, and `with`
//! and `slope` in a parameter's own table.

use super::column::read_factor;
use super::reader::TableReader;
use super::{Dependence, Rig, Signal, Value};
use crate::effects::{Family, Sign};
use crate::error::Error;

/// Every `[[signal]]`, in file order.
pub(super) fn read_signals(tables: &[TableReader]) -> Result<Vec<Signal>, Error> {
    let mut signals: Vec<Signal> = Vec::new();
    for table in tables {
        table.allow(&["name", "column", "unit", "lag"])?;
        let name = table.text("name")?;
        if signals.iter().any(|known| known.name == name.value) {
            let message = format!("a signal `{}` is there twice", name.value);
            return Err(table.error_at("name", message));
        }
        signals.push(Signal {
            name: name.value.to_owned(),
            column: table.text("column")?.value.to_owned(),
            lag: table.optional_parameter("lag", Sign::NonNegative)?,
            column_factor: read_factor(table)?,
            line: table.line("column"),
        });
    }
    Ok(signals)
}

/// Tables whose numbers may depend on a column.
const DEPENDING: &[&str] = &[
    "spring", "damper", "gravity", "tendon", "actuator", "effect",
];

impl<'a> TableReader<'a> {
    /// The dependence of the parameter `key` of this table, read from the parameter's own table.
    pub(super) fn dependence(
        &self,
        key: &str,
        own: &TableReader<'a>,
    ) -> Result<Option<Box<Dependence>>, Error> {
        let Some(signal) = own.optional_text("with")? else {
            return if own.has("slope") {
                Err(own
                    .error_at("slope", format!("`slope` of {} without `with`", own.what))
                    .helped("`with = \"COLUMN\"` says what it is the slope by"))
            } else {
                Ok(None)
            };
        };
        if !DEPENDING.contains(&self.array) || self.within.is_some() {
            let message = format!("{} cannot depend on a column", own.what);
            return Err(own.error_at("with", message).helped(
                "numbers of springs, dampers, weights, tendons, actuators and effects can; an \
                 inertia, a start, an arm and a sensor's numbers cannot",
            ));
        }
        let slope = own.optional_parameter("slope", Sign::Any)?;
        let mut slope = slope.unwrap_or_else(|| Value {
            free: true,
            ..own.held("slope", 0.0)
        });
        slope.place = super::Place {
            slope: true,
            ..self.place(key)
        };
        Ok(Some(Box::new(Dependence {
            signal: signal.value.to_owned(),
            slope,
            line: own.line("with"),
        })))
    }

    /// Refuses a dependence of numbers that say when or where an effect acts on an input or a
    /// reading, or how heavy a hidden coordinate is: they are taken once, not at every row.
    pub(super) fn refuse_dependence(&self, family: Family, values: &[Value]) -> Result<(), Error> {
        let fixed = matches!(family, Family::Actuator | Family::Sensor | Family::Mode);
        let depending = values.iter().find(|value| value.with.is_some());
        match depending.filter(|_| fixed) {
            None => Ok(()),
            Some(value) => {
                let key = &value.place.key;
                let message = format!("`{key}` of {} cannot depend on a column", self.what);
                Err(self
                    .error_at(key, message)
                    .helped("frictions, dampings, stiffnesses, loads, gaps and memories can"))
            }
        }
    }
}

impl Rig {
    /// Signals that the rig declares, then columns that only a `with` names; each once.
    pub(crate) fn dependences(&self) -> Vec<Signal> {
        let mut all = self.signals.clone();
        for with in self.depending().filter_map(|value| value.with.as_ref()) {
            if self.signal_index(&all, &with.signal).is_none() {
                all.push(Signal {
                    name: with.signal.clone(),
                    column: with.signal.clone(),
                    lag: None,
                    column_factor: 1.0,
                    line: with.line,
                });
            }
        }
        all
    }

    /// The signal of that name among these, or that of that column.
    pub(crate) fn signal_index(&self, signals: &[Signal], name: &str) -> Option<usize> {
        let named = signals.iter().position(|signal| signal.name == name);
        named.or_else(|| signals.iter().position(|signal| signal.column == name))
    }

    /// Every number of the tables that may depend on a column.
    fn depending(&self) -> impl Iterator<Item = &Value> {
        let springs = self.springs.iter().flat_map(|s| [&s.stiffness, &s.rest]);
        let dampers = self.dampers.iter().map(|damper| &damper.damping);
        let gravities = self.gravities.iter().flat_map(|g| [&g.amplitude, &g.zero]);
        let tendons = (self.tendons.iter()).flat_map(|t| [&t.stiffness, &t.damping, &t.pretension]);
        let actuators = self.actuators.iter().map(|actuator| &actuator.gain);
        let effects = self.effects.iter().flat_map(|effect| &effect.parameters);
        springs
            .chain(dampers)
            .chain(gravities)
            .chain(tendons)
            .chain(actuators)
            .chain(effects)
    }
}
