//! The module graph of a crate: which file takes what from which.
//!
//! An edge leads to the file that *defines* what is taken. A name that a parent hands on
//! (`pub use fit::Fit;`, or a plain import that a child takes by `super::Fit`) is followed to where
//! it comes from, so that a `mod.rs` that declares and hands on depends on nothing and nothing
//! depends on it. Methods carry no name of a file and are not seen.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::file::{self, File, Import, Mention};

/// Names of the modules from the top of the crate.
pub type ModulePath = Vec<String>;

pub struct Graph {
    pub files: Vec<PathBuf>,
    /// Of each file: its module.
    pub modules: Vec<ModulePath>,
    /// Of each file: the files that it depends on, with the first line that says so and its words.
    pub edges: Vec<BTreeMap<usize, (usize, String)>>,
}

struct Module {
    file: usize,
    /// Modules of the path that are written in the file itself.
    inside: Vec<String>,
}

struct Crate {
    files: Vec<PathBuf>,
    read: Vec<File>,
    tops: Vec<ModulePath>,
    modules: BTreeMap<ModulePath, Module>,
}

/// End of a path.
enum Target {
    Module,
    File(usize),
    /// Another crate, or what no file at the top of a module defines.
    Nowhere,
}

impl Graph {
    /// The graph of the crate whose top file is `top`; `text` gives a file, if there is one.
    ///
    /// # Errors
    /// A module has no file.
    pub fn of_crate(top: &Path, text: &impl Fn(&Path) -> Option<String>) -> Result<Self> {
        let mut all = Crate {
            files: Vec::new(),
            read: Vec::new(),
            tops: Vec::new(),
            modules: BTreeMap::new(),
        };
        let folder = top.parent().context("a source file lies in a folder")?;
        all.add(top.to_path_buf(), folder.to_path_buf(), Vec::new(), text)?;
        let edges = (0..all.files.len()).map(|file| all.edges(file)).collect();
        Ok(Self {
            files: all.files,
            modules: all.tops,
            edges,
        })
    }
}

