//! Recordings: what a device did, as CSV (docs/reference/recording.md).
//!
//! ```text
//! # anything after a # is a comment
//! t,u_V,q_m
//! 0.000,0.5,0.0012
//! 0.001,0.5,          <- nothing, or nan: a missing sample
//! ```
//! The first column is `t` in seconds and strictly increasing, not necessarily uniform; every other
//! column is one signal with its unit at the end of its name. Nothing is resampled and nothing is
//! dropped in silence: what cannot be used is an error with file, line and column.

#[cfg(feature = "logs")]
pub mod foreign;
mod read;
pub mod repair;
mod si;
mod write;

use std::path::{Path, PathBuf};

use sinew_sim::suggest::nearest;

use crate::error::{Error, Result};

/// One signal of a recording.
#[derive(Debug, Clone)]
pub struct Column {
    /// Its name in the header, such as `q_m`.
    pub name: String,
    /// One value a row; NaN is a missing sample.
    pub values: Vec<f64>,
}

/// A recording in memory.
///
/// ```
/// # use sinew_ident::recording::Recording;
/// let recording = Recording::parse(b"t,u_V,q_m\n0,1,0.1\n0.5,1,\n", "a.csv")?;
/// assert_eq!(recording.t(), [0.0, 0.5]);
/// assert_eq!(recording.require("u_V", "the rig's actuator `drive`")?, [1.0, 1.0]);
///
/// let error = Recording::parse(b"t,q_m\n0,1\n0,2\n", "a.csv").unwrap_err();
/// assert!(error.to_string().starts_with("a.csv:3:1: time does not increase"));
/// # Ok::<(), sinew_ident::error::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Recording {
    path: PathBuf,
    header_line: usize,
    /// Line of each row in the file.
    lines: Vec<usize>,
    t: Vec<f64>,
    columns: Vec<Column>,
    notes: Vec<String>,
}

/// A column with its gaps closed by holding the last value, as an actuator would.
///
/// ```
/// use sinew_ident::recording::Recording;
///
/// let recording = Recording::parse(b"t,u_N\n0,1\n0.1,\n0.2,3\n", "a.csv")?;
/// let held = recording.held("u_N", "this example")?;
/// assert_eq!((held.values, held.missing), (vec![1.0, 1.0, 3.0], 1));
/// # Ok::<(), sinew_ident::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// One finite value a row.
    pub values: Vec<f64>,
    /// Number of missing samples, for the report.
    pub missing: usize,
}

