//! One source file as the graph sees it: modules, imports, paths, definitions. What is compiled for
//! tests alone is left out.

use std::collections::BTreeSet;

use super::tokens::{Token, tokens};

/// A path of a source file, with the inline modules around it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mention {
    /// Inline modules of the file that enclose the path.
    pub inside: Vec<String>,
    pub segments: Vec<String>,
    pub line: usize,
}

/// `use PATH as NAME`, one for each leaf of a group.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Import {
    pub path: Mention,
    /// The name that it brings; `*` where it brings all.
    pub name: String,
    /// A name handed on, `pub use`.
    pub public: bool,
}

/// `mod NAME;`
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Child {
    pub inside: Vec<String>,
    pub name: String,
    /// The file that an attribute `path` names.
    pub path: Option<String>,
}

#[derive(Debug, Default)]
pub struct File {
    pub children: Vec<Child>,
    pub imports: Vec<Import>,
    pub paths: Vec<Mention>,
    /// Inline modules, each by the names from the file down.
    pub inline: BTreeSet<Vec<String>>,
    /// Names of items, each with the inline modules around it.
    pub items: BTreeSet<(Vec<String>, String)>,
    /// Macros that `#[macro_export]` puts at the top of the crate.
    pub macros: BTreeSet<String>,
}

/// Words in front of the name of an item.
const DEFINES: &[&str] = &[
    "fn",
    "struct",
    "enum",
    "union",
    "trait",
    "type",
    "const",
    "static",
    "macro_rules",
];

pub fn read(source: &str) -> File {
    let tokens = tokens(source);
    let mut reader = Reader {
        tokens: &tokens,
        at: 0,
        file: File::default(),
        inside: Vec::new(),
        depth: 0,
        opened: Vec::new(),
        path_attribute: None,
        exported: false,
    };
    while reader.at < tokens.len() {
        reader.step();
    }
    reader.file
}

struct Reader<'a> {
    tokens: &'a [Token],
    at: usize,
    file: File,
    inside: Vec<String>,
    depth: usize,
    /// Depth of braces at which each enclosing inline module was opened.
    opened: Vec<usize>,
    path_attribute: Option<String>,
    exported: bool,
}

