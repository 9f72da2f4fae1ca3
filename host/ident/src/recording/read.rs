//! CSV bytes to a [`Recording`].
//!
//! The `csv` crate splits fields; numbers are parsed straight from its bytes. Places are worked out
//! only once something is wrong, from the byte at which the record began, so the usual case pays
//! nothing.

use std::path::Path;

use csv::ByteRecord;

use super::{Column, Recording};
use crate::error::{Error, Result};
use crate::report::count;

/// Expectation in every message about a number.
const A_NUMBER: &str = "a decimal number such as -1.25e-3, or nothing (a missing sample)";

/// Meaning of the rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rows {
    /// Samples at the times of the first column.
    Timed,
    /// Each row stands for itself.
    Untimed,
}

pub(super) fn parse(bytes: &[u8], path: &Path, rows: Rows) -> Result<Recording> {
    // A spreadsheet's byte-order mark is no part of the first name.
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let source = Source { bytes, path };
    source.is_utf8_text()?;
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true) // ragged rows get our message, with line and column
        .comment(Some(b'#'))
        .from_reader(bytes);
    let mut record = ByteRecord::new();

    if !source.next(&mut reader, &mut record)? {
        return Err(source
            .at_end("there is no line with column names")
            .expected(match rows {
                Rows::Timed => "`t` and the names of the signals",
                Rows::Untimed => "the names of the inputs and signals",
            }));
    }
    let header_line = source.line(&record);
    let names = header(&source, &record, rows)?;
    let kept = |index: &usize| names[*index] != "t";
    let kept: Vec<usize> = (0..names.len()).filter(kept).collect();

    let mut t: Vec<f64> = Vec::new();
    let mut lines: Vec<usize> = Vec::new();
    // Line of the row before and the byte at which it begins: every byte is counted once.
    let (mut line, mut from) = (1, 0);
    let empty = |&index: &usize| Column {
        name: names[index].clone(),
        values: Vec::new(),
    };
    let mut columns: Vec<Column> = kept.iter().map(empty).collect();
    while source.next(&mut reader, &mut record)? {
        if record.len() != names.len() {
            return Err(ragged(&source, &record, &names));
        }
        let start = source.start(&record);
        line += line_ends(&bytes[from..start]);
        from = start;
        lines.push(line);
        t.push(match rows {
            Rows::Timed => time(&source, &record, t.last().copied())?,
            Rows::Untimed => t.len() as f64,
        });
        for (column, &index) in columns.iter_mut().zip(&kept) {
            let value = number(&source, &record, index, &column.name)?;
            column.values.push(value);
        }
    }
    if t.is_empty() {
        return Err(source
            .at_end("there are no rows below the column names")
            .expected("at least one row of numbers"));
    }
    Ok(Recording {
        path: path.to_path_buf(),
        header_line,
        lines,
        t,
        columns,
        notes: Vec::new(),
    })
}

/// The column names: `t` first where rows have times, none empty, none twice.
fn header(source: &Source, record: &ByteRecord, rows: Rows) -> Result<Vec<String>> {
    let mut names: Vec<String> = Vec::with_capacity(record.len());
    for index in 0..record.len() {
        let name = std::str::from_utf8(record[index].trim_ascii())
            .map_err(|_| source.error(record, index, "a column name is not UTF-8 text"))?;
        if index == 0 && name != "t" && rows == Rows::Timed {
            return Err(first_name(source, record, name));
        }
        if name.is_empty() {
            return Err(source
                .error(record, index, format!("column {} has no name", index + 1))
                .expected("a name with its unit at the end, such as `q_m`")
                .help("a comma at the end of the line makes one column more"));
        }
        if name.contains(['\n', '\r']) {
            return Err(source
                .error(
                    record,
                    index,
                    "a column name goes on over the end of its line",
                )
                .expected("names on one line")
                .help("a quotation mark that opens a name is not closed behind it"));
        }
        if names.iter().any(|other| other == name) {
            return Err(source
                .error(record, index, format!("column `{name}` is there twice"))
                .expected("each name once"));
        }
        names.push(name.to_owned());
    }
    Ok(names)
}

/// Last words of a name of times in another unit than seconds, and the unit on the command line.
const UNITS: [(&[&str], &str); 5] = [
    (&["ms", "msec", "millis", "milliseconds"], "ms"),
    (&["us", "µs", "usec", "micros", "microseconds"], "us"),
    (&["ns", "nsec", "nanos", "nanoseconds"], "ns"),
    (&["min", "minutes"], "min"),
    (&["h", "hours"], "h"),
];

