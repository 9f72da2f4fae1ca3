//! Learned laws of springs and dampers: the `[[law]]` tables of a rig, and law files.

use super::reader::{Source, TableReader};
use super::{Place, Rig, Value};
use crate::effects::Sign;
use crate::error::Error;
use crate::law::{LawKind, LawShape, NUMBERS};
use crate::suggest;
use crate::unit::Motion;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use toml_edit::{Item, TableLike};

/// Name of the file format of a learned law, and its version.
pub const LAW_FORMAT: &str = "sinew-law/1";

/// A learned law as a rig holds it.
#[derive(Clone, Debug)]
pub struct LearnedLaw {
    /// Unique among the laws.
    pub name: String,
    /// Spring or damper.
    pub kind: LawKind,
    /// Metres and newtons, or radians and newton metres.
    pub motion: Motion,
    /// One list of numbers serves both directions.
    pub odd: bool,
    /// Its numbers are zero or more.
    pub monotone: bool,
    /// Largest magnitude of its argument; m, rad, m/s or rad/s.
    pub reach: f64,
    /// Stiffnesses or dampings in even steps: from rest to the reach, or from one reach to the
    /// other where the law is not odd.
    pub numbers: Vec<Value>,
}

/// A law at a component, and the size of the component beside the piece that it was learned on.
#[derive(Clone, Debug)]
pub struct AppliedLaw {
    /// Index of the law.
    pub law: usize,
    /// Times as long.
    pub length: f64,
    /// Times as wide: the area across.
    pub width: f64,
}

impl LearnedLaw {
    /// Its shape on the piece that it was learned on.
    pub fn shape(&self) -> LawShape {
        LawShape {
            kind: self.kind,
            odd: self.odd,
            reach: self.reach,
            length: 1.0,
            width: 1.0,
        }
    }

    /// Values that its numbers may have.
    pub(crate) fn sign(&self) -> Sign {
        if self.monotone {
            Sign::NonNegative
        } else {
            Sign::Any
        }
    }

    /// Its numbers without what a fit knows about them.
    pub fn values(&self) -> Vec<f64> {
        self.numbers.iter().map(|number| number.value).collect()
    }
}

/// Keys of a law besides its name.
const KEYS: &[&str] = &["motion", "odd", "monotone", "reach", "stiffness", "damping"];

/// Every `[[law]]`, in file order.
pub(super) fn read_laws(tables: &[TableReader]) -> Result<Vec<LearnedLaw>, Error> {
    let mut laws: Vec<LearnedLaw> = Vec::new();
    for table in tables {
        table.allow(&[&["name"], KEYS].concat())?;
        let name = table.text("name")?;
        if laws.iter().any(|known| known.name == name.value) {
            let message = format!("a law `{}` is there twice", name.value);
            return Err(table.error_at("name", message));
        }
        let table = table.called(format!("law `{}`", name.value));
        laws.push(read_law(&table, name.value)?);
    }
    Ok(laws)
}

fn read_law(table: &TableReader, name: &str) -> Result<LearnedLaw, Error> {
    let kind = match (table.has("stiffness"), table.has("damping")) {
        (true, false) => LawKind::Spring,
        (false, true) => LawKind::Damper,
        (false, false) => {
            let expected = "a list of numbers; `damping` where it is of a damper";
            return Err(table.missing("stiffness", expected));
        }
        (true, true) => {
            let message = format!("{} has `stiffness` and `damping`", table.what);
            return Err(table.error_at("damping", message).helped(
                "a law is of a spring or of a damper: write the second one as a law of its own",
            ));
        }
    };
    let motions = [("slide", Motion::Slide), ("hinge", Motion::Hinge)];
    let odd = table.flag("odd")?.unwrap_or(true);
    let monotone = table.flag("monotone")?.unwrap_or(true);
    if kind == LawKind::Damper && !monotone {
        let message = format!("{}: a damping that is not monotone", table.what);
        return Err(table.error_at("monotone", message).helped(
            "it might put energy in; friction that falls with the speed is a `stribeck_friction`",
        ));
    }
    let reach = table.number("reach", Sign::Positive)?;
    let reach = reach.ok_or_else(|| table.missing("reach", "a number more than zero"))?;
    let mut law = LearnedLaw {
        name: name.to_owned(),
        kind,
        motion: table.word("motion", &motions)?.unwrap_or(Motion::Slide),
        odd,
        monotone,
        reach,
        numbers: Vec::new(),
    };
    let numbers = table.parameters(kind.key(), law.sign())?;
    let [fewest, most] = NUMBERS;
    let fits = if odd {
        (fewest..=most).contains(&numbers.len())
    } else {
        numbers.len() % 2 == 1 && (2 * fewest - 1..2 * most).contains(&numbers.len())
    };
    if !fits {
        let wanted = if odd {
            format!("{fewest} to {most} numbers, from rest to the reach")
        } else {
            format!(
                "an odd count from {} to {}, from minus the reach to the reach, rest in the middle",
                2 * fewest - 1,
                2 * most - 1
            )
        };
        let (key, count) = (kind.key(), numbers.len());
        let message = format!(
            "`{key}` of {}: expected {wanted}, found {count}",
            table.what
        );
        return Err(table.error_at(key, message));
    }
    law.numbers = numbers;
    Ok(law)
}