impl Reader<'_> {
    fn text(&self, ahead: usize) -> &str {
        self.tokens
            .get(self.at + ahead)
            .map_or("", |token| token.text.as_str())
    }

    fn step(&mut self) {
        match self.text(0) {
            "#" => self.attribute(),
            "{" => {
                self.depth += 1;
                self.at += 1;
            }
            "}" => {
                self.depth = self.depth.saturating_sub(1);
                if self.opened.last() == Some(&self.depth) {
                    self.opened.pop();
                    self.inside.pop();
                }
                self.at += 1;
            }
            "mod" if self.is_word(1) && matches!(self.text(2), ";" | "{") => self.module(),
            "use" if self.is_word(1) || matches!(self.text(1), "{" | "::") => self.import(),
            "pub" if self.text(1) == "(" => {
                // pub(in path): a path that nothing depends on.
                self.at = self.closing(self.at + 1) + 1;
            }
            word if DEFINES.contains(&word) => self.definition(),
            _ if self.is_word(0) => self.path(),
            _ => self.at += 1,
        }
    }

    fn is_word(&self, ahead: usize) -> bool {
        (self.tokens.get(self.at + ahead)).is_some_and(Token::is_word)
    }

    /// An attribute; the item behind one that asks for tests is left out whole.
    fn attribute(&mut self) {
        let inner = self.text(1) == "!";
        let open = self.at + if inner { 2 } else { 1 };
        if self.tokens.get(open).is_none_or(|token| !token.is("[")) {
            self.at += 1;
            return;
        }
        let close = self.closing(open);
        let words: Vec<&str> = (self.tokens[open..close].iter())
            .map(|token| token.text.as_str())
            .collect();
        let cfg = words.get(1) == Some(&"cfg");
        let tests = (cfg && words.contains(&"test") && !words.contains(&"not"))
            || matches!(words[..], ["[", "test"]);
        if words.get(1) == Some(&"path") {
            let file = words.last().map(|word| word.trim_matches('"').to_string());
            self.path_attribute = file;
        }
        self.exported |= words.get(1) == Some(&"macro_export");
        self.at = close + 1;
        if tests && inner {
            self.at = self.tokens.len();
        } else if tests {
            self.skip_item();
        }
    }

    /// Index of what closes the bracket at `open`.
    fn closing(&self, open: usize) -> usize {
        let mut depth = 0_usize;
        for (at, token) in self.tokens.iter().enumerate().skip(open) {
            match token.text.as_str() {
                "(" | "[" | "{" => depth += 1,
                ")" | "]" | "}" => {
                    depth -= 1;
                    if depth == 0 {
                        return at;
                    }
                }
                _ => {}
            }
        }
        self.tokens.len().saturating_sub(1)
    }

    /// Goes behind the item that begins here, its further attributes included.
    fn skip_item(&mut self) {
        self.path_attribute = None;
        while self.text(0) == "#" && self.text(1) == "[" {
            self.at = self.closing(self.at + 1) + 1;
        }
        // These end with a semicolon, whatever braces they hold; others with their braces.
        let head: Vec<&str> = (0..4).map(|ahead| self.text(ahead)).collect();
        let plain = head
            .iter()
            .position(|word| matches!(*word, "use" | "static" | "let"));
        let constant = head.iter().position(|word| *word == "const");
        let to_semicolon =
            plain.is_some() || constant.is_some_and(|at| !matches!(head.get(at + 1), Some(&"fn")));
        while self.at < self.tokens.len() {
            match self.text(0) {
                ";" => {
                    self.at += 1;
                    return;
                }
                // An arm, a field or an argument: the bracket belongs to what is around it.
                "}" | ")" | "]" => return,
                "," => {
                    self.at += 1;
                    return;
                }
                "{" => {
                    self.at = self.closing(self.at) + 1;
                    if !to_semicolon {
                        return;
                    }
                }
                "(" | "[" => self.at = self.closing(self.at) + 1,
                "<" => {
                    // The commas of generics are no end.
                    let mut depth = 0_i32;
                    while self.at < self.tokens.len() {
                        let text = self.text(0).to_string();
                        depth += match text.as_str() {
                            "<" => 1,
                            ">" if self.at > 0 && !self.tokens[self.at - 1].is("-") => -1,
                            _ => 0,
                        };
                        if depth <= 0 || matches!(text.as_str(), "{" | ";") {
                            break;
                        }
                        self.at += 1;
                    }
                    if self.text(0) == ">" {
                        self.at += 1;
                    }
                }
                _ => self.at += 1,
            }
        }
    }

    fn module(&mut self) {
        let name = self.text(1).to_string();
        let path = self.path_attribute.take();
        if self.text(2) == ";" {
            let inside = self.inside.clone();
            self.file.children.push(Child { inside, name, path });
        } else {
            self.opened.push(self.depth);
            self.inside.push(name);
            self.file.inline.insert(self.inside.clone());
            self.depth += 1;
        }
        self.at += 3;
    }

    fn definition(&mut self) {
        let word = self.text(0).to_string();
        // macro_rules! name, static mut NAME, fn name
        let ahead = match (word.as_str(), self.text(1)) {
            ("macro_rules", "!") | ("static", "mut") => 2,
            // The word behind it defines.
            ("const", "fn" | "unsafe" | "async" | "extern") => {
                self.at += 1;
                return;
            }
            _ => 1,
        };
        if self.is_word(ahead) {
            let name = self.text(ahead).to_string();
            if word == "macro_rules" && self.exported {
                self.file.macros.insert(name.clone());
            }
            // Only what stands at the top of a module can be imported.
            if self.opened.last().map_or(0, |depth| depth + 1) == self.depth {
                self.file.items.insert((self.inside.clone(), name));
            }
            self.at += ahead + 1;
        } else {
            self.at += 1;
        }
        self.exported = false;
    }

    fn import(&mut self) {
        let before = self
            .at
            .checked_sub(1)
            .map(|at| self.tokens[at].text.as_str());
        // The bracket is that of `pub(crate) use`.
        let public = matches!(before, Some("pub" | ")"));
        self.at += 1;
        self.tree(&mut Vec::new(), public);
    }

    /// One branch of an import, from its first word up to the comma or the bracket that ends it.
    fn tree(&mut self, stem: &mut Vec<String>, public: bool) {
        let depth = stem.len();
        let line = self.tokens.get(self.at).map_or(0, |token| token.line);
        while self.at < self.tokens.len() {
            match self.text(0) {
                "::" => self.at += 1,
                "{" => {
                    self.at += 1;
                    while !matches!(self.text(0), "}" | "") {
                        self.tree(stem, public);
                        if self.text(0) == "," {
                            self.at += 1;
                        }
                    }
                    self.at += 1;
                    stem.truncate(depth);
                    return;
                }
                "*" => {
                    self.leaf(stem, "*".into(), line, public);
                    self.at += 1;
                    stem.truncate(depth);
                    return;
                }
                "as" => {
                    let name = self.text(1).to_string();
                    self.leaf(stem, name, line, public);
                    self.at += 2;
                    stem.truncate(depth);
                    return;
                }
                "$" => self.at += 1,
                _ if self.is_word(0) => {
                    let word = self.text(0).to_string();
                    if word != "self" || stem.is_empty() {
                        stem.push(word);
                    }
                    self.at += 1;
                }
                _ => {
                    let name = stem.last().cloned().unwrap_or_default();
                    self.leaf(stem, name, line, public);
                    stem.truncate(depth);
                    return;
                }
            }
        }
    }

    fn leaf(&mut self, segments: &[String], name: String, line: usize, public: bool) {
        let inside = self.inside.clone();
        self.file.imports.push(Import {
            path: Mention {
                inside,
                segments: segments.to_vec(),
                line,
            },
            name,
            public,
        });
    }

    /// A path of at least two words: `fit::score`, `crate::fit::score::<f64>`.
    fn path(&mut self) {
        let line = self.tokens[self.at].line;
        let field =
            self.at > 0 && (self.tokens[self.at - 1].is(".") || self.tokens[self.at - 1].is("::"));
        let mut segments = vec![self.text(0).to_string()];
        self.at += 1;
        while self.text(0) == "::" && self.is_word(1) {
            segments.push(self.text(1).to_string());
            self.at += 2;
        }
        if segments.len() > 1 && !field {
            let inside = self.inside.clone();
            self.file.paths.push(Mention {
                inside,
                segments,
                line,
            });
        }
    }
}
