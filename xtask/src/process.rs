//! Child processes: said before they run, and their failure passed on.

use std::fmt;
use std::io::{self, BufRead, BufReader, IsTerminal, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::sync::mpsc::{Sender, channel};

use anyhow::{Context, Result, ensure};
use serde_json::Value;

/// Top folder of the repository.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}

/// Build folder of this workspace.
pub fn target_folder() -> PathBuf {
    match std::env::var_os("CARGO_TARGET_DIR") {
        Some(folder) => root().join(folder),
        None => root().join("target"),
    }
}

/// Folder of the recordings that do not ship with the project: `$SINEW_DATA`, or beside the
/// checkout.
pub fn data_folder() -> PathBuf {
    std::env::var_os("SINEW_DATA").map_or_else(|| root().join("../shared/data"), PathBuf::from)
}

/// A child ended with a status other than 0.
#[derive(Debug)]
pub struct Failed {
    /// Command line that was run, as a person would type it.
    pub line: String,
    /// Its exit status; 1 where a signal ended it.
    pub code: u8,
}

impl fmt::Display for Failed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "failed with status {}: {}", self.code, self.line)
    }
}

impl std::error::Error for Failed {}

/// Exit status of a program: a child's own where one failed, with the reason on standard error.
pub fn end(program: &str, outcome: Result<()>) -> ExitCode {
    let Err(error) = outcome else {
        return ExitCode::SUCCESS;
    };
    // A child that failed has said why; its status is passed on.
    if let Some(Failed { code, .. }) = error.downcast_ref() {
        eprintln!("{program}: {error}");
        return ExitCode::from(*code);
    }
    eprintln!("{program}: {error:#}");
    ExitCode::FAILURE
}

/// `program arguments...`, for a cargo that belongs to the host's toolchain.
pub fn cargo(arguments: &[&str]) -> Command {
    // Cargo sets CARGO for `cargo run`: the very binary that started this one.
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments).current_dir(root());
    command
}

/// Compiles a program of the workspace, which takes no time where the tests are compiled: its path.
///
/// # Errors
/// It does not compile.
pub fn program(name: &str) -> Result<PathBuf> {
    compiled("--bin", name, "debug")
}

/// Compiles an example whose name no other package of the workspace has: its path.
///
/// # Errors
/// It does not compile.
pub fn example(name: &str) -> Result<PathBuf> {
    compiled("--example", name, "debug/examples")
}

/// With `--package`, cargo would choose the features of one package, and compile what the tests
/// have compiled once more with those.
fn compiled(kind: &str, name: &str, folder: &str) -> Result<PathBuf> {
    run(&mut cargo(&["build", "--workspace", kind, name]))?;
    Ok(target_folder().join(folder).join(name))
}

/// Lets a cargo command lint the crates of its workspace, any warning an error, where it compiles
/// them: the dependencies are compiled once, and not checked for clippy as well.
pub fn linted(command: &mut Command) -> &mut Command {
    command.env(
        "RUSTC_WORKSPACE_WRAPPER",
        root().join(".ci/lint-and-compile"),
    )
}

/// The command line as a person would type it.
pub fn line(command: &Command) -> String {
    let program = Path::new(command.get_program());
    let mut line = match program.file_name() {
        Some(name) => name.to_string_lossy().into_owned(),
        None => program.display().to_string(),
    };
    for argument in command.get_args() {
        line.push(' ');
        line.push_str(&argument.to_string_lossy());
    }
    line
}

/// Says what it runs, runs it with this process's terminal, and fails if it fails.
///
/// # Errors
/// The program could not be started; or [`Failed`].
pub fn run(command: &mut Command) -> Result<()> {
    println!("$ {}", line(command));
    let status = command
        .status()
        .with_context(|| format!("cannot start {}", line(command)))?;
    outcome(command, status.code(), status.success())
}

/// As [`run`], and hands every line of output, standard error included, to `see` after printing it.
///
/// # Errors
/// As [`run`].
pub fn run_watched(command: &mut Command, mut see: impl FnMut(&str)) -> Result<()> {
    println!("$ {}", line(command));
    if io::stderr().is_terminal() {
        // Cargo would drop its colours in front of a pipe.
        command.env("CARGO_TERM_COLOR", "always");
    }
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| format!("cannot start {}", line(command)))?;
    let (lines, arriving) = channel();
    if let Some(output) = child.stdout.take() {
        forward(output, io::stdout(), lines.clone());
    }
    if let Some(errors) = child.stderr.take() {
        forward(errors, io::stderr(), lines);
    }
    // Ends when both ends of the child's output are closed.
    for line in arriving {
        see(&line);
    }
    let status = child.wait()?;
    outcome(command, status.code(), status.success())
}

/// Copies what a child prints, line by line, in a thread of its own.
fn forward(
    from: impl Read + Send + 'static,
    mut to: impl Write + Send + 'static,
    lines: Sender<String>,
) {
    std::thread::spawn(move || {
        let mut reader = BufReader::new(from);
        let mut bytes = Vec::new();
        // Bytes, not lines(): a test may print anything, and that must not end the watch.
        while matches!(reader.read_until(b'\n', &mut bytes), Ok(1..)) {
            // A terminal that has gone away is no reason to stop counting.
            let _ = to.write_all(&bytes).and_then(|()| to.flush());
            if lines
                .send(String::from_utf8_lossy(&bytes).trim_end().to_string())
                .is_err()
            {
                break;
            }
            bytes.clear();
        }
    });
}

fn outcome(command: &Command, code: Option<i32>, success: bool) -> Result<()> {
    if success {
        return Ok(());
    }
    let code = code.and_then(|code| u8::try_from(code).ok()).unwrap_or(1);
    Err(Failed {
        line: line(command),
        code,
    }
    .into())
}

/// Standard output of a command that ended well, without its last line break; `None` if it did not.
pub fn answer(command: &mut Command) -> Option<String> {
    let output = command
        .stderr(Stdio::null())
        .stdin(Stdio::null())
        .output()
        .ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim_end().to_string())
}

/// Output of a command: one JSON value.
///
/// # Errors
/// It does not start or fails, with all that it wrote, or prints something else.
pub fn json(command: &mut Command) -> Result<Value> {
    let line = line(command);
    let output = command
        .output()
        .with_context(|| format!("cannot start {line}"))?;
    ensure!(
        output.status.success(),
        "{line} failed:\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).with_context(|| format!("{line} printed no JSON"))
}

/// True if a command can be started and ends well; it prints nothing.
pub fn succeeds(command: &mut Command) -> bool {
    answer(command).is_some()
}
