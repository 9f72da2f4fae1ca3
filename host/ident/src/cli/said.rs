//! Printed results beside a file that goes to standard output.

use std::fmt::Display;
use std::path::Path;

/// Lines for a person. They go to standard error where a file is standard output.
#[derive(Clone, Copy, Debug)]
pub struct Said {
    aside: bool,
}

impl Said {
    /// Stands aside where one of these files is standard output.
    pub fn beside<'a>(files: impl IntoIterator<Item = Option<&'a Path>>) -> Self {
        let aside = files.into_iter().flatten().any(sinew_files::is_output);
        Self { aside }
    }

    /// Lines go to standard error.
    pub const fn is_aside(self) -> bool {
        self.aside
    }

    /// One line, or several.
    pub fn line(self, text: impl Display) {
        if self.aside {
            eprintln!("{text}");
        } else {
            println!("{text}");
        }
    }

    /// Name of a file that was written; standard output has none.
    pub fn wrote(self, path: &Path) {
        if !sinew_files::is_output(path) {
            self.line(path.display());
        }
    }
}
