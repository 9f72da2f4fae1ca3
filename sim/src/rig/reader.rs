//! Reading TOML tables with their places: typed keys in, errors with line, column and suggestion
//! out.

use super::{Place, Value};
use crate::effects::Sign;
use crate::error::Error;
use crate::suggest;
use std::ops::Range;
use toml_edit::{Document, Item, TableLike};

/// Bytes of the file.
pub type Span = Option<Range<usize>>;

/// The text of a file and its name.
pub(super) struct Source<'a> {
    file: &'a str,
    text: &'a str,
}

impl<'a> Source<'a> {
    pub(super) fn new(file: &'a str, text: &'a str) -> Self {
        Self { file, text }
    }

    pub(super) fn file(&self) -> &'a str {
        self.file
    }

    pub fn text(&self) -> &'a str {
        self.text
    }

    /// The TOML document with its spans.
    pub(super) fn document(&self) -> Result<Document<&'a str>, Error> {
        if self.text.trim().is_empty() {
            return Err(self.error(None, "the rig is empty").helped(format!(
                "a rig begins with `format = \"{}\"`, a name and at least one [[body]]",
                super::FORMAT
            )));
        }
        Document::parse(self.text).map_err(|error| {
            let message = error.message().trim().replace('\n', ", ");
            let refused = self.error(error.span(), format!("not valid TOML: {message}"));
            // The likeliest other file: a mechanism of MuJoCo or ROS.
            let is_of = |root: &str| self.text.contains(root);
            if is_of("<mujoco") {
                refused.helped("this is MJCF: `sinew new --mjcf FILE` writes a rig of it")
            } else if is_of("<robot") {
                refused.helped("this is URDF: `sinew new --urdf FILE` writes a rig of it")
            } else {
                refused
            }
        })
    }

    /// An error about a part of the text; about its beginning where the part is not known.
    pub(super) fn error(&self, span: Span, message: impl Into<String>) -> Error {
        let (line, column) = self.position(span.map_or(0, |span| span.start));
        Error {
            file: self.file.to_owned(),
            line: Some(line),
            column: Some(column),
            message: message.into(),
            help: None,
        }
    }

    /// Line and column, from 1, of a byte.
    fn position(&self, byte: usize) -> (usize, usize) {
        let mut end = byte.min(self.text.len());
        while !self.text.is_char_boundary(end) {
            end -= 1;
        }
        let before = &self.text[..end];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let line = before.bytes().filter(|&b| b == b'\n').count() + 1;
        (line, before[line_start..].chars().count() + 1)
    }
}

