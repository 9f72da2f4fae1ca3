//! Writing a rig back: the user's file, comments and layout included, with other numbers in it.

use super::{Place, Rig};
use crate::error::Error;
use crate::plant::parameters;
use crate::suggest;
use toml_edit::{Decor, DocumentMut, InlineTable, Item, TableLike, Value};

impl Rig {
    /// The rig as a file: its own text.
    pub fn to_toml(&self) -> &str {
        &self.text
    }

    /// The same rig with other parameter values, by name (`carriage.inertia`). A parameter that the
    /// file leaves to its default is written into its table; one that is `{ value, ... }` stays
    /// free and keeps its bounds.
    ///
    /// # Errors
    /// A name that the rig does not have, or a value that a rig file could not hold (not finite,
    /// wrong sign, outside the parameter's own bounds).
    pub fn with_values(&self, values: &[(&str, f64)]) -> Result<Self, Error> {
        let slots = parameters(self);
        let mut document: DocumentMut = self.text.parse().map_err(|_| self.unwritable("itself"))?;
        for &(name, value) in values {
            let (_, place) = slots
                .iter()
                .find(|(parameter, _)| parameter.name == name)
                .ok_or_else(|| {
                    let names: Vec<&str> = slots.iter().map(|(p, _)| p.name.as_str()).collect();
                    Error {
                        file: self.file.clone(),
                        line: None,
                        column: None,
                        message: format!("the rig has no parameter `{name}`"),
                        help: Some(suggest::help(name, "parameters", &names)),
                    }
                })?;
            replace(&mut document, place, value).ok_or_else(|| self.unwritable(name))?;
        }
        Self::parse(&document.to_string(), &self.file)
    }

    /// The same rig with a comment line above each of these parameters, by name:
    /// `# NAME MARKER TEXT`. An earlier line of the same name and marker is replaced.
    ///
    /// # Errors
    /// A name that the rig does not have, or whose number the file leaves to its default.
    pub fn with_comments(&self, marker: &str, comments: &[(&str, &str)]) -> Result<Self, Error> {
        let slots = parameters(self);
        let mut document: DocumentMut = self.text.parse().map_err(|_| self.unwritable("itself"))?;
        for &(name, text) in comments {
            let place = slots.iter().find(|(parameter, _)| parameter.name == name);
            let place = place.map(|(_, place)| place);
            let start = format!("# {name} {marker}");
            place
                .and_then(|place| comment(&mut document, place, &start, text))
                .ok_or_else(|| self.unwritable(name))?;
        }
        Self::parse(&document.to_string(), &self.file)
    }

    /// A place that the reader found and the writer does not: cannot happen, and is no reason to
    /// stop a program either.
    fn unwritable(&self, name: &str) -> Error {
        Error {
            file: self.file.clone(),
            line: None,
            column: None,
            message: format!("cannot write `{name}` into this file"),
            help: None,
        }
    }
}

/// Puts a number where a parameter stands, keeping the white space and comments around it.
fn replace(document: &mut DocumentMut, place: &Place, value: f64) -> Option<()> {
    let mut table = element(document.as_table_mut().get_mut(place.table)?, place.index)?;
    if let Some((array, index)) = place.within {
        table = element(table.get_mut(array)?, index)?;
    }
    match table.get_mut(&place.key) {
        None => {
            table.insert(&place.key, toml_edit::value(value));
        }
        Some(item) => {
            if place.slope {
                return set_slope(item.as_table_like_mut()?, value);
            }
            let number = match item.as_table_like_mut() {
                Some(inner) => inner.get_mut("value")?,
                None => item,
            };
            set(number, value)?;
        }
    }
    Some(())
}

/// Puts a comment line above the line of a parameter, in the place of one that starts alike.
fn comment(document: &mut DocumentMut, place: &Place, start: &str, text: &str) -> Option<()> {
    let top = document.as_table_mut();
    if top.get(place.table)?.is_value() {
        // A table inside a line has no room for one.
        put_line(top.key_mut(place.table)?.leaf_decor_mut(), start, text);
        return Some(());
    }
    let table = element(top.get_mut(place.table)?, place.index)?;
    let key = place.within.map_or(place.key.as_str(), |(array, _)| array);
    match table.get_mut(key)?.as_table_mut() {
        // `stiffness.value = 1.0`: what stands in front of the line is with its last key.
        Some(own) if own.is_dotted() => {
            let (mut first, _) = own.iter_mut().next()?;
            put_line(first.leaf_decor_mut(), start, text);
        }
        Some(own) => put_line(own.decor_mut(), start, text),
        None => put_line(table.key_mut(key)?.leaf_decor_mut(), start, text),
    }
    Some(())
}

/// Puts a comment line in front of a key, below those that are there.
fn put_line(decor: &mut Decor, start: &str, text: &str) {
    let before = decor.prefix().and_then(|prefix| prefix.as_str());
    let before = before.unwrap_or_default();
    let lines = before.split_inclusive('\n');
    let kept: String = lines
        .filter(|line| !line.trim_start().starts_with(start))
        .collect();
    // White space in front of the key in its own line stays there.
    let (lines, indent) = kept.split_at(kept.rfind('\n').map_or(0, |end| end + 1));
    decor.set_prefix(format!("{lines}{indent}{start} {text}\n{indent}"));
}

/// Puts the slope of a parameter into its table; one that is not written is free.
fn set_slope(parameter: &mut dyn TableLike, value: f64) -> Option<()> {
    match parameter.get_mut("slope") {
        None => {
            let mut free = InlineTable::new();
            free.insert("value", Value::from(value));
            parameter.insert("slope", toml_edit::value(free));
            Some(())
        }
        Some(item) => match item.as_table_like_mut() {
            Some(inner) => set(inner.get_mut("value")?, value),
            None => set(item, value),
        },
    }
}

fn element(item: &mut Item, index: usize) -> Option<&mut dyn TableLike> {
    match item {
        Item::ArrayOfTables(array) => Some(array.get_mut(index)? as &mut dyn TableLike),
        Item::Value(Value::Array(array)) => {
            Some(array.get_mut(index)?.as_inline_table_mut()? as &mut dyn TableLike)
        }
        _ => None,
    }
}

fn set(item: &mut Item, value: f64) -> Option<()> {
    let old = item.as_value_mut()?;
    let decor = old.decor().clone();
    *old = Value::from(value);
    *old.decor_mut() = decor;
    Some(())
}