/// Why the first name is not `t`: the separator, a header that is not there, or another name.
fn first_name(source: &Source, record: &ByteRecord, name: &str) -> Error {
    let error = source
        .error(record, 0, format!("the first column is `{name}`"))
        .expected("`t`, time in seconds");
    if record.len() == 1 && name.contains([';', '\t']) {
        let separator = if name.contains(';') { "`;`" } else { "a tab" };
        return error.help(format!(
            "the names seem to be separated by {separator}; separate them by `,`"
        ));
    }
    if name.parse::<f64>().is_ok() {
        return error.help("the line with the column names seems to be missing");
    }
    let lower = name.to_lowercase();
    let mut words = lower
        .split(|c: char| !c.is_alphanumeric())
        .filter(|word| !word.is_empty());
    let (first, last) = (words.next().unwrap_or_default(), words.next_back());
    if matches!(first, "t" | "s") || first.starts_with("time") {
        let last = last.unwrap_or_default();
        let other = UNITS.iter().find(|(units, _)| units.contains(&last));
        return match other {
            Some((_, unit)) => error.help(format!(
                "rename it to `t`, and say its unit: --time-unit {unit}"
            )),
            None => error.help("rename it to `t` if it is in seconds"),
        };
    }
    if let Some(line) = source.line_of_names(record) {
        return error.help(format!(
            "the column names seem to be in line {line}: put a `#` at the start of the lines above"
        ));
    }
    if name.starts_with('[') || name.contains('=') {
        return error.help("this looks like a rig (TOML); a recording is a CSV file");
    }
    error.help("put the column with the times first and call it `t`")
}

/// Time of this row: present, finite and later than `before`.
fn time(source: &Source, record: &ByteRecord, before: Option<f64>) -> Result<f64> {
    let now = number(source, record, 0, "t")?;
    if now.is_nan() {
        return Err(source
            .error(record, 0, "the time is missing")
            .expected("seconds in every row"));
    }
    match before {
        Some(before) if now <= before => Err(source
            .error(
                record,
                0,
                format!("time does not increase: {now} after {before}"),
            )
            .expected("strictly increasing seconds")
            .help(if now == before {
                "two rows have the same time: were the times written with too few digits?"
            } else {
                "was the recorder restarted here? Then make it two recordings"
            })),
        _ => Ok(now),
    }
}

/// One field: a finite number, or NaN for a missing sample.
fn number(source: &Source, record: &ByteRecord, index: usize, name: &str) -> Result<f64> {
    let field = record[index].trim_ascii();
    if field.is_empty() {
        return Ok(f64::NAN);
    }
    let value = std::str::from_utf8(field)
        .ok()
        .and_then(|text| text.parse::<f64>().ok());
    match value {
        Some(value) if !value.is_infinite() => Ok(value),
        found => {
            let text = String::from_utf8_lossy(field);
            let shown: String = text.chars().take(40).collect();
            let what = if found.is_some() {
                "is not finite"
            } else {
                "is not a number"
            };
            let error = source
                .error(
                    record,
                    index,
                    format!("`{shown}` in column `{name}` {what}"),
                )
                .expected(A_NUMBER);
            Err(match help_with(&text, source, record, name) {
                Some(help) => error.help(help),
                None => error,
            })
        }
    }
}

/// Cause of a field that is no number, where it is easy to tell.
fn help_with(text: &str, source: &Source, record: &ByteRecord, name: &str) -> Option<&'static str> {
    let number = |field: &[u8]| {
        let text = std::str::from_utf8(field.trim_ascii()).unwrap_or_default();
        text.is_empty() || text.parse::<f64>().is_ok()
    };
    if text.contains(',') && text.replace(',', ".").parse::<f64>().is_ok() {
        return Some("write the decimal point as `.`");
    }
    if name == "t" && text == "t" {
        return Some(
            "the column names are here again: was the recorder restarted? Then make it two \
             recordings",
        );
    }
    if record.len() > 1 && !record.iter().any(number) {
        return Some("a line of units or further names? Delete it, or put a `#` at its start");
    }
    if name == "t" && text.contains(':') {
        return Some("write the times as seconds from the first row");
    }
    if text.contains('\0') {
        return Some("the file is damaged here: it holds zero bytes");
    }
    let last = !source.bytes[source.start(record)..].contains(&b'\n');
    last.then_some("was the recording cut off here? Delete the row")
}

fn ragged(source: &Source, record: &ByteRecord, names: &[String]) -> Error {
    let (found, wanted) = (record.len(), names.len());
    let error = source
        .error(
            record,
            found.min(wanted).saturating_sub(1),
            format!("this row has {}", count(found, "field")),
        )
        .expected(format!("{wanted}, one for each of {}", names.join(",")));
    if found > wanted {
        error.help(
            "is the decimal point written as a comma, or is there a comma at the end of the row?",
        )
    } else if record.iter().any(|field| field.contains(&b'\n')) {
        error.help("a quotation mark in this row is not closed")
    } else if record.len() == 1 && record[0].trim_ascii().is_empty() {
        error.help("delete the blank line")
    } else {
        error.help("was the recording cut off here? Delete the row")
    }
}

