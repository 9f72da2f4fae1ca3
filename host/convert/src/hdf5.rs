//! HDF5, and MATLAB v7.3 in it: groups are structures, and arrays have their dimensions reversed.

use std::panic::{AssertUnwindSafe, catch_unwind};

use hdf5_pure::{AttrValue, DType, File, Group};

use crate::contents::Contents;
use crate::error::{Error, Result};

/// Groups within groups that are followed.
const MOST_DEPTH: usize = 16;
/// Datasets that are looked at.
const MOST_DATASETS: usize = 20_000;
/// Numbers that a byte of the file can stand for: zlib makes some 1030 bytes of one.
const MOST_RATIO: usize = 1040;

/// # Errors
/// A file that is broken, cut off or too large.
pub fn read(bytes: &[u8]) -> Result<Contents> {
    let start = [0, 512, 1024, 2048].into_iter();
    let start = start.filter(|at| {
        let rest = bytes.get(*at..);
        rest.is_some_and(|rest| rest.starts_with(b"\x89HDF\r\n\x1a\n"))
    });
    let Some(start) = start.min() else {
        return Err(Error::new("it is no HDF5 file"));
    };
    if let Some(said) = said_length(&bytes[start..]).filter(|said| *said > bytes.len() as u64) {
        return Err(Error::new(format!(
            "the file is cut off: {} of {said} bytes are here",
            bytes.len()
        )));
    }
    let file = guarded("/", || File::from_bytes(bytes.to_vec()))?;
    let mut reader = Reader {
        contents: Contents::default(),
        datasets: 0,
        most: bytes.len().saturating_mul(MOST_RATIO),
    };
    reader.group(&file.root(), "", 0)?;
    Ok(reader.contents)
}

/// Runs the library, whose panics on a broken file are errors of the file.
fn guarded<T>(
    place: &str,
    work: impl FnOnce() -> std::result::Result<T, hdf5_pure::Error>,
) -> Result<T> {
    let broken = |what: String| Error::new(format!("the HDF5 file is broken at `{place}`: {what}"));
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => Err(broken(error.to_string())),
        Err(_) => Err(broken("its structure contradicts itself".into())),
    }
}

/// The length that an HDF5 file says it has: the end-of-file address of its superblock (HDF5 File
/// Format Specification 3.0, II.A), where addresses have eight bytes.
fn said_length(bytes: &[u8]) -> Option<u64> {
    let (width, place) = match bytes.get(8)? {
        0 => (13, 40),
        1 => (13, 44),
        _ => (9, 28),
    };
    let address = bytes.get(place..)?.first_chunk()?;
    (*bytes.get(width)? == 8).then(|| u64::from_le_bytes(*address))
}

struct Reader {
    contents: Contents,
    datasets: usize,
    most: usize,
}

impl Reader {
    fn group(&mut self, group: &Group, path: &str, depth: usize) -> Result<()> {
        if depth > MOST_DEPTH {
            return Err(Error::new("groups within groups without end"));
        }
        let below = |name: &str| match path {
            "" => name.to_owned(),
            _ => format!("{path}/{name}"),
        };
        for name in guarded(path, || group.datasets())? {
            self.datasets += 1;
            if self.datasets > MOST_DATASETS {
                return Err(Error::new("more datasets than any recording has"));
            }
            self.dataset(group, &name, &below(&name))?;
        }
        for name in guarded(path, || group.groups())? {
            // MATLAB's own bookkeeping: `#refs#`, `#subsystem#`.
            if name.starts_with('#') {
                continue;
            }
            let inner = guarded(path, || group.group(&name))?;
            self.group(&inner, &below(&name), depth + 1)?;
        }
        Ok(())
    }

    fn dataset(&mut self, group: &Group, name: &str, path: &str) -> Result<()> {
        let dataset = guarded(path, || group.dataset(name))?;
        let mut attributes = guarded(path, || dataset.attrs()).unwrap_or_default();
        let class = attributes.remove("MATLAB_class").and_then(text_of);
        let unit = attributes.remove("units").or(attributes.remove("unit"));
        let kind = guarded(path, || dataset.dtype())?;
        let mut shape = Vec::new();
        for size in guarded(path, || dataset.shape())? {
            shape.push(usize::try_from(size).unwrap_or(usize::MAX));
        }
        if attributes.contains_key("MATLAB_empty") {
            self.contents.other(path, "empty");
            return Ok(());
        }
        let numbers = match kind {
            DType::F32 | DType::F64 | DType::I8 | DType::I16 | DType::I32 => true,
            DType::I64 | DType::U8 | DType::U16 | DType::U32 | DType::U64 => true,
            DType::Compound(_) => {
                self.contents.other(path, "compound or complex numbers");
                false
            }
            DType::ObjectReference => {
                self.contents
                    .other(path, "cells or an object, which only MATLAB reads");
                false
            }
            other => {
                self.contents.other(path, format!("values of type {other}"));
                false
            }
        };
        let scalars = shape
            .iter()
            .try_fold(1_usize, |n, size| n.checked_mul(*size));
        let count = scalars.filter(|count| *count <= self.most);
        let Some(count) = count else {
            return Err(Error::new(format!(
                "`{path}`: {shape:?} are more numbers than the file can hold"
            )));
        };
        if !numbers {
            return Ok(());
        }
        self.contents.count(count)?;
        let mut values = guarded(path, || dataset.read_f64())?;
        if values.len() != count {
            let found = values.len();
            return Err(Error::new(format!(
                "`{path}` has {found} numbers for {shape:?}"
            )));
        }
        if class.as_deref() == Some("char") {
            let units: Vec<u16> = values.iter().map(|value| *value as u16).collect();
            self.contents
                .text_at(path, &String::from_utf16_lossy(&units));
            return Ok(());
        }
        if class.is_some() {
            // MATLAB writes its columns one after the other, and says the dimensions backwards.
            shape.reverse();
        } else {
            values = by_columns(&shape, values);
        }
        self.contents.push(path, &shape, values)?;
        if let (Some(unit), Some(array)) = (unit.and_then(text_of), self.contents.arrays.last_mut())
            && array.path == path
        {
            array.unit = unit;
        }
        Ok(())
    }
}

/// Values of a matrix written row by row, column by column.
fn by_columns(shape: &[usize], values: Vec<f64>) -> Vec<f64> {
    let wide: Vec<usize> = match shape.len() {
        0..=2 => shape.to_vec(),
        _ => shape.iter().copied().filter(|n| *n != 1).collect(),
    };
    match wide[..] {
        [rows, columns] if rows > 1 && columns > 1 => {
            let column = |index: usize| values.iter().skip(index).step_by(columns);
            (0..columns).flat_map(column).copied().collect()
        }
        _ => values,
    }
}

fn text_of(value: AttrValue) -> Option<String> {
    match value {
        AttrValue::String(text)
        | AttrValue::AsciiString(text)
        | AttrValue::VarLenString(text)
        | AttrValue::VarLenAsciiString(text)
        | AttrValue::StringSized { value: text, .. }
        | AttrValue::AsciiStringSized { value: text, .. } => Some(text),
        _ => None,
    }
}
