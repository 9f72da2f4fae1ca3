//! Repairs that a user asks for by a flag: the recording as it would be without a known fault.
//!
//! Each repair mends one kind of fault that [`crate::check`] names. Nothing is repaired unasked.

use super::Recording;
use crate::error::{Error, Result};

/// Unit of the column `t` in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TimeUnit {
    /// Seconds, as the format wants.
    #[default]
    Seconds,
    /// Milliseconds.
    Milliseconds,
    /// Microseconds.
    Microseconds,
    /// Nanoseconds.
    Nanoseconds,
    /// Minutes.
    Minutes,
    /// Hours.
    Hours,
}

impl TimeUnit {
    /// Number of these units in a second.
    pub fn per_second(self) -> f64 {
        match self {
            Self::Minutes => 1.0 / 60.0,
            Self::Hours => 1.0 / 3600.0,
            Self::Seconds => 1.0,
            Self::Milliseconds => 1e3,
            Self::Microseconds => 1e6,
            Self::Nanoseconds => 1e9,
        }
    }
}

/// Repairs of a recording, applied in the order of the fields. The default changes nothing.
///
/// ```
/// use sinew_ident::recording::Recording;
/// use sinew_ident::recording::repair::{Repair, TimeUnit};
///
/// let recording = Recording::parse(b"t,q_m\n0,1\n20,-9999\n40,2\n", "a.csv")?;
/// let repair = Repair {
///     time_unit: TimeUnit::Milliseconds,
///     missing: vec![-9999.0],
///     ..Repair::default()
/// };
/// let repaired = repair.apply(recording)?;
/// assert_eq!(repaired.t(), [0.0, 0.02, 0.04]);
/// assert!(repaired.require("q_m", "this example")?[1].is_nan());
/// # Ok::<(), sinew_ident::error::Error>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Repair {
    /// Unit of the column `t`.
    pub time_unit: TimeUnit,
    /// Values that stand for "no value", in every column but `t`.
    pub missing: Vec<f64>,
    /// Values that stand for "no value" in one column.
    pub missing_in: Vec<(String, f64)>,
    /// Columns of a counter that begins anew, with its period in the column's unit.
    pub unwrap: Vec<(String, f64)>,
    /// Columns that are late by some rows; a negative number moves a column later.
    pub late: Vec<(String, i64)>,
}

impl Repair {
    /// The recording without the faults.
    ///
    /// # Errors
    /// `File`, with the header's line, for a column that is not there; for a column that would lose
    /// half of its rows.
    pub fn apply(&self, mut recording: Recording) -> Result<Recording> {
        if self.time_unit != TimeUnit::Seconds {
            // A division: 5 ms is the nearest number to 0.005, which a product is not always.
            let units = self.time_unit.per_second();
            match self.time_unit {
                TimeUnit::Minutes => recording.t.iter_mut().for_each(|t| *t *= 60.0),
                TimeUnit::Hours => recording.t.iter_mut().for_each(|t| *t *= 3600.0),
                _ => recording.t.iter_mut().for_each(|t| *t /= units),
            }
            if recording.t.windows(2).any(|pair| pair[1] <= pair[0]) {
                let message = "times in this unit are too close for their digits";
                return Err(Error::file(&recording.path, message).help("check --time-unit"));
            }
        }
        for column in &mut recording.columns {
            for value in &mut column.values {
                if self.missing.contains(value) {
                    *value = f64::NAN;
                }
            }
        }
        for (name, missing) in &self.missing_in {
            let values = values_of(&mut recording, name, "--missing")?.iter_mut();
            for value in values.filter(|value| *value == missing) {
                *value = f64::NAN;
            }
        }
        for (name, period) in &self.unwrap {
            unwrap(values_of(&mut recording, name, "--unwrap")?, *period);
        }
        for (name, rows) in &self.late {
            let count = recording.t.len();
            if usize::try_from(rows.unsigned_abs()).is_ok_and(|by| by < count.div_ceil(2)) {
                shift(values_of(&mut recording, name, "--late")?, *rows);
                continue;
            }
            let message =
                format!("`--late {name}={rows}` moves out half of its {count} rows or more");
            return Err(Error::file(&recording.path, message).help("check the number of rows"));
        }
        Ok(recording)
    }
}

