//! Flags that mend a fault of a recording where it is read.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use sinew_sim::Rig;

use super::progress::Stage;
use crate::check::{Check, KINDS, check};
use crate::error::{Error, Result};
use crate::recording::Recording;
use crate::recording::repair::{Repair, TimeUnit};

/// Units of `t`, by their names on the command line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Unit {
    /// Seconds.
    #[default]
    S,
    /// Milliseconds.
    Ms,
    /// Microseconds.
    Us,
    /// Nanoseconds.
    Ns,
    /// Minutes.
    Min,
    /// Hours.
    H,
}

/// Reads a recording; unless `quiet`, says on standard error by which rules a log of another
/// program became one.
///
/// # Errors
/// As [`Recording::read`].
pub fn read_recording(path: impl AsRef<Path>, quiet: bool) -> Result<Recording> {
    let recording = Recording::read(&path)?;
    if !quiet {
        for note in recording.notes() {
            eprintln!("{}: {note}", path.as_ref().display());
        }
    }
    Ok(recording)
}

/// Reads recordings as [`read_recording`] does.
///
/// # Errors
/// As [`Recording::read`].
pub fn read_recordings(paths: &[PathBuf], quiet: bool) -> Result<Vec<Recording>> {
    let read = |path: &PathBuf| read_recording(path, quiet);
    paths.iter().map(read).collect()
}

/// Repairs of all recordings that a verb reads.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Repairs of recordings")]
pub struct Repairs {
    /// Unit of the column `t`; s unless it is given.
    #[arg(long, value_enum)]
    time_unit: Option<Unit>,
    /// Number that stands for "no value", or a column and its own, such as q_m=0; may be repeated.
    #[arg(long, value_name = "NUMBER", value_parser = missing, allow_negative_numbers = true)]
    missing: Vec<(Option<String>, f64)>,
    /// Column of a counter that begins anew, and its period in the column's unit; may be repeated.
    #[arg(long, value_name = "COLUMN=PERIOD", value_parser = period)]
    unwrap: Vec<(String, f64)>,
    /// Column that was written some rows late, such as `u_V=1`; may be repeated.
    #[arg(long, value_name = "COLUMN=ROWS", value_parser = rows)]
    late: Vec<(String, i64)>,
    /// Kind of fault that is not refused, such as `sentinel`; may be repeated.
    #[arg(long, value_name = "KIND", value_parser = KINDS, hide_possible_values = true)]
    accept: Vec<String>,
}

impl Repairs {
    /// Reads recordings and mends them; `quiet` as for [`read_recording`].
    ///
    /// # Errors
    /// As [`Recording::read`] and [`Repair::apply`].
    pub fn read(&self, paths: &[PathBuf], quiet: bool) -> Result<Vec<Recording>> {
        let repair = self.repair();
        let read = |path: &PathBuf| repair.apply(read_recording(path, quiet)?);
        paths.iter().map(read).collect()
    }

    /// Reads tables of rests and mends them.
    ///
    /// # Errors
    /// As [`Recording::read_table`] and [`Repair::apply`]; `Arguments` for a repair of times.
    pub fn read_tables(&self, paths: &[PathBuf]) -> Result<Vec<Recording>> {
        let of_time = [
            ("--time-unit", self.time_unit.is_some()),
            ("--unwrap", !self.unwrap.is_empty()),
            ("--late", !self.late.is_empty()),
            ("--accept", !self.accept.is_empty()),
        ];
        if let Some((flag, _)) = of_time.into_iter().find(|(_, given)| *given) {
            let message = format!("{flag} repairs rows in time; a table of rests has none");
            return Err(Error::arguments(message).help("of the repairs, --static takes --missing"));
        }
        let repair = self.repair();
        let read = |path: &PathBuf| repair.apply(Recording::read_table(path)?);
        paths.iter().map(read).collect()
    }