impl Crate {
    /// Reads a file and the files of its children, which lie in `folder`.
    fn add(
        &mut self,
        path: PathBuf,
        folder: PathBuf,
        module: ModulePath,
        text: &impl Fn(&Path) -> Option<String>,
    ) -> Result<()> {
        let source = text(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let file = self.files.len();
        let read = file::read(&source);
        let children = read.children.clone();
        let inline: Vec<Vec<String>> = (read.inline.iter().cloned()).chain([Vec::new()]).collect();
        self.files.push(path.clone());
        self.read.push(read);
        self.tops.push(module.clone());
        for inside in inline {
            let name = [module.clone(), inside.clone()].concat();
            self.modules.insert(name, Module { file, inside });
        }
        for child in children {
            let name = [
                module.clone(),
                child.inside.clone(),
                vec![child.name.clone()],
            ]
            .concat();
            let within = child.inside.iter().fold(folder.clone(), |f, m| f.join(m));
            let candidates = match &child.path {
                Some(file) => {
                    let here = path.parent().unwrap_or(Path::new("")).join(file);
                    vec![(
                        here.clone(),
                        here.parent().unwrap_or(Path::new("")).to_path_buf(),
                    )]
                }
                None => {
                    let own = within.join(&child.name);
                    vec![
                        (within.join(format!("{}.rs", child.name)), own.clone()),
                        (own.join("mod.rs"), own),
                    ]
                }
            };
            let found = candidates
                .into_iter()
                .find(|(file, _)| text(file).is_some());
            let (file, folder) = found.with_context(|| {
                format!("{}: module {} has no file", path.display(), child.name)
            })?;
            self.add(file, folder, name, text)?;
        }
        Ok(())
    }

    fn edges(&self, file: usize) -> BTreeMap<usize, (usize, String)> {
        let read = &self.read[file];
        let mut edges = BTreeMap::new();
        // A name handed on is no dependency of the file that hands it on.
        let imports = read.imports.iter().filter(|import| !import.public);
        let mentions = imports.map(|import| &import.path).chain(&read.paths);
        for mention in mentions {
            let glob = read
                .imports
                .iter()
                .any(|i| i.name == "*" && i.path == *mention);
            let from = [self.tops[file].clone(), mention.inside.clone()].concat();
            let target = self.resolve(&from, &mention.segments, &mut BTreeSet::new());
            let to = match target {
                Target::File(to) => to,
                // `use super::*` takes what the parent defines, unless the parent defines nothing.
                Target::Module if glob => match self.module_of(&from, mention) {
                    Some(to) if !self.read[to].items.is_empty() => to,
                    _ => continue,
                },
                _ => continue,
            };
            if to != file {
                let said = (mention.line, mention.segments.join("::"));
                edges.entry(to).or_insert(said);
            }
        }
        edges
    }

    fn module_of(&self, from: &[String], mention: &Mention) -> Option<usize> {
        let mut here = from.to_vec();
        for segment in &mention.segments {
            match segment.as_str() {
                "crate" => here.clear(),
                "self" => {}
                "super" => {
                    here.pop();
                }
                name => here.push(name.to_string()),
            }
        }
        self.modules.get(&here).map(|module| module.file)
    }

    /// Follows a path that is written in module `from`.
    fn resolve(
        &self,
        from: &[String],
        segments: &[String],
        seen: &mut BTreeSet<(ModulePath, String)>,
    ) -> Target {
        let mut here = from.to_vec();
        let mut rest = segments;
        match segments.first().map(String::as_str) {
            Some("crate") => {
                here.clear();
                rest = &segments[1..];
            }
            Some("self" | "super") => {
                while let Some(word) = rest
                    .first()
                    .filter(|w| matches!(w.as_str(), "self" | "super"))
                {
                    if word == "super" {
                        here.pop();
                    }
                    rest = &rest[1..];
                }
            }
            _ => {}
        }
        self.follow(here, rest, seen)
    }

    /// Follows names from a module down.
    fn follow(
        &self,
        mut here: ModulePath,
        mut rest: &[String],
        seen: &mut BTreeSet<(ModulePath, String)>,
    ) -> Target {
        while let Some((name, further)) = rest.split_first() {
            let mut below = here.clone();
            below.push(name.clone());
            if self.modules.contains_key(&below) {
                here = below;
                rest = further;
                continue;
            }
            return self.named(&here, name, further, seen);
        }
        Target::Module
    }

    /// The name in a module that is no module below it: an item, an import, or what a glob brings.
    fn named(
        &self,
        here: &ModulePath,
        name: &String,
        further: &[String],
        seen: &mut BTreeSet<(ModulePath, String)>,
    ) -> Target {
        let Some(module) = self.modules.get(here) else {
            return Target::Nowhere;
        };
        if !seen.insert((here.clone(), name.clone())) {
            return Target::Nowhere;
        }
        let file = &self.read[module.file];
        if file.items.contains(&(module.inside.clone(), name.clone())) {
            return Target::File(module.file);
        }
        let here_only = |import: &&Import| import.path.inside == module.inside;
        for import in file.imports.iter().filter(here_only) {
            // `use name;` brings a crate.
            if import.name == *name && import.path.segments != [name.as_str()] {
                let path = [import.path.segments.clone(), further.to_vec()].concat();
                return self.resolve(here, &path, seen);
            }
        }
        for import in file
            .imports
            .iter()
            .filter(here_only)
            .filter(|i| i.name == "*")
        {
            let path = [
                import.path.segments.clone(),
                vec![name.clone()],
                further.to_vec(),
            ]
            .concat();
            if let Target::File(file) = self.resolve(here, &path, seen) {
                return Target::File(file);
            }
        }
        if here.is_empty() {
            let exported = self.read.iter().position(|read| read.macros.contains(name));
            return exported.map_or(Target::Nowhere, Target::File);
        }
        Target::Nowhere
    }
}
