//! Contents of a log, whatever its format: numbers at paths, and what is no number.

use crate::error::{Error, Result};

/// Most numbers that are taken from one file, whatever it says of itself.
pub const MOST_VALUES: usize = 1 << 26;

/// Most arrays of one file.
const MOST_ARRAYS: usize = 20_000;

/// Format of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// MATLAB level 5 (`save -v6`, `-v7`).
    Mat5,
    /// HDF5, MATLAB v7.3 among it.
    Hdf5,
    /// MCAP.
    Mcap,
    /// JSON, BAM's logs among it.
    Json,
    /// Parquet, which is known and not read.
    Parquet,
}

impl Format {
    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mat5 => "MATLAB v5",
            Self::Hdf5 => "HDF5",
            Self::Mcap => "MCAP",
            Self::Json => "JSON",
            Self::Parquet => "Parquet",
        }
    }
}

/// Numbers at a path, as a matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Names of structures, groups or topics down to it, with `/` between them.
    pub path: String,
    /// Rows of the matrix.
    pub rows: usize,
    /// Columns of the matrix.
    pub columns: usize,
    /// Its numbers, column by column; NaN is a missing sample.
    pub values: Vec<f64>,
    /// Unit as the file says it; empty where it does not.
    pub unit: String,
    /// Name of its column, where the format has one; otherwise the path gives it.
    pub name: Option<String>,
}

impl Array {
    /// Values in a single row or column; `None` for a matrix.
    pub fn vector(&self) -> Option<&[f64]> {
        (self.rows == 1 || self.columns == 1).then_some(&self.values)
    }

    /// Signals of `length` samples in it: its columns, or its rows where only those are so long.
    pub fn signals(&self, length: usize) -> usize {
        if self.rows == length {
            self.columns
        } else if self.columns == length {
            self.rows
        } else {
            0
        }
    }

    /// One of its [`Array::signals`], from 0.
    pub fn signal(&self, length: usize, index: usize) -> Option<Vec<f64>> {
        if index >= self.signals(length) {
            return None;
        }
        Some(if self.rows == length {
            self.values[index * length..(index + 1) * length].to_vec()
        } else {
            let row = self.values.iter().skip(index).step_by(self.rows.max(1));
            row.copied().collect()
        })
    }

    /// Path without its last name; empty at the top.
    pub fn group(&self) -> &str {
        parent(&self.path)
    }
}

/// Path without its last name; empty at the top.
pub fn parent(path: &str) -> &str {
    path.rsplit_once('/').map_or("", |(group, _)| group)
}

/// Something that is no array of numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Other {
    /// As in [`Array`].
    pub path: String,
    /// Kind and content in a few words.
    pub what: String,
}

/// Everything in a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contents {
    /// Format of the file.
    pub format: Option<Format>,
    /// Numbers, in the file's order.
    pub arrays: Vec<Array>,
    /// Everything else.
    pub others: Vec<Other>,
    /// Rules that the reader applied, a sentence each.
    pub notes: Vec<String>,
    values: usize,
}

impl Contents {
    /// Adds numbers of any shape: dimensions of one are left out, more than two are no signals.
    ///
    /// # Errors
    /// More numbers than are taken from one file.
    pub fn push(&mut self, path: &str, shape: &[usize], values: Vec<f64>) -> Result<()> {
        self.count(values.len())?;
        let mut wide: Vec<usize> = shape.to_vec();
        if wide.len() > 2 {
            wide.retain(|n| *n != 1);
        }
        let (rows, columns) = match wide[..] {
            [] => (values.len(), 1),
            [rows] => (rows, 1),
            [rows, columns] => (rows, columns),
            _ => {
                self.other(path, format!("numbers in {} dimensions", wide.len()));
                return Ok(());
            }
        };
        if values.is_empty() {
            self.other(path, "empty");
            return Ok(());
        }
        if self.arrays.len() >= MOST_ARRAYS {
            return Err(Error::new(format!(
                "more than {MOST_ARRAYS} arrays, the most that is read from one file"
            )));
        }
        self.arrays.push(Array {
            path: path.to_owned(),
            rows,
            columns,
            values,
            unit: String::new(),
            name: None,
        });
        Ok(())
    }

    /// Counts numbers before they are allocated.
    ///
    /// # Errors
    /// As [`Contents::push`].
    pub fn count(&mut self, values: usize) -> Result<()> {
        self.values = self.values.saturating_add(values);
        if self.values > MOST_VALUES {
            return Err(Error::new(format!(
                "more than {MOST_VALUES} numbers, the most that is read from one file"
            )));
        }
        Ok(())
    }

    /// Adds something that is no array of numbers.
    pub fn other(&mut self, path: &str, what: impl Into<String>) {
        self.others.push(Other {
            path: path.to_owned(),
            what: what.into(),
        });
    }

    /// Text at a path, where [`Contents::text_at`] put one.
    pub fn text(&self, path: &str) -> Option<&str> {
        let other = self.others.iter().find(|other| other.path == path)?;
        other.what.strip_prefix("text \"")?.strip_suffix('"')
    }

    /// Adds a text.
    pub fn text_at(&mut self, path: &str, text: &str) {
        let short: String = text.chars().take(60).collect();
        self.other(path, format!("text \"{short}\""));
    }
}