impl Error {
    /// With what would be right.
    pub(super) fn helped(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// A text with its place.
#[derive(Clone, Debug)]
pub struct Spanned<T> {
    /// The text.
    pub value: T,
    /// Its bytes in the file, where they are known.
    pub span: Span,
}

/// One table of a rig file: typed keys out, errors with line, column and suggestion.
pub struct TableReader<'a> {
    pub(super) source: &'a Source<'a>,
    /// Name in errors: "body `motor`".
    pub(super) what: String,
    table: &'a dyn TableLike,
    pub(super) span: Span,
    pub(super) array: &'static str,
    index: usize,
    pub(super) within: Option<(&'static str, usize)>,
}

impl<'a> TableReader<'a> {
    pub(super) fn root(source: &'a Source<'a>, table: &'a dyn TableLike) -> Self {
        Self {
            source,
            what: "a rig".to_owned(),
            table,
            span: None,
            array: "",
            index: 0,
            within: None,
        }
    }

    /// The same table, called something else in errors.
    pub(super) fn called(&self, what: String) -> Self {
        Self {
            source: self.source,
            what,
            table: self.table,
            span: self.span.clone(),
            array: self.array,
            index: self.index,
            within: self.within,
        }
    }

    /// An error about a key's value, or about the table where the key is absent.
    pub fn error_at(&self, key: &str, message: impl Into<String>) -> Error {
        let span = self.table.get(key).and_then(Item::span);
        self.source
            .error(span.or_else(|| self.span.clone()), message)
    }

    /// Refuses every key that is not one of `known`.
    pub fn allow(&self, known: &[&str]) -> Result<(), Error> {
        for (key, item) in self.table.iter() {
            if !known.contains(&key) {
                let span = self.table.key(key).and_then(|key| key.span());
                return Err(self
                    .source
                    .error(
                        span.or_else(|| item.span()).or_else(|| self.span.clone()),
                        format!("unknown key `{key}` in {}", self.what),
                    )
                    .helped(suggest::help(key, "known keys", known)));
            }
        }
        Ok(())
    }

    fn item(&self, key: &str) -> Option<&'a Item> {
        self.table.get(key).filter(|item| !item.is_none())
    }

    /// True where the key is there.
    pub fn has(&self, key: &str) -> bool {
        self.item(key).is_some()
    }

    /// An error about a key that is absent.
    pub fn missing(&self, key: &str, expected: &str) -> Error {
        self.source.error(
            self.span.clone(),
            format!("{} lacks `{key}` ({expected})", self.what),
        )
    }

    fn wrong_type(&self, key: &str, item: &Item, expected: &str) -> Error {
        self.error_at(
            key,
            format!(
                "`{key}` of {}: expected {expected}, found {}",
                self.what,
                article(item.type_name())
            ),
        )
    }

    /// A text, if the key is there.
    pub fn optional_text(&self, key: &str) -> Result<Option<Spanned<&'a str>>, Error> {
        let Some(item) = self.item(key) else {
            return Ok(None);
        };
        let text = item
            .as_str()
            .ok_or_else(|| self.wrong_type(key, item, "a text in quotes"))?;
        if text.trim().is_empty() {
            return Err(self.error_at(key, format!("`{key}` of {} is empty", self.what)));
        }
        Ok(Some(Spanned {
            value: text,
            span: item.span(),
        }))
    }

