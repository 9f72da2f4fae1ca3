//! XML as a tree of its own, with files that it includes.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Elements within elements that are followed.
const MOST_DEPTH: usize = 100;
/// Files that one file may include.
const MOST_FILES: usize = 100;
/// Largest file, bytes.
const MOST_BYTES: u64 = 16 << 20;

/// Place of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// File.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: usize,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}", self.file.display(), self.line)
    }
}

/// One element.
#[derive(Clone, Debug)]
pub struct Node {
    /// Tag.
    pub tag: String,
    /// Attributes in the file's order.
    pub attributes: Vec<(String, String)>,
    /// Elements in it.
    pub inside: Vec<Node>,
    /// Its place.
    pub place: Place,
}

impl Node {
    /// Text of an attribute.
    pub fn get(&self, key: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|(name, _)| name == key)?;
        Some(found.1.trim())
    }

    /// Elements of a tag.
    pub fn all<'a>(&'a self, tag: &'a str) -> impl Iterator<Item = &'a Self> {
        self.inside.iter().filter(move |node| node.tag == tag)
    }

    /// First element of a tag.
    pub fn first(&self, tag: &str) -> Option<&Self> {
        self.inside.iter().find(|node| node.tag == tag)
    }

    /// An error at its place.
    pub fn error(&self, message: impl Into<String>) -> Error {
        Error::file(&self.place.file, message).at(self.place.line, 1)
    }

    /// Tag and name, as `joint "elbow"`.
    pub fn called(&self) -> String {
        match self.get("name").or_else(|| self.get("class")) {
            Some(name) => format!("{} \"{name}\"", self.tag),
            None => self.tag.clone(),
        }
    }
}

/// Root of a file, with the elements of included files in the places of their `include`.
///
/// # Errors
/// `Read`; `File` for what is no XML, and for includes or elements without end.
pub fn load(path: &Path) -> Result<Node> {
    let mut included = Included {
        folder: path.parent().unwrap_or(Path::new("")).to_owned(),
        files: 0,
    };
    one(path, &mut included)
}

/// Root of a text that includes no files.
///
/// # Errors
/// As [`load`], and for an include.
pub fn parse(text: &str, path: &Path) -> Result<Node> {
    let mut included = Included {
        folder: PathBuf::new(),
        // As if all files that may be included had been.
        files: MOST_FILES,
    };
    of_text(text, path, &mut included)
}

/// Files that one file includes. Their names are relative to the folder of the first, as MuJoCo has
/// it.
struct Included {
    folder: PathBuf,
    files: usize,
}

fn one(path: &Path, included: &mut Included) -> Result<Node> {
    included.files += 1;
    if included.files > MOST_FILES {
        return Err(Error::file(path, "files include one another without end"));
    }
    let bytes = sinew_files::read(path, MOST_BYTES)?;
    let text = String::from_utf8(bytes).map_err(|_| Error::file(path, "it is no text in UTF-8"))?;
    of_text(&text, path, included)
}

fn of_text(text: &str, path: &Path, included: &mut Included) -> Result<Node> {
    let document = roxmltree::Document::parse(text).map_err(|error| {
        let place = error.pos();
        Error::file(path, format!("it is no XML: {error}"))
            .at(place.row as usize, place.col as usize)
    })?;
    let mut lines = Lines::new(text);
    node(document.root_element(), path, &mut lines, included, 0)
}

/// Lines of places that are asked for in the file's order.
struct Lines<'a> {
    text: &'a [u8],
    at: usize,
    line: usize,
}

impl<'a> Lines<'a> {
    fn new(text: &'a str) -> Self {
        Self {
            text: text.as_bytes(),
            at: 0,
            line: 1,
        }
    }

    fn of(&mut self, byte: usize) -> usize {
        let passed = self.text.get(self.at..byte).unwrap_or_default();
        self.line += passed.iter().filter(|byte| **byte == b'\n').count();
        self.at = self.at.max(byte);
        self.line
    }
}

fn node(
    element: roxmltree::Node,
    path: &Path,
    lines: &mut Lines,
    included: &mut Included,
    depth: usize,
) -> Result<Node> {
    let place = Place {
        file: path.to_owned(),
        line: lines.of(element.range().start),
    };
    if depth > MOST_DEPTH {
        let error = Error::file(path, "elements within elements without end");
        return Err(error.at(place.line, 1));
    }
    let attributes = element.attributes();
    let attributes = attributes.map(|a| (a.name().to_owned(), a.value().to_owned()));
    let mut made = Node {
        tag: element.tag_name().name().to_owned(),
        attributes: attributes.collect(),
        inside: Vec::new(),
        place,
    };
    for child in element.children().filter(roxmltree::Node::is_element) {
        let inner = node(child, path, lines, included, depth + 1)?;
        if inner.tag != "include" {
            made.inside.push(inner);
            continue;
        }
        let Some(file) = inner.get("file") else {
            return Err(inner.error("`include` names no file"));
        };
        let file = included.folder.join(file);
        made.inside.extend(one(&file, included)?.inside);
    }
    Ok(made)
}