/// The file being read, to turn a record into a place.
struct Source<'a> {
    bytes: &'a [u8],
    path: &'a Path,
}

impl Source<'_> {
    /// Refuses text in two bytes a character, as some spreadsheets save it.
    fn is_utf8_text(&self) -> Result<()> {
        let begin = &self.bytes[..self.bytes.len().min(64)];
        let marked = begin.starts_with(b"\xFF\xFE") || begin.starts_with(b"\xFE\xFF");
        let zeros = begin.iter().filter(|byte| **byte == 0).count();
        if marked || 3 * zeros > begin.len() {
            return Err(Error::file(self.path, "the text is UTF-16")
                .at(1, 1)
                .expected("UTF-8")
                .help("save it as \"CSV UTF-8\", or run `iconv -f utf-16 -t utf-8`"));
        }
        Ok(())
    }

    /// Line below a record whose first field is `t`, among the next few.
    fn line_of_names(&self, record: &ByteRecord) -> Option<usize> {
        let text = String::from_utf8_lossy(&self.bytes[self.start(record)..]);
        let mut lines = text.lines().enumerate().skip(1).take(50);
        let below = lines.find(|(_, line)| {
            let first = line.split(',').next().unwrap_or_default();
            first.trim().trim_matches('"') == "t"
        });
        below.map(|(at, _)| self.line(record) + at)
    }

    fn next(&self, reader: &mut csv::Reader<&[u8]>, record: &mut ByteRecord) -> Result<bool> {
        // Bytes in memory and flexible lengths leave the csv crate nothing to refuse.
        reader
            .read_byte_record(record)
            .map_err(|error| Error::file(self.path, error.to_string()))
    }

    /// An error at field `index` of `record`.
    fn error(&self, record: &ByteRecord, index: usize, message: impl Into<String>) -> Error {
        let column = self.column(self.start(record), index);
        Error::file(self.path, message).at(self.line(record), column)
    }

    fn at_end(&self, message: &str) -> Error {
        Error::file(self.path, message).at(line_of(self.bytes, self.bytes.len()), 1)
    }

    fn line(&self, record: &ByteRecord) -> usize {
        line_of(self.bytes, self.start(record))
    }

    /// Byte at which the record's text begins. The csv crate reports where it began to *look*,
    /// which may be in front of blank lines and comments.
    fn start(&self, record: &ByteRecord) -> usize {
        let mut at = record
            .position()
            .map_or(0, |position| position.byte() as usize)
            .min(self.bytes.len());
        loop {
            match self.bytes.get(at) {
                Some(b'\r' | b'\n') => at += 1,
                Some(b'#') => {
                    at += self.bytes[at..]
                        .iter()
                        .position(|&byte| byte == b'\n')
                        .unwrap_or(self.bytes.len() - at);
                }
                _ => return at,
            }
        }
    }

    /// Column, in characters from 1, of field `index` of the line that begins at byte `start`.
    fn column(&self, start: usize, index: usize) -> usize {
        let mut quoted = false;
        let mut fields = 0;
        let mut end = start;
        for &byte in &self.bytes[start..] {
            if fields == index || (!quoted && matches!(byte, b'\r' | b'\n')) {
                break;
            }
            match byte {
                b'"' => quoted = !quoted,
                b',' if !quoted => fields += 1,
                _ => {}
            }
            end += 1;
        }
        // A blank before the number is not the number.
        while self.bytes.get(end) == Some(&b' ') {
            end += 1;
        }
        String::from_utf8_lossy(&self.bytes[start..end])
            .chars()
            .count()
            + 1
    }
}

/// Line, from 1, of the byte at `end`.
fn line_of(bytes: &[u8], end: usize) -> usize {
    let end = end.min(bytes.len());
    // One byte beyond `end` tells a lone carriage return from the first half of a line end.
    let lone = end > 0 && bytes[end - 1] == b'\r' && bytes.get(end) == Some(&b'\n');
    1 + line_ends(&bytes[..end]) - usize::from(lone)
}

/// Number of line ends in some bytes. A lone carriage return ends a line too (old instruments).
fn line_ends(bytes: &[u8]) -> usize {
    let ends = |at: usize| match bytes[at] {
        b'\n' => true,
        b'\r' => bytes.get(at + 1) != Some(&b'\n'),
        _ => false,
    };
    (0..bytes.len()).filter(|&at| ends(at)).count()
}