    /// A text.
    pub fn text(&self, key: &str) -> Result<Spanned<&'a str>, Error> {
        self.optional_text(key)?
            .ok_or_else(|| self.missing(key, "a text in quotes"))
    }

    /// One of a few words, each with what it stands for.
    pub fn word<T: Copy>(&self, key: &str, words: &[(&str, T)]) -> Result<Option<T>, Error> {
        let Some(text) = self.optional_text(key)? else {
            return Ok(None);
        };
        let names: Vec<&str> = words.iter().map(|&(name, _)| name).collect();
        match words.iter().find(|&&(name, _)| name == text.value) {
            Some(&(_, meaning)) => Ok(Some(meaning)),
            None => Err(self
                .source
                .error(
                    text.span,
                    format!("`{key}` of {}: unknown word `{}`", self.what, text.value),
                )
                .helped(suggest::help(text.value, "expected one of", &names))),
        }
    }

    /// As [`TableReader::word`], required.
    pub fn required_word<T: Copy>(&self, key: &str, words: &[(&str, T)]) -> Result<T, Error> {
        let names: Vec<&str> = words.iter().map(|&(name, _)| name).collect();
        self.word(key, words)?
            .ok_or_else(|| self.missing(key, &names.join(" or ")))
    }

    /// True or false, if the key is there.
    pub fn flag(&self, key: &str) -> Result<Option<bool>, Error> {
        self.item(key)
            .map(|item| {
                item.as_bool()
                    .ok_or_else(|| self.wrong_type(key, item, "true or false"))
            })
            .transpose()
    }

    /// A finite number, if the key is there.
    pub fn number(&self, key: &str, sign: Sign) -> Result<Option<f64>, Error> {
        self.item(key)
            .map(|item| self.checked(key, item, sign, "a number"))
            .transpose()
    }

    /// A whole number between two bounds, if the key is there.
    pub fn count(&self, key: &str, from: usize, to: usize) -> Result<Option<usize>, Error> {
        self.item(key)
            .map(|item| {
                let expected = format!("a whole number from {from} to {to}");
                let number = item
                    .as_integer()
                    .ok_or_else(|| self.wrong_type(key, item, &expected))?;
                usize::try_from(number)
                    .ok()
                    .filter(|count| (from..=to).contains(count))
                    .ok_or_else(|| {
                        self.error_at(
                            key,
                            format!(
                                "`{key}` of {}: expected {expected}, found {number}",
                                self.what
                            ),
                        )
                    })
            })
            .transpose()
    }

    /// The elements of an array, if the key is there.
    pub(super) fn array(&self, key: &str, expected: &str) -> Result<Option<Vec<Item>>, Error> {
        self.item(key)
            .map(|item| {
                let array = item
                    .as_array()
                    .ok_or_else(|| self.wrong_type(key, item, expected))?;
                Ok(array.iter().cloned().map(Item::Value).collect())
            })
            .transpose()
    }

    /// A list of texts, if the key is there.
    pub fn texts(&self, key: &str) -> Result<Option<Vec<Spanned<String>>>, Error> {
        let expected = "a list of texts in quotes";
        let Some(items) = self.array(key, expected)? else {
            return Ok(None);
        };
        let texts: Result<Vec<_>, Error> = items
            .iter()
            .map(|item| {
                let text = item
                    .as_str()
                    .ok_or_else(|| self.wrong_type(key, item, expected))?;
                Ok(Spanned {
                    value: text.to_owned(),
                    span: item.span(),
                })
            })
            .collect();
        texts.map(Some)
    }

    /// A list of finite numbers, if the key is there.
    pub fn numbers(&self, key: &str, sign: Sign) -> Result<Option<Vec<f64>>, Error> {
        let Some(items) = self.array(key, "a list of numbers")? else {
            return Ok(None);
        };
        let numbers: Result<Vec<f64>, Error> = items
            .iter()
            .map(|item| self.checked(key, item, sign, "a list of numbers"))
            .collect();
        numbers.map(Some)
    }

    /// The number in `item`, refused where it is not finite or of the wrong sign.
    fn checked(&self, key: &str, item: &Item, sign: Sign, expected: &str) -> Result<f64, Error> {
        let number = item
            .as_float()
            // A whole number beyond 2^53 rounds to the nearest f64, as its decimal spelling would.
            .or_else(|| item.as_integer().map(|integer| integer as f64))
            .ok_or_else(|| self.wrong_type(key, item, expected))?;
        let Some(wanted) = sign.wanted(number) else {
            return Ok(number);
        };
        let span = item.span().or_else(|| self.span.clone());
        Err(self.source.error(
            span,
            format!(
                "`{key}` of {}: expected {wanted}, found {number}",
                self.what
            ),
        ))
    }

    /// A parameter, if the key is there: a bare number (held) or `{ value, min, max }` (free).
    pub(super) fn optional_parameter(&self, key: &str, sign: Sign) -> Result<Option<Value>, Error> {
        let item = self.item(key);
        item.map(|item| self.parameter_in(key, item, sign))
            .transpose()
    }

    /// An element of a list of parameters, which is its own place in the file.
    pub(super) fn element(
        &self,
        (list, index): (&'static str, usize),
        item: &Item,
        sign: Sign,
    ) -> Result<Value, Error> {
        let mut value = self.parameter_in(list, item, sign)?;
        let line = |span: std::ops::Range<usize>| self.source.position(span.start).0;
        value.place.line = item.span().map_or(value.place.line, line);
        value.place = value.place.in_list(list, index);
        Ok(value)
    }

    /// The parameter that stands in `item`, the value of a key or a part of it.
    fn parameter_in(&self, key: &str, item: &Item, sign: Sign) -> Result<Value, Error> {
        let expected = "a number or { value = ..., min = ..., max = ... }";
        let Some(table) = item.as_table_like() else {
            let value = self.checked(key, item, sign, expected)?;
            return Ok(self.held(key, value));
        };
        let inner = TableReader {
            source: self.source,
            what: format!("`{key}` of {}", self.what),
            table,
            span: item.span().or_else(|| self.span.clone()),
            array: self.array,
            index: self.index,
            within: self.within,
        };
        inner.allow(&["value", "min", "max", "with", "slope", "per"])?;
        let value = inner
            .number("value", sign)?
            .ok_or_else(|| inner.missing("value", "a number"))?;
        let min = inner.number("min", Sign::Any)?;
        let max = inner.number("max", Sign::Any)?;
        if let (Some(min), Some(max)) = (min, max)
            && min >= max
        {
            return Err(inner.error_at(
                "min",
                format!("{}: min = {min} is not below max = {max}", inner.what),
            ));
        }
        if min.is_some_and(|min| value < min) || max.is_some_and(|max| value > max) {
            return Err(inner.error_at(
                "value",
                format!(
                    "{}: value = {value} lies outside its own min and max",
                    inner.what
                ),
            ));
        }
        Ok(Value {
            value,
            min,
            max,
            free: true,
            with: self.dependence(key, &inner)?,
            per_recording: self.per_recording(key, &inner, value)?,
            place: self.place(key),
        })
    }

    /// A parameter that must be there.
    pub(super) fn parameter(&self, key: &str, sign: Sign) -> Result<Value, Error> {
        self.optional_parameter(key, sign)?
            .ok_or_else(|| self.missing(key, "a number or { value = ... }"))
    }

    /// A parameter with a default, which is held.
    pub(super) fn parameter_or(&self, key: &str, sign: Sign, default: f64) -> Result<Value, Error> {
        Ok(self
            .optional_parameter(key, sign)?
            .unwrap_or_else(|| self.held(key, default)))
    }

    pub(super) fn held(&self, key: &str, value: f64) -> Value {
        Value {
            value,
            min: None,
            max: None,
            free: false,
            with: None,
            per_recording: false,
            place: self.place(key),
        }
    }

    pub(super) fn place(&self, key: &str) -> Place {
        Place {
            table: self.array,
            index: self.index,
            within: self.within,
            key: key.to_owned(),
            slope: false,
            line: self.line(key),
        }
    }

    /// The line of a key's value, from 1; of the table where the key is absent.
    pub fn line(&self, key: &str) -> usize {
        let span = self.table.get(key).and_then(Item::span);
        let span = span.or_else(|| self.span.clone());
        self.source.position(span.map_or(0, |span| span.start)).0
    }

    /// The line of the table itself.
    pub fn own_line(&self) -> usize {
        self.line("")
    }

    /// A single table `[name]`, if it is there.
    pub(super) fn table(&self, name: &'static str) -> Result<Option<TableReader<'a>>, Error> {
        let Some(item) = self.item(name) else {
            return Ok(None);
        };
        let table = item
            .as_table_like()
            .ok_or_else(|| self.wrong_type(name, item, &format!("a table [{name}]")))?;
        Ok(Some(TableReader {
            source: self.source,
            what: format!("[{name}]"),
            table,
            span: item.span(),
            array: name,
            index: 0,
            within: None,
        }))
    }

    /// Every `[[name]]`, in file order; an array of inline tables will do.
    pub(super) fn tables(&self, name: &'static str) -> Result<Vec<TableReader<'a>>, Error> {
        let Some(item) = self.item(name) else {
            return Ok(Vec::new());
        };
        let wrong = |item: &Item| self.wrong_type(name, item, &format!("tables [[{name}]]"));
        let tables: Vec<(&dyn TableLike, Span)> = if let Some(array) = item.as_array_of_tables() {
            array
                .iter()
                .map(|table| (table as &dyn TableLike, table.span()))
                .collect()
        } else if let Some(array) = item.as_array() {
            let inline: Option<Vec<_>> = array
                .iter()
                .map(|value| {
                    let table = value.as_inline_table()?;
                    Some((table as &dyn TableLike, value.span()))
                })
                .collect();
            inline.ok_or_else(|| wrong(item))?
        } else {
            return Err(wrong(item));
        };
        Ok(tables
            .into_iter()
            .enumerate()
            .map(|(index, (table, span))| TableReader {
                source: self.source,
                what: match table.get("name").and_then(Item::as_str) {
                    Some(own) => format!("{name} `{own}`"),
                    None => format!("{name} number {}", index + 1),
                },
                table,
                span,
                array: if self.array.is_empty() {
                    name
                } else {
                    self.array
                },
                index: if self.array.is_empty() {
                    index
                } else {
                    self.index
                },
                within: (!self.array.is_empty()).then_some((name, index)),
            })
            .collect())
    }
}

/// "an array", "a string".
fn article(noun: &str) -> String {
    let vowel = noun.starts_with(['a', 'e', 'i', 'o', 'u']);
    format!("{} {noun}", if vowel { "an" } else { "a" })
}
