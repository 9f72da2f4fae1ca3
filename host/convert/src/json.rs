//! JSON: lists of records of numbers, and objects of lists. BAM's logs are the former, with names
//! whose units are known.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::contents::Contents;
use crate::error::{Error, Result};

/// Largest file, bytes: a number takes some ten times its text.
const MOST_BYTES: usize = 1 << 28;

/// Names of BAM's entries (github.com/Rhoban/bam), the columns that they become, and units.
const BAM: [(&str, &str, &str); 8] = [
    ("timestamp", "t", "s"),
    ("position", "q", "rad"),
    ("speed", "qd", "rad/s"),
    ("goal_position", "qgoal", "rad"),
    ("load", "load", ""),
    ("input_volts", "supply", "V"),
    ("temp", "temp", "degC"),
    ("torque_enable", "torque_on", ""),
];

/// # Errors
/// Text that is no JSON, or a file that is too large.
pub fn read(bytes: &[u8]) -> Result<Contents> {
    if bytes.len() > MOST_BYTES {
        return Err(Error::new(format!(
            "more than {MOST_BYTES} bytes, the most that is read of JSON"
        )));
    }
    let value: Value = serde_json::from_slice(bytes)
        .map_err(|error| Error::new(format!("it is no JSON: {error}")))?;
    let mut contents = Contents::default();
    let bam = is_bam(&value);
    place("", &value, &mut contents, bam)?;
    if bam {
        contents
            .notes
            .push("names and units are those of BAM's logs".into());
        let step = value.get("dt").and_then(Value::as_f64);
        let rows = contents
            .arrays
            .iter()
            .find(|array| array.path == "entries/position");
        let rows = rows.map_or(0, |array| array.rows);
        if let Some(step) = step.filter(|_| value["entries"][0].get("timestamp").is_none()) {
            contents.count(rows)?;
            let t = (0..rows).map(|row| row as f64 * step).collect();
            contents.push("entries/t", &[rows], t)?;
            contents
                .notes
                .push(format!("times are rows times `dt`, {step} s"));
        }
    }
    Ok(contents)
}

/// A list `entries` of records with a position and a goal.
fn is_bam(value: &Value) -> bool {
    let first = value.get("entries").and_then(|entries| entries.get(0));
    first.is_some_and(|first| {
        first.get("position").is_some() && first.get("goal_position").is_some()
    })
}

fn place(path: &str, value: &Value, contents: &mut Contents, bam: bool) -> Result<()> {
    let below = |name: &str| match path {
        "" => name.to_owned(),
        _ => format!("{path}/{name}"),
    };
    match value {
        Value::Object(fields) => {
            for (name, value) in fields {
                place(&below(name), value, contents, bam)?;
            }
            Ok(())
        }
        Value::Array(list) if list.iter().any(Value::is_object) => {
            records(path, list, contents, bam)
        }
        Value::Array(list) => numbers(path, list, contents),
        Value::String(text) => {
            contents.text_at(path, text);
            Ok(())
        }
        Value::Null => Ok(()),
        Value::Bool(_) | Value::Number(_) => match number(value) {
            Some(number) => contents.push(path, &[1], vec![number]),
            None => Ok(()),
        },
    }
}

/// A number, or 0 and 1 for the two truths; null is a missing sample.
fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Null => Some(f64::NAN),
        Value::Bool(truth) => Some(f64::from(u8::from(*truth))),
        _ => value.as_f64(),
    }
}

fn numbers(path: &str, list: &[Value], contents: &mut Contents) -> Result<()> {
    let plain: Option<Vec<f64>> = list.iter().map(number).collect();
    if let Some(values) = plain {
        return contents.push(path, &[values.len()], values);
    }
    // Rows of equal length are a matrix.
    let rows: Option<Vec<Vec<f64>>> = (list.iter())
        .map(|row| row.as_array()?.iter().map(number).collect())
        .collect();
    match rows {
        Some(rows) if rows.iter().all(|row| row.len() == rows[0].len()) => {
            let width = rows[0].len();
            let column = |index: usize| rows.iter().map(move |row| row[index]);
            let values = (0..width).flat_map(column).collect();
            contents.push(path, &[rows.len(), width], values)
        }
        _ => {
            contents.other(
                path,
                format!("a list of {} values of other kinds", list.len()),
            );
            Ok(())
        }
    }
}

/// Records become signals: one for each name that holds numbers.
fn records(path: &str, list: &[Value], contents: &mut Contents, bam: bool) -> Result<()> {
    let mut signals: BTreeMap<&str, Vec<(usize, f64)>> = BTreeMap::new();
    let mut order: Vec<&str> = Vec::new();
    let mut odd: BTreeMap<&str, usize> = BTreeMap::new();
    let mut nameless = 0;
    for (row, record) in list.iter().enumerate() {
        let Some(fields) = record.as_object() else {
            nameless += 1;
            continue;
        };
        for (name, value) in fields {
            match number(value) {
                Some(value) => {
                    let values = signals.entry(name).or_insert_with(|| {
                        order.push(name);
                        Vec::new()
                    });
                    values.push((row, value));
                }
                None => *odd.entry(name).or_default() += 1,
            }
        }
    }
    if nameless > 0 {
        return Err(Error::new(format!(
            "`{path}`: {nameless} of {} entries are no records",
            list.len()
        )));
    }
    for (name, count) in odd {
        contents.other(
            &format!("{path}/{name}"),
            format!("{count} values that are no numbers"),
        );
    }
    for name in order {
        contents.count(list.len())?;
        let mut values = vec![f64::NAN; list.len()];
        for (row, value) in &signals[name] {
            values[*row] = *value;
        }
        let place = match path {
            "" => name.to_owned(),
            _ => format!("{path}/{name}"),
        };
        contents.push(&place, &[list.len()], values)?;
        let known = BAM.iter().find(|(theirs, ..)| *theirs == name);
        if let (true, Some((_, ours, unit)), Some(array)) = (bam, known, contents.arrays.last_mut())
        {
            array.name = Some((*ours).to_owned());
            array.unit = (*unit).to_owned();
        }
    }
    Ok(())
}
