//! Signals of a file on one base of times.
//!
//! A *base* is a vector of times and the arrays that belong to it. An array belongs to the nearest
//! time above it that is as long as the array. Rows of a table are those of one base. Signals of
//! other bases come in by their last value, or on a straight line between two.

use std::collections::BTreeMap;

use crate::contents::{Array, Contents, MOST_VALUES, parent};
use crate::error::{Error, Result};
use crate::names;

/// Most columns of one recording.
const MOST_COLUMNS: usize = 10_000;

/// Most lines about what is left out.
const MOST_LINES: usize = 40;

/// Rule for signals of another base.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Join {
    /// The last value before or at the row's time.
    #[default]
    Last,
    /// A straight line between the values around the row's time.
    Linear,
}

/// Choice of columns.
#[derive(Clone, Debug, Default)]
pub struct Wanted {
    /// Names of columns and what is in each: a path, or a path and `:` and a number from 1. Empty:
    /// every signal, under its own name.
    pub columns: Vec<(String, String)>,
    /// Path of the times, or of the group or topic that they are in, whose rows are taken. Without
    /// it, the base that most columns belong to.
    pub base: Option<String>,
    /// Rule for the others.
    pub join: Join,
}

/// Signals with common times.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Times in seconds, as the file has them.
    pub t: Vec<f64>,
    /// Names and values; NaN is a missing sample.
    pub columns: Vec<(String, Vec<f64>)>,
    /// Rules that were applied and what was left out, a sentence each.
    pub said: Vec<String>,
}

/// Times and what belongs to them.
#[derive(Clone, Debug, PartialEq)]
pub struct Base {
    /// Path of the times.
    pub path: String,
    /// The times in seconds.
    pub t: Vec<f64>,
    /// Places of the arrays that belong to it in [`Contents::arrays`].
    pub members: Vec<usize>,
    /// Paths of vectors of the same times.
    pub same: Vec<String>,
}

