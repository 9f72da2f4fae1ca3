//! What other people's physics wrote, in `tests/foreign/`.

use std::path::PathBuf;

/// Path of a file of `tests/foreign`.
pub fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("foreign")
        .join(name)
}

/// Text of a file of `tests/foreign`.
///
/// # Panics
/// It cannot be read.
pub fn text(name: &str) -> String {
    let path = path(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A recording without gaps: its columns by name, in their order.
pub struct Columns {
    names: Vec<String>,
    values: Vec<Vec<f64>>,
}

impl Columns {
    /// Reads one.
    ///
    /// # Panics
    /// It is not there, or is not a table of numbers.
    pub fn read(name: &str) -> Self {
        let text = text(name);
        let mut lines = text.lines().skip_while(|line| line.starts_with('#'));
        let header = lines.next().expect("a line of names");
        let names: Vec<String> = header.split(',').map(str::to_string).collect();
        let mut values = vec![Vec::new(); names.len()];
        for line in lines {
            for (column, field) in values.iter_mut().zip(line.split(',')) {
                column.push(field.parse().expect("the recording holds numbers"));
            }
        }
        Self { names, values }
    }

    /// One column.
    ///
    /// # Panics
    /// There is none of this name.
    pub fn get(&self, name: &str) -> &[f64] {
        let at = self.names.iter().position(|n| n == name);
        &self.values[at.unwrap_or_else(|| panic!("there is no column {name}"))]
    }

    /// Names of the columns that begin so.
    pub fn beginning(&self, prefix: &str) -> Vec<&str> {
        let names = self.names.iter().map(String::as_str);
        names.filter(|name| name.starts_with(prefix)).collect()
    }
}

/// Highest less lowest.
pub fn range(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::MIN, f64::max)
        - values.iter().copied().fold(f64::MAX, f64::min)
}