    /// Checks recordings before any work: says what is likely wrong, refuses what certainly is.
    ///
    /// # Errors
    /// `Failed` for a certain fault whose kind `--accept` does not name.
    pub fn before<'a>(
        &self,
        rig: &Rig,
        recordings: impl IntoIterator<Item = &'a Recording>,
        quiet: bool,
    ) -> Result<Vec<Check>> {
        let recordings: Vec<Recording> = recordings.into_iter().cloned().collect();
        // It refits the rig some times, which takes seconds; without a fault it leaves no line.
        let stage = Stage::begin("check the recordings", quiet);
        let checks = check(&recordings, Some(rig));
        drop(stage);
        self.judge(&checks)?;
        Ok(checks)
    }

    /// True where `--time-unit` was given.
    pub fn time_unit_is_given(&self) -> bool {
        self.time_unit.is_some()
    }

    /// True where `--accept` names the kind.
    pub fn accepts(&self, kind: &str) -> bool {
        self.accept.iter().any(|accepted| accepted == kind)
    }

    /// The flags as they would be typed again, each after a space; empty without repairs.
    pub fn flags(&self) -> String {
        let unit = self.time_unit.iter().filter_map(|unit| {
            let value = unit.to_possible_value()?;
            Some(format!(" --time-unit {}", value.get_name()))
        });
        let missing = self.missing.iter().map(|(column, number)| match column {
            Some(column) => format!(" --missing {column}={number}"),
            None => format!(" --missing {number}"),
        });
        let unwrap = self.unwrap.iter();
        let unwrap = unwrap.map(|(column, period)| format!(" --unwrap {column}={period}"));
        let late = self.late.iter();
        let late = late.map(|(column, rows)| format!(" --late {column}={rows}"));
        let accept = self.accept.iter().map(|kind| format!(" --accept {kind}"));
        unit.chain(missing)
            .chain(unwrap)
            .chain(late)
            .chain(accept)
            .collect()
    }

    /// Refuses checks that are certain.
    ///
    /// # Errors
    /// As [`Repairs::before`].
    pub fn refuse(&self, checks: &[Check]) -> Result<()> {
        let mut kinds: Vec<&str> = (checks.iter())
            .filter(|check| self.refused(check))
            .map(|check| check.kind)
            .collect();
        kinds.sort_unstable();
        kinds.dedup();
        if kinds.is_empty() {
            return Ok(());
        }
        let error = format!("the recordings are certainly wrong: {}", kinds.join(", "));
        Err(Error::failed(error).help("mend them as above, or --accept KIND"))
    }

    fn refused(&self, check: &Check) -> bool {
        check.certain && !self.accepts(check.kind)
    }

    /// Prints checks on standard error, and refuses those that are certain.
    ///
    /// # Errors
    /// As [`Repairs::before`].
    pub fn judge(&self, checks: &[Check]) -> Result<()> {
        // The flag answers a mere suspicion.
        let answered = |check: &Check| {
            !check.certain && check.kind.starts_with("time_in") && self.time_unit_is_given()
        };
        let shown = checks.iter().filter(|check| !answered(check));
        let shown: Vec<Check> = shown.cloned().collect();
        super::fault_text::print(&shown);
        self.refuse(checks)
    }

    fn repair(&self) -> Repair {
        let everywhere = self.missing.iter().filter(|(column, _)| column.is_none());
        let in_one = self.missing.iter();
        let in_one = in_one.filter_map(|(column, number)| Some((column.clone()?, *number)));
        Repair {
            time_unit: match self.time_unit.unwrap_or_default() {
                Unit::S => TimeUnit::Seconds,
                Unit::Ms => TimeUnit::Milliseconds,
                Unit::Us => TimeUnit::Microseconds,
                Unit::Ns => TimeUnit::Nanoseconds,
                Unit::Min => TimeUnit::Minutes,
                Unit::H => TimeUnit::Hours,
            },
            missing: everywhere.map(|(_, number)| *number).collect(),
            missing_in: in_one.collect(),
            unwrap: self.unwrap.clone(),
            late: self.late.clone(),
        }
    }
}

/// `NUMBER` or `COLUMN=NUMBER`.
fn missing(text: &str) -> Result<(Option<String>, f64)> {
    let (column, number) = match text.rsplit_once('=') {
        Some((column, number)) => (Some(column.to_owned()), number),
        None => (None, text),
    };
    let number = number
        .parse()
        .ok()
        .filter(|number: &f64| number.is_finite());
    let expected = "expected a number such as -9999, or a column and its number, such as q_m=0";
    Ok((column, number.ok_or_else(|| Error::arguments(expected))?))
}

/// `COLUMN=PERIOD`.
fn period(text: &str) -> Result<(String, f64)> {
    let parsed = text.rsplit_once('=').and_then(|(column, period)| {
        let period: f64 = period.parse().ok()?;
        (period.is_finite() && period > 0.0).then(|| (column.to_owned(), period))
    });
    parsed.ok_or_else(|| {
        Error::arguments("expected a column and a positive period, such as q_rad=6.28319")
    })
}

/// `COLUMN=ROWS`.
fn rows(text: &str) -> Result<(String, i64)> {
    let parsed = text.rsplit_once('=');
    let parsed = parsed.and_then(|(column, rows)| Some((column.to_owned(), rows.parse().ok()?)));
    parsed.ok_or_else(|| {
        Error::arguments("expected a column and a whole number of rows, such as u_V=1")
    })
}
