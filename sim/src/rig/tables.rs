//! Tables of a rig file that the plant does not use: kept in the text, read by the program that
//! they are for.

use super::Rig;
use super::names::{Component, Names};
use super::reader::{Source, Spanned, TableReader};
use super::sections::read_names;
use crate::error::Error;

/// The tables of a rig file, and the names in it.
pub struct Tables<'a> {
    root: TableReader<'a>,
    names: Names<'a>,
}

impl Rig {
    /// Reads tables of the file that the plant does not use (`[control]`, `[network]`), with the
    /// errors of a rig file: line, column, and the name that was probably meant.
    ///
    /// ```
    /// use sinew_sim::{Rig, effects::Sign};
    /// let text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"mass\"\n\
    ///             motion = \"slide\"\ninertia = 1.0\n[control]\nrate_hzz = 120.0\n";
    /// let rig = Rig::parse(text, "x.toml")?; // the plant does not care
    /// let rate = rig.read_tables(|tables| {
    ///     let Some(control) = tables.table("control")? else {
    ///         return Ok(None);
    ///     };
    ///     control.allow(&["rate_hz", "horizon"])?;
    ///     control.number("rate_hz", Sign::Positive)
    /// });
    /// let error = rate.unwrap_err().to_string();
    /// assert!(error.starts_with("x.toml:8:1: unknown key `rate_hzz`"), "{error}");
    /// assert!(error.contains("did you mean `rate_hz`?"), "{error}");
    /// # Ok::<(), sinew_sim::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of `read`.
    pub fn read_tables<T>(
        &self,
        read: impl FnOnce(&Tables) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let source = Source::new(&self.file, &self.text);
        let document = source.document()?;
        let root = TableReader::root(&source, document.as_table());
        let names = read_names(&root)?;
        read(&Tables { root, names })
    }
}

impl<'a> Tables<'a> {
    /// A single table `[name]`, if it is there.
    ///
    /// # Errors
    /// The key is there and is no table.
    pub fn table(&self, name: &'static str) -> Result<Option<TableReader<'a>>, Error> {
        self.root.table(name)
    }

    /// Indices of the sensors that `key` of a table names, each once, if the key is there.
    ///
    /// # Errors
    /// The key is no list of names, or one of them is no sensor or there twice.
    pub fn sensors(&self, table: &TableReader, key: &str) -> Result<Option<Vec<usize>>, Error> {
        let role = format!("`{key}` of {}", table.what);
        let Some(texts) = table.texts(key)? else {
            return Ok(None);
        };
        let mut sensors = Vec::new();
        for text in &texts {
            let name = Spanned {
                value: text.value.as_str(),
                span: text.span.clone(),
            };
            let sensor =
                self.names
                    .resolve(
                        table.source,
                        &name,
                        &role,
                        "sensors",
                        |component| match component {
                            Component::Sensor(sensor) => Some(sensor),
                            _ => None,
                        },
                    )?;
            if sensors.contains(&sensor) {
                let what = key.trim_end_matches('s');
                return Err(table.source.error(
                    name.span,
                    format!("the {what} `{}` is there twice", name.value),
                ));
            }
            sensors.push(sensor);
        }
        Ok(Some(sensors))
    }
}
