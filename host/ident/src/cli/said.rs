//! Printed results beside a file that goes to standard output.

use std::fmt::Display;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use super::colour::{self, Stream};

/// Every line stands aside: the program's own standard output is a document.
static ALL_ASIDE: AtomicBool = AtomicBool::new(false);

/// Sends every line for a person to standard error from now on, in verbs that a verb calls too.
pub fn stand_aside() {
    ALL_ASIDE.store(true, Ordering::Relaxed);
}

/// Lines for a person. They go to standard error where a file is standard output.
#[derive(Clone, Copy, Debug)]
pub struct Said {
    aside: bool,
    quiet: bool,
}

impl Said {
    /// Stands aside where one of these files is standard output; `quiet` (`--quiet`) leaves
    /// warnings and questions alone.
    pub fn beside<'a>(files: impl IntoIterator<Item = Option<&'a Path>>, quiet: bool) -> Self {
        let aside = files.into_iter().flatten().any(sinew_files::is_output);
        let aside = aside || ALL_ASIDE.load(Ordering::Relaxed);
        Self { aside, quiet }
    }

    /// Lines go to standard error.
    pub const fn is_aside(self) -> bool {
        self.aside
    }

    /// One line of a result, or several; none with `--quiet`.
    pub fn line(self, text: impl Display) {
        if !self.quiet {
            self.question(text);
        }
    }

    /// Words that a person answers, which `--quiet` shows too. Labels and verdict words have colour
    /// on a terminal.
    pub fn question(self, text: impl Display) {
        let text = text.to_string();
        if self.aside {
            eprintln!("{}", colour::shown(&text, Stream::Error));
        } else {
            println!("{}", colour::shown(&text, Stream::Output));
        }
    }

    /// Something that may be wrong: on standard error, with `--quiet` too.
    pub fn warning(self, text: impl Display) {
        let text = format!("warning: {text}");
        eprintln!("{}", colour::shown(&text, Stream::Error));
    }

    /// The step that comes next: every verb ends with one.
    pub fn next(self, step: impl Display) {
        self.line(format!("next: {step}"));
    }

    /// Name of a file that was written; standard output has none.
    pub fn wrote(self, path: &Path) {
        if !sinew_files::is_output(path) {
            self.line(path.display());
        }
    }
}
