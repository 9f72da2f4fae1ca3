//! The `sinew` program as its users meet it: a folder, a command line, what it says and how it
//! ends.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

/// A folder to work in. Names on command lines are relative to it, so that messages do not depend
/// on the machine.
pub struct Desk {
    folder: TempDir,
}

impl Desk {
    /// An empty folder.
    pub fn new() -> Self {
        Self {
            folder: tempfile::tempdir().expect("a temporary folder can be made"),
        }
    }

    /// Its folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Puts a file there.
    pub fn write(&self, name: &str, text: &str) -> &Self {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().expect("the path lies in a folder"))
            .expect("the folder is writable");
        std::fs::write(path, text).expect("the folder can be written");
        self
    }

    /// Puts a file of this checkout there, under the same base name.
    pub fn bring(&self, file: &str) -> &Self {
        let from = checkout().join(file);
        let name = from.file_name().expect("a file has a name");
        std::fs::copy(&from, self.folder.path().join(name))
            .unwrap_or_else(|error| panic!("{}: {error}", from.display()));
        self
    }

    /// Reads a file that is there.
    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// `sinew ARGUMENTS` in this folder, not yet started.
    pub fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sinew"));
        command
            .args(line.split_whitespace())
            .current_dir(self.folder.path());
        // Where a developer shares build outputs between projects, these tests do not.
        command.env_remove("SINEW_BUILD_DIR");
        command
    }

    /// Runs it to its end.
    pub fn sinew(&self, line: &str) -> Output {
        self.command(line).output().expect("the program starts")
    }

    /// Runs what must end well, and gives what it printed.
    pub fn succeed(&self, line: &str) -> String {
        let output = self.sinew(line);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "sinew {line}\n{errors}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    /// Runs what must be refused: the line, its exit status and its words, for a snapshot.
    pub fn refusal(&self, line: &str) -> String {
        let output = self.sinew(line);
        let mut report = String::new();
        let status = output
            .status
            .code()
            .map_or("a signal".into(), |code| code.to_string());
        // Writing to a String cannot fail.
        let _ = writeln!(
            report,
            "$ sinew {line}\n{}",
            String::from_utf8_lossy(&output.stderr).trim_end()
        );
        let _ = writeln!(report, "exit status {status}\n");
        assert!(
            output.stdout.is_empty(),
            "a refusal goes to standard error: {line}"
        );
        report
    }
}

/// Top folder of the repository.
pub fn checkout() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors()
        .nth(2)
        .expect("this crate lies in the checkout")
        .to_path_buf()
}

/// Build outputs of projects: those of the boards, so that what a project and this checkout have in
/// common is compiled once. What links an image there copies it under a lock.
pub fn images() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("boards")
}

/// Columns of a CSV file by name; a missing value is NaN.
pub fn columns(text: &str) -> Vec<(String, Vec<f64>)> {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names = lines.next().expect("the file has a header");
    let mut columns: Vec<(String, Vec<f64>)> = names
        .split(',')
        .map(|name| (name.to_string(), Vec::new()))
        .collect();
    for line in lines {
        for (column, field) in columns.iter_mut().zip(line.split(',')) {
            column.1.push(match field {
                "" => f64::NAN,
                number => number
                    .parse()
                    .unwrap_or_else(|error| panic!("{line}: {error}")),
            });
        }
    }
    columns
}