impl Base {
    /// The usual rate, samples a second; `None` for a single sample.
    pub fn rate_hz(&self) -> Option<f64> {
        let mut steps: Vec<f64> = self.t.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let middle = steps.len() / 2;
        if steps.is_empty() {
            return None;
        }
        let (_, step, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
        (*step > 0.0).then(|| 1.0 / *step)
    }

    /// The usual rate in words, behind a comma; empty for a single sample.
    pub fn rate(&self) -> String {
        let rounded = |rate: f64| (rate * 1e4).round() / 1e4;
        self.rate_hz()
            .map_or(String::new(), |rate| format!(", {} Hz", rounded(rate)))
    }

    /// True where `name` is its path or the group that it is in.
    fn is_called(&self, name: &str) -> bool {
        let name = name.trim_end_matches('/');
        let mut paths = std::iter::once(&self.path).chain(&self.same);
        paths.any(|path| path == name || parent(path) == name)
    }

    /// # Errors
    /// Times that are not finite or do not increase.
    fn check(&self) -> Result<()> {
        let bad = (0..self.t.len())
            .find(|&row| !self.t[row].is_finite() || (row > 0 && self.t[row] <= self.t[row - 1]));
        match bad {
            None => Ok(()),
            Some(row) => {
                let before = row.checked_sub(1).map_or(f64::NAN, |row| self.t[row]);
                Err(Error::new(format!(
                    "`{}` does not increase at its value {}: {:?} after {before:?}",
                    self.path,
                    row + 1,
                    self.t[row]
                ))
                .help("split the file where its recorder began again"))
            }
        }
    }
}

/// The bases of a file, each with at least one array; vectors of the same times are one base.
pub fn bases(contents: &Contents) -> Vec<Base> {
    let times: Vec<(usize, usize, f64)> = (contents.arrays.iter().enumerate())
        .filter_map(|(place, array)| {
            array.vector().filter(|values| values.len() > 1)?;
            let last = array.path.rsplit('/').next()?;
            let known = match &array.name {
                Some(name) if name == "t" => Some((0, 1.0)),
                _ => names::time(last),
            };
            let (rank, scale) = known?;
            Some((place, rank, unit_of_time(contents, array).unwrap_or(scale)))
        })
        .collect();
    let is_time = |place: usize| times.iter().any(|(time, ..)| *time == place);
    let mut bases: Vec<Base> = (times.iter())
        .map(|(place, _, scale)| Base {
            path: contents.arrays[*place].path.clone(),
            t: contents.arrays[*place]
                .values
                .iter()
                .map(|t| t * scale)
                .collect(),
            members: Vec::new(),
            same: Vec::new(),
        })
        .collect();
    for (place, array) in contents.arrays.iter().enumerate() {
        if is_time(place) {
            continue;
        }
        if let Some(base) = base_of(contents, array, &times) {
            bases[base].members.push(place);
        }
    }
    bases.retain(|base| !base.members.is_empty());
    let mut merged: Vec<Base> = Vec::new();
    for base in bases {
        match merged.iter_mut().find(|other| other.t == base.t) {
            Some(first) => {
                first.members.extend(base.members);
                first.members.sort_unstable();
                first.same.push(base.path);
            }
            None => merged.push(base),
        }
    }
    merged
}

/// The nearest time above an array that is as long as it: its place among `times`.
fn base_of(contents: &Contents, array: &Array, times: &[(usize, usize, f64)]) -> Option<usize> {
    let mut group = array.group();
    loop {
        let fitting = times.iter().enumerate().filter(|(_, (place, ..))| {
            let time = &contents.arrays[*place];
            time.group() == group && array.signals(time.values.len()) > 0
        });
        if let Some((index, _)) = fitting.min_by_key(|(_, (place, rank, _))| (*rank, *place)) {
            return Some(index);
        }
        if group.is_empty() {
            return None;
        }
        group = parent(group);
    }
}

/// Seconds in the unit of a vector of times, where the file says it.
fn unit_of_time(contents: &Contents, array: &Array) -> Option<f64> {
    let group = array.group();
    let mut said = ["TimeInfo/Units", "timeUnits", "time_unit"].iter();
    let said = said.find_map(|name| contents.text(&format!("{group}/{name}")));
    names::seconds(said.unwrap_or(&array.unit))
}

/// Name of the column of an array, with its unit.
fn column(contents: &Contents, array: &Array) -> String {
    let group = array.group();
    let text_near = |name: &str| contents.text(&format!("{group}/{name}"));
    let said = |text: &&str| !text.trim().is_empty();
    let name = match &array.name {
        Some(name) => names::plain(name),
        // Simulink's structures with time: the label of a signal stands beside its values.
        None => match text_near("label")
            .or_else(|| text_near("Name"))
            .filter(said)
        {
            Some(label) if array.path.to_lowercase().ends_with("/values") => names::plain(label),
            _ => names::of_path(&array.path),
        },
    };
    let unit = match array.unit.as_str() {
        "" => ["DataInfo/Units", "Units", "units", "unit"]
            .iter()
            .find_map(|name| text_near(name)),
        unit => Some(unit),
    };
    names::with_unit(&name, unit.unwrap_or_default())
}

/// Names of the columns of an array on a base of `length` times.
pub fn columns(contents: &Contents, array: &Array, length: usize) -> Vec<String> {
    let name = column(contents, array);
    match array.signals(length) {
        1 => vec![name],
        count => (1..=count).map(|k| names::numbered(&name, k)).collect(),
    }
}

/// One column before its values are taken.
struct Chosen {
    name: String,
    array: usize,
    index: usize,
    base: usize,
}

/// The columns that are wanted, on the rows of one base.
///
/// # Errors
/// No times; a path that is not there, is no signal or has no times; a number that the signal does
/// not have; two columns of one name; times that do not increase.
pub fn table(contents: &Contents, wanted: &Wanted) -> Result<Table> {
    let bases = bases(contents);
    if bases.is_empty() {
        return Err(Error::new("it holds no times with signals beside them").help(
            "times are a vector called t, time, timestamp, stamp or tout, as long as its signals",
        ));
    }
    let chosen = if wanted.columns.is_empty() {
        everything(contents, &bases)?
    } else {
        named(contents, &bases, &wanted.columns)?
    };
    let row_base = match &wanted.base {
        Some(name) => bases
            .iter()
            .position(|base| base.is_called(name))
            .ok_or_else(|| {
                let known: Vec<&str> = bases.iter().map(|base| base.path.as_str()).collect();
                Error::new(format!(
                    "there are no times `{name}`; there are {}",
                    known.join(", ")
                ))
            })?,
        // The last of equals would be found first.
        None => (0..bases.len())
            .rev()
            .max_by_key(|index| chosen.iter().filter(|one| one.base == *index).count())
            .unwrap_or_default(),
    };
    let t = bases[row_base].t.clone();
    let mut said = contents.notes.clone();
    said.push(format!("rows: {} of `{}`", t.len(), bases[row_base].path));
    let mut columns: Vec<(String, Vec<f64>)> = Vec::with_capacity(chosen.len());
    for (index, base) in bases.iter().enumerate() {
        let of_base: Vec<&Chosen> = chosen.iter().filter(|one| one.base == index).collect();
        if of_base.is_empty() {
            continue;
        }
        base.check()?;
        if index != row_base {
            said.push(joined(base, &t, of_base.len(), wanted.join));
        }
    }
    bases[row_base].check()?;
    let mut values_left = MOST_VALUES;
    for one in &chosen {
        let base = &bases[one.base];
        let array = &contents.arrays[one.array];
        let values = array.signal(base.t.len(), one.index).unwrap_or_default();
        values_left = values_left.checked_sub(t.len()).ok_or_else(|| {
            Error::new(format!("more than {} numbers in all columns", MOST_VALUES))
        })?;
        let values = if one.base == row_base {
            values
        } else {
            (t.iter())
                .map(|at| value_at(base, &values, *at, wanted.join))
                .collect()
        };
        columns.push((one.name.clone(), values));
    }
    if wanted.columns.is_empty() {
        said.extend(left_out(contents, &bases));
    }
    Ok(Table { t, columns, said })
}

/// Every signal of every base under its own name; names that meet get their groups before them.
fn everything(contents: &Contents, bases: &[Base]) -> Result<Vec<Chosen>> {
    let mut chosen: Vec<Chosen> = Vec::new();
    for (base, of) in bases.iter().enumerate() {
        for &place in &of.members {
            let array = &contents.arrays[place];
            let names = columns(contents, array, of.t.len());
            for (index, name) in names.into_iter().enumerate() {
                chosen.push(Chosen {
                    name,
                    array: place,
                    index,
                    base,
                });
            }
        }
    }
    if chosen.len() > MOST_COLUMNS {
        let count = chosen.len();
        return Err(Error::new(format!(
            "{count} signals, and a recording has {MOST_COLUMNS} columns at most"
        ))
        .help("choose some with --column"));
    }
    let mut counts = BTreeMap::<String, usize>::new();
    // `t` is the column of times.
    counts.insert("t".into(), 1);
    for one in &chosen {
        *counts.entry(one.name.clone()).or_default() += 1;
    }
    for one in chosen.iter_mut().filter(|one| counts[&one.name] > 1) {
        let groups = names::plain(contents.arrays[one.array].group());
        one.name = format!("{groups}_{}", one.name);
    }
    let mut seen = BTreeMap::<String, usize>::new();
    for one in &mut chosen {
        let count = seen.entry(one.name.clone()).or_default();
        *count += 1;
        if *count > 1 {
            one.name = names::numbered(&one.name, *count);
        }
    }
    Ok(chosen)
}

/// The columns that are asked for.
fn named(contents: &Contents, bases: &[Base], columns: &[(String, String)]) -> Result<Vec<Chosen>> {
    let mut chosen: Vec<Chosen> = Vec::new();
    for (name, path) in columns {
        if name == "t" || chosen.iter().any(|one| one.name == *name) {
            return Err(Error::new(format!("`{name}` cannot name one more column")));
        }
        let (place, index) = find(contents, path)?;
        let array = &contents.arrays[place];
        let Some(base) = bases.iter().position(|base| base.members.contains(&place)) else {
            return Err(Error::new(format!(
                "`{path}` ({} x {}) has no times of its length beside or above it",
                array.rows, array.columns
            )));
        };
        let count = array.signals(bases[base].t.len());
        let index = match index {
            None if count > 1 => {
                return Err(Error::new(format!("`{path}` has {count} signals"))
                    .help(format!("choose one: {name}={path}:1")));
            }
            None => 0,
            Some(index) if (1..=count).contains(&index) => index - 1,
            Some(index) => {
                return Err(Error::new(format!(
                    "`{path}` has {count} signals, not {index}"
                )));
            }
        };
        chosen.push(Chosen {
            name: name.clone(),
            array: place,
            index,
            base,
        });
    }
    Ok(chosen)
}

/// The array at a path, with the number behind `:` where there is one.
fn find(contents: &Contents, path: &str) -> Result<(usize, Option<usize>)> {
    let place_of = |path: &str| {
        // Structures may be written as in MATLAB.
        let slashes = path.replace('.', "/");
        let exact = contents.arrays.iter().position(|array| array.path == path);
        exact.or_else(|| {
            contents
                .arrays
                .iter()
                .position(|array| array.path == slashes)
        })
    };
    if let Some(place) = place_of(path) {
        return Ok((place, None));
    }
    if let Some((path, index)) = path.rsplit_once(':')
        && let (Some(place), Ok(index)) = (place_of(path), index.parse())
    {
        return Ok((place, Some(index)));
    }
    let last = path.rsplit(['/', '.']).next().unwrap_or(path);
    let near = contents
        .arrays
        .iter()
        .filter(|array| array.path.contains(last));
    let near: Vec<&str> = near.map(|array| array.path.as_str()).take(5).collect();
    let error = Error::new(format!("there are no numbers at `{path}`"));
    Err(if near.is_empty() {
        error.help("--list shows what there is")
    } else {
        error.help(format!("there are {}", near.join(", ")))
    })
}

/// The span in which a signal of another base has values, s.
fn span(base: &Base, join: Join) -> (f64, f64) {
    let (first, last) = (base.t[0], base.t[base.t.len() - 1]);
    match join {
        Join::Linear => (first, last),
        // The last value stands for as long as those before it did.
        Join::Last => (first, last + base.rate_hz().map_or(0.0, f64::recip)),
    }
}

/// Value of a signal at a time; NaN before the first and after the last.
fn value_at(base: &Base, values: &[f64], at: f64, join: Join) -> f64 {
    let (first, last) = span(base, join);
    if at < first || at > last {
        return f64::NAN;
    }
    let after = base.t.partition_point(|t| *t <= at);
    let (left, right) = (after - 1, after);
    match join {
        Join::Last => values[left],
        Join::Linear if base.t[left] == at || right == values.len() => values[left],
        Join::Linear => {
            let part = (at - base.t[left]) / (base.t[right] - base.t[left]);
            values[left] + part * (values[right] - values[left])
        }
    }
}

/// The line that says how a base came in.
fn joined(base: &Base, t: &[f64], columns: usize, join: Join) -> String {
    let rule = match join {
        Join::Last => "the last value at each row",
        Join::Linear => "a straight line at each row",
    };
    let rate = base.rate();
    let (first, last) = span(base, join);
    let without = t.iter().filter(|at| **at < first || **at > last).count();
    let plural = if columns == 1 { "" } else { "s" };
    format!(
        "`{}` ({columns} column{plural}{rate}): {rule}; {without} of {} rows without one",
        base.path,
        t.len()
    )
}

/// Arrays without times and contents without numbers.
fn left_out(contents: &Contents, bases: &[Base]) -> Vec<String> {
    let placed = |place: usize| {
        bases
            .iter()
            .any(|base| base.members.contains(&place) || contents.arrays[place].path == base.path)
    };
    let arrays = contents.arrays.iter().enumerate();
    let arrays = arrays
        .filter(|(place, _)| !placed(*place))
        .map(|(_, array)| match (array.rows, array.columns) {
            (1, 1) => format!("left out: `{}` = {:?}", array.path, array.values[0]),
            (rows, columns) => format!(
                "left out: `{}` ({rows} x {columns}) has no times of its length",
                array.path
            ),
        });
    // What gave names and units was of use.
    let used = |path: &str| {
        let last = path.rsplit('/').next().unwrap_or(path).to_lowercase();
        ["units", "unit", "label", "name"].contains(&last.as_str())
    };
    let others = contents.others.iter().filter(|other| !used(&other.path));
    let others = others.map(|other| format!("left out: `{}`: {}", other.path, other.what));
    let mut lines: Vec<String> = arrays.chain(others).collect();
    if lines.len() > MOST_LINES {
        let more = lines.len() - MOST_LINES;
        lines.truncate(MOST_LINES);
        lines.push(format!("left out: {more} more, which --list shows"));
    }
    lines
}