impl Recording {
    /// Reads a CSV file. With the feature `logs` it also reads a log of another program whose
    /// signals all have the same times (docs/reference/logs.md).
    ///
    /// # Errors
    /// `Read` where the file cannot be opened; `File`, with line and column, for text in a number,
    /// an infinite number, time that is missing or does not increase, a row with too few or too
    /// many fields, no header, no rows, a column named twice or not at all; `File` also for a log
    /// that is broken, or whose signals have several bases of times.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        #[cfg(feature = "logs")]
        foreign::refuse_huge(path)?;
        let bytes = std::fs::read(path).map_err(|source| Error::read(path, source))?;
        #[cfg(feature = "logs")]
        if let Some(format) = foreign::format(&bytes, path) {
            return foreign::direct(&bytes, format, path);
        }
        #[cfg(not(feature = "logs"))]
        if let Some("mat" | "h5" | "hdf5" | "mcap" | "json") =
            path.extension().and_then(std::ffi::OsStr::to_str)
        {
            let error = Error::file(path, "it is a log, and this program reads CSV alone");
            return Err(error.help("build sinew-ident with its feature `logs`"));
        }
        Self::parse(&bytes, path)
    }

    /// Rules by which a log of another program became a recording, and what was left out of it, a
    /// sentence each; empty for CSV.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Reads CSV that is in memory already; `path` is what errors call it.
    ///
    /// # Errors
    /// As [`Recording::read`], less `Read`.
    pub fn parse(bytes: &[u8], path: impl AsRef<Path>) -> Result<Self> {
        read::parse(bytes, path.as_ref(), read::Rows::Timed)
    }

    /// Reads a table of rests: a CSV file whose rows stand for themselves, without times. `t`
    /// counts them from 0; a column of that name is left out.
    ///
    /// # Errors
    /// As [`Recording::read`], less those of times.
    pub fn read_table(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|source| Error::read(path, source))?;
        Self::parse_table(&bytes, path)
    }

    /// A table as [`Recording::read_table`], in memory already; `path` is what errors call it.
    ///
    /// # Errors
    /// As [`Recording::read_table`], less `Read`.
    pub fn parse_table(bytes: &[u8], path: impl AsRef<Path>) -> Result<Self> {
        read::parse(bytes, path.as_ref(), read::Rows::Untimed)
    }

    /// A recording from values, such as a simulation's.
    ///
    /// # Errors
    /// `File`, naming `path`, where time is not finite or does not increase, a column's length
    /// differs from that of `t`, a value is infinite, or a name is empty, doubled or `t`.
    pub fn new(path: impl AsRef<Path>, t: Vec<f64>, columns: Vec<Column>) -> Result<Self> {
        let path = path.as_ref();
        if t.is_empty() {
            return Err(Error::file(path, "a recording needs at least one row"));
        }
        if let Some(row) =
            (0..t.len()).find(|&row| !t[row].is_finite() || (row > 0 && t[row] <= t[row - 1]))
        {
            return Err(Error::file(
                path,
                format!("time does not increase at row {row}"),
            ));
        }
        for (index, column) in columns.iter().enumerate() {
            let unnamed =
                column.name.is_empty() || column.name == "t" || column.name.contains(['\n', '\r']);
            if unnamed
                || columns[..index]
                    .iter()
                    .any(|other| other.name == column.name)
            {
                return Err(Error::file(
                    path,
                    format!("`{}` cannot name one more column", column.name),
                ));
            }
            if column.values.len() != t.len() {
                let (found, wanted) = (column.values.len(), t.len());
                return Err(Error::file(
                    path,
                    format!("`{}` has {found} values for {wanted} rows", column.name),
                ));
            }
            if column.values.iter().any(|value| value.is_infinite()) {
                return Err(Error::file(
                    path,
                    format!("`{}` holds an infinite value", column.name),
                ));
            }
        }
        Ok(Self {
            path: path.to_path_buf(),
            header_line: 1,
            lines: (2..t.len() + 2).collect(),
            t,
            columns,
            notes: Vec::new(),
        })
    }

    /// Writes the recording as CSV, whole or not at all. Reading it back gives the same bits.
    ///
    /// # Errors
    /// `Write`.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        Ok(sinew_files::write(path, self.to_csv())?)
    }

    /// The CSV text.
    pub fn to_csv(&self) -> String {
        write::to_csv(self)
    }

    /// File of the recording.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file's name, for reports.
    pub fn name(&self) -> String {
        self.path.file_name().map_or_else(
            || self.path.display().to_string(),
            |name| name.to_string_lossy().into(),
        )
    }

    /// Times of the rows in seconds, strictly increasing.
    pub fn t(&self) -> &[f64] {
        &self.t
    }

    /// Number of rows, at least 1.
    #[allow(
        clippy::len_without_is_empty,
        reason = "a recording without rows cannot be made"
    )]
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Line of the column names in the file, from 1.
    pub fn header_line(&self) -> usize {
        self.header_line
    }

    /// Line of a row in the file, from 1; rows count from 0.
    ///
    /// # Panics
    /// A `row` that is not below [`Recording::len`].
    pub fn line(&self, row: usize) -> usize {
        self.lines[row]
    }

    /// Seconds from the first row to the last.
    pub fn duration(&self) -> f64 {
        self.t[self.t.len() - 1] - self.t[0]
    }

    /// The usual time between two rows in seconds (the median); `None` for a single row.
    pub fn interval(&self) -> Option<f64> {
        let mut steps: Vec<f64> = self.t.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if steps.is_empty() {
            return None;
        }
        let middle = steps.len() / 2;
        Some(*steps.select_nth_unstable_by(middle, f64::total_cmp).1)
    }

    /// All columns but `t`, in the file's order.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Values of a column, to be changed.
    ///
    /// # Errors
    /// As [`Recording::require`].
    pub(crate) fn values_mut(&mut self, name: &str) -> Result<&mut Vec<f64>> {
        self.require(name, "a repair")?;
        let mut named = self.columns.iter_mut().filter(|column| column.name == name);
        let absent = || Error::arguments(format!("{name}: no such column"));
        named
            .next()
            .map(|column| &mut column.values)
            .ok_or_else(absent)
    }

    /// The values of a column, NaN where missing.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns
            .iter()
            .find(|column| column.name == name)
            .map(|column| column.values.as_slice())
    }

    /// The values of a column that something needs: `wanted_by` says what, for the error.
    ///
    /// # Errors
    /// `File` with the header's line where there is no such column; the nearest name is suggested.
    pub fn require(&self, name: &str, wanted_by: &str) -> Result<&[f64]> {
        self.column(name).ok_or_else(|| {
            let names = || self.columns.iter().map(|column| column.name.as_str());
            let listed = names()
                .map(|name| format!("`{name}`"))
                .collect::<Vec<_>>()
                .join(", ");
            let error = Error::file(
                &self.path,
                format!("there is no column `{name}`, which {wanted_by} needs"),
            )
            .at(self.header_line, 1)
            .expected(format!(
                "`{name}` among the columns; this recording has {listed}"
            ));
            match nearest(name, names()) {
                Some(meant) => error.help(format!("did you mean `{meant}`?")),
                None => error,
            }
        })
    }

    /// A column for driving a simulation: a missing value holds the last one, and those before the
    /// first valid value take that one.
    ///
    /// # Errors
    /// As [`Recording::require`]; `File` also where every value is missing.
    pub fn held(&self, name: &str, wanted_by: &str) -> Result<Held> {
        let values = self.require(name, wanted_by)?;
        let first = values
            .iter()
            .copied()
            .find(|value| !value.is_nan())
            .ok_or_else(|| {
                Error::file(
                    &self.path,
                    format!("column `{name}`, which {wanted_by} needs, has no value at all"),
                )
                .at(self.header_line, 1)
            })?;
        let mut last = first;
        let mut missing = 0;
        let values = values
            .iter()
            .map(|&value| {
                if value.is_nan() {
                    missing += 1;
                } else {
                    last = value;
                }
                last
            })
            .collect();
        Ok(Held { values, missing })
    }

    /// The rows `range` as a recording of its own, time unchanged: to split by time, without leaks.
    ///
    /// # Errors
    /// `File` where the range is empty or reaches past the end.
    pub fn rows(&self, range: std::ops::Range<usize>) -> Result<Self> {
        if range.is_empty() || range.end > self.len() {
            let (start, end, len) = (range.start, range.end, self.len());
            return Err(Error::file(
                &self.path,
                format!("rows {start} to {end} of {len} are not a recording"),
            ));
        }
        let columns = self.columns.iter().map(|column| Column {
            name: column.name.clone(),
            values: column.values[range.clone()].to_vec(),
        });
        Ok(Self {
            path: self.path.clone(),
            header_line: self.header_line,
            lines: self.lines[range.clone()].to_vec(),
            columns: columns.collect(),
            t: self.t[range].to_vec(),
            notes: self.notes.clone(),
        })
    }
}

#[cfg(test)]
mod tests;