/// Values of a column that a flag names.
fn values_of<'a>(recording: &'a mut Recording, name: &str, flag: &str) -> Result<&'a mut Vec<f64>> {
    recording.require(name, &format!("`{flag}`"))?;
    let columns = recording.columns.iter_mut();
    let mut named = columns.filter(|column| column.name == name);
    match named.next() {
        Some(column) => Ok(&mut column.values),
        None => Err(Error::arguments(format!("{flag} {name}: no such column"))),
    }
}

/// Takes whole periods out of every jump of more than half a period.
pub fn unwrap(values: &mut [f64], period: f64) {
    let mut turns = 0.0;
    let mut before = f64::NAN;
    for value in values {
        let raw = *value;
        if raw.is_nan() {
            continue;
        }
        if before.is_finite() {
            turns -= ((raw - before) / period).round();
        }
        before = raw;
        *value = raw + turns * period;
    }
}

/// Moves values `rows` rows earlier (later where negative); the end is left without values.
fn shift(values: &mut [f64], rows: i64) {
    let count = values.len();
    let by = usize::try_from(rows.unsigned_abs()).map_or(count, |by| by.min(count));
    if rows >= 0 {
        values.rotate_left(by);
        values[count - by..].fill(f64::NAN);
    } else {
        values.rotate_right(by);
        values[..by].fill(f64::NAN);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording(text: &str) -> Recording {
        Recording::parse(text.as_bytes(), "a.csv").unwrap()
    }

    #[test]
    fn a_column_is_not_moved_out_of_its_recording() {
        for rows in [2, -2, i64::MAX, i64::MIN] {
            let repair = Repair {
                late: vec![("u_N".into(), rows)],
                ..Repair::default()
            };
            let refused = repair.apply(recording("t,u_N\n0,1\n1,2\n2,3\n3,4\n"));
            let message = refused.unwrap_err().to_string();
            assert!(message.contains("--late u_N="), "{message}");
        }
    }

    #[test]
    fn each_repair_mends_its_fault_and_nothing_else() {
        let faulty = recording("t,u_N,q_rad\n0,1,6\n5,2,0.2\n10,-9999,0.4\n15,4,6.1\n");
        let repair = Repair {
            time_unit: TimeUnit::Milliseconds,
            missing: vec![-9999.0],
            missing_in: Vec::new(),
            unwrap: vec![("q_rad".into(), 6.0)],
            late: vec![("u_N".into(), 1)],
        };
        let mended = repair.apply(faulty).unwrap();
        assert_eq!(mended.t(), [0.0, 0.005, 0.01, 0.015]);
        let u = mended.column("u_N").unwrap();
        assert_eq!(u[0], 2.0);
        assert!(u[1].is_nan() && u[3].is_nan());
        assert_eq!(u[2], 4.0);
        let q = mended.column("q_rad").unwrap();
        for (found, wanted) in q.iter().zip([6.0, 6.2, 6.4, 6.1]) {
            assert!((found - wanted).abs() < 1e-12, "{q:?}");
        }
        let same = recording("t,q_m\n0,1\n1,2\n");
        assert_eq!(
            Repair::default().apply(same.clone()).unwrap().to_csv(),
            same.to_csv()
        );
    }

    /// Zero is a command as good as any.
    #[test]
    fn a_value_is_missing_in_the_column_that_is_named_and_nowhere_else() {
        let repair = Repair {
            missing_in: vec![("q_m".into(), 0.0)],
            ..Repair::default()
        };
        let mended = repair.apply(recording("t,u_N,q_m\n0,0,1\n1,0,0\n2,1,2\n"));
        let mended = mended.unwrap();
        assert_eq!(mended.column("u_N").unwrap(), [0.0, 0.0, 1.0]);
        let q = mended.column("q_m").unwrap();
        assert!(q[1].is_nan() && q[0] == 1.0 && q[2] == 2.0);
    }

    #[test]
    fn a_column_that_is_not_there_is_an_error() {
        let repair = Repair {
            unwrap: vec![("q_m".into(), 1.0)],
            ..Repair::default()
        };
        let error = repair.apply(recording("t,q_rad\n0,1\n")).unwrap_err();
        assert!(error.to_string().contains("`--unwrap`"), "{error}");
    }
}