impl TableReader<'_> {
    /// A list of parameters, each a number or `{ value, min, max }`.
    fn parameters(&self, key: &'static str, sign: Sign) -> Result<Vec<Value>, Error> {
        let expected = "a list of numbers";
        let items = self.array(key, expected)?.unwrap_or_default();
        let read = |(index, item): (usize, &Item)| self.element((key, index), item, sign);
        items.iter().enumerate().map(read).collect()
    }
}

/// The law that a spring, a damper or a chain names with `law`, if it names one.
pub(super) fn read_applied(
    table: &TableReader,
    kind: LawKind,
    motion: Motion,
    rig: &Rig,
) -> Result<Option<AppliedLaw>, Error> {
    let Some(text) = table.optional_text("law")? else {
        for key in ["law_length", "law_width"] {
            if table.has(key) {
                let message = format!("`{key}` of {} without `law`", table.what);
                return Err(table
                    .error_at(key, message)
                    .helped("it is a size beside that of the piece that a law was learned on"));
            }
        }
        return Ok(None);
    };
    if table.has(kind.key()) {
        let (key, what) = (kind.key(), &table.what);
        let message = format!("{what} has `{key}` and `law`");
        return Err(table
            .error_at(key, message)
            .helped(format!("the law is its whole force: leave `{key}` out")));
    }
    let refuse = |message: String| table.source.error(text.span.clone(), message);
    let Some(index) = rig.laws.iter().position(|law| law.name == text.value) else {
        let names: Vec<&str> = rig.laws.iter().map(|law| law.name.as_str()).collect();
        let message = format!("`law` of {}: there is no law `{}`", table.what, text.value);
        return Err(refuse(message).helped(suggest::help(text.value, "laws", &names)));
    };
    let law = &rig.laws[index];
    if law.kind != kind {
        let message = format!(
            "`law` of {}: `{}` is a law of a {}",
            table.what,
            text.value,
            law.kind.noun()
        );
        return Err(refuse(message).helped(format!(
            "a {} takes a law with `{}`",
            kind.noun(),
            kind.key()
        )));
    }
    if law.motion != motion {
        let word = |motion| match motion {
            Motion::Slide => "a slide",
            Motion::Hinge => "a hinge",
        };
        let message = format!(
            "`law` of {}: `{}` was learned on {}, and this is on {}",
            table.what,
            text.value,
            word(law.motion),
            word(motion)
        );
        return Err(
            refuse(message).helped("newtons over metres are not newton metres over radians")
        );
    }
    let size = |key| Ok(table.number(key, Sign::Positive)?.unwrap_or(1.0));
    Ok(Some(AppliedLaw {
        law: index,
        length: size("law_length")?,
        width: size("law_width")?,
    }))
}

/// Tables whose `law` may name a file.
const USERS: [&str; 3] = ["spring", "damper", "chain"];

/// The text of a rig with every law file that it names written into it as a `[[law]]` at its end,
/// so that the rig can be written anywhere; lines before keep their numbers.
///
/// # Errors
/// A law file that cannot be read, or is not sound, with its own lines.
pub(super) fn with_files<'a>(source: &Source<'a>) -> Result<Cow<'a, str>, Error> {
    let text = source.text();
    if !text.contains("law") {
        return Ok(Cow::Borrowed(text));
    }
    let document = source.document()?;
    let root = TableReader::root(source, document.as_table());
    let mut known: Vec<String> = Vec::new();
    // A table that is no array of tables is refused where it is read.
    for table in root.tables("law").unwrap_or_default() {
        known.extend(
            table
                .optional_text("name")
                .ok()
                .flatten()
                .map(|name| name.value.to_owned()),
        );
    }
    let mut added = String::new();
    for table in USERS
        .iter()
        .flat_map(|users| root.tables(users).unwrap_or_default())
    {
        let Ok(Some(name)) = table.optional_text("law") else {
            continue;
        };
        if known.iter().any(|law| law == name.value) || !is_file(name.value) {
            continue;
        }
        let path = beside(source.file(), name.value);
        let law = match read(&path) {
            Ok(text) => law_table(&text, &path.display().to_string(), name.value)?,
            Err(error) => {
                let message = format!(
                    "`law` of {}: cannot read {}: {error}",
                    table.what,
                    path.display()
                );
                let refused = source.error(name.span.clone(), message);
                return Err(match suggest::nearest_file(&path) {
                    Some(help) => refused.helped(help),
                    None => refused
                        .helped("`law` names a `[[law]]` of this rig or a file of `sinew learn`"),
                });
            }
        };
        added.push_str(&law);
        known.push(name.value.to_owned());
    }
    if added.is_empty() {
        return Ok(Cow::Borrowed(text));
    }
    if document.as_table().get("law").is_some_and(Item::is_value) {
        let message = "law files beside an inline list of laws";
        return Err(root
            .error_at("law", message)
            .helped("write each law as a table `[[law]]` of its own"));
    }
    let line = if text.ends_with('\n') { "" } else { "\n" };
    Ok(Cow::Owned(format!("{text}{line}{added}")))
}

/// A name with a dot or a slash is a file: no law of a rig has them but one that came from a file.
fn is_file(name: &str) -> bool {
    name.contains(['.', '/', '\\'])
}

/// Text of a regular file: a device may have no end.
fn read(path: &Path) -> std::io::Result<String> {
    if std::fs::metadata(path)?.is_file() {
        std::fs::read_to_string(path)
    } else {
        Err(std::io::Error::other("it is no regular file"))
    }
}

/// A path relative to the folder of the rig.
fn beside(rig: &str, path: &str) -> PathBuf {
    Path::new(rig).parent().unwrap_or(Path::new("")).join(path)
}

/// A law file as a table of a rig.
fn law_table(text: &str, file: &str, name: &str) -> Result<String, Error> {
    let source = Source::new(file, text);
    let document = source.document()?;
    let law = read_law_file(&source, document.as_table())?;
    let numbers: Vec<String> = law.values().iter().map(|value| number(*value)).collect();
    let motion = match law.motion {
        Motion::Slide => "slide",
        Motion::Hinge => "hinge",
    };
    Ok(format!(
        "\n[[law]]\nname = {}\nmotion = \"{motion}\"\nodd = {}\nmonotone = {}\nreach = {}\n\
         {} = [{}]\n",
        toml_edit::Value::from(name),
        law.odd,
        law.monotone,
        number(law.reach),
        law.kind.key(),
        numbers.join(", ")
    ))
}

/// A number that TOML reads back to the bit.
fn number(value: f64) -> String {
    toml_edit::Value::from(value).to_string()
}

fn read_law_file(source: &Source, table: &dyn TableLike) -> Result<LearnedLaw, Error> {
    let root = TableReader::root(source, table).called("a law".to_owned());
    let expected = format!("a law begins with `format = \"{LAW_FORMAT}\"`");
    if !root.has("format") {
        return Err(source
            .error(None, "the law lacks `format`")
            .helped(expected));
    }
    let format = root.text("format")?;
    if format.value != LAW_FORMAT {
        let message = format!("unknown format `{}`", format.value);
        return Err(source.error(format.span, message).helped(expected));
    }
    root.allow(&[&["format", "name", "learned"], KEYS].concat())?;
    let name = root.text("name")?.value;
    let law = read_law(&root, name)?;
    if let Some(free) = law.numbers.iter().find(|number| number.free) {
        let line = free.place.line;
        return Err(Error {
            line: Some(line),
            ..source.error(
                None,
                format!("`{}` of a law: expected numbers", law.kind.key()),
            )
        }
        .helped("a law file holds what was learned; free numbers stand in a rig's `[[law]]`"));
    }
    Ok(law)
}

impl LearnedLaw {
    /// Reads the text of a law file; `file` is its name in errors.
    ///
    /// # Errors
    /// The first thing that is wrong, with its line and the fix.
    pub fn parse(text: &str, file: &str) -> Result<Self, Error> {
        let source = Source::new(file, text);
        let document = source.document()?;
        read_law_file(&source, document.as_table())
    }
}

impl Rig {
    /// Stiffness of a spring; of one with a learned law the largest within its reach, N/m or
    /// N m/rad.
    pub fn steepest_stiffness(&self, spring: usize) -> f64 {
        let spring = &self.springs[spring];
        self.steepest(spring.law.as_ref(), f64::INFINITY)
            .unwrap_or(spring.stiffness.value)
    }

    /// Stiffness of a spring near its rest, N/m or N m/rad.
    pub fn stiffness_at_rest(&self, spring: usize) -> f64 {
        let spring = &self.springs[spring];
        self.steepest(spring.law.as_ref(), 0.0)
            .unwrap_or(spring.stiffness.value)
    }

    /// Damping of a damper; of one with a learned law the largest within its reach, N s/m or
    /// N m s/rad.
    pub fn steepest_damping(&self, damper: usize) -> f64 {
        let damper = &self.dampers[damper];
        self.steepest(damper.law.as_ref(), f64::INFINITY)
            .unwrap_or(damper.damping.value)
    }

    /// Damping of a damper near rest, N s/m or N m s/rad.
    pub fn damping_at_rest(&self, damper: usize) -> f64 {
        let damper = &self.dampers[damper];
        self.steepest(damper.law.as_ref(), 0.0)
            .unwrap_or(damper.damping.value)
    }

    /// Largest slope of a law up to `most`, at most its reach.
    fn steepest(&self, applied: Option<&AppliedLaw>, most: f64) -> Option<f64> {
        let applied = applied?;
        let law = &self.laws[applied.law];
        let shape = LawShape {
            length: applied.length,
            width: applied.width,
            ..law.shape()
        };
        Some(shape.steepest(&law.values(), most.min(shape.met())))
    }
}

impl Place {
    /// The place of one number in a list.
    pub(super) fn in_list(mut self, list: &'static str, index: usize) -> Self {
        self.within = Some((list, index));
        "value".clone_into(&mut self.key);
        self
    }
}
