//! Runs cargo on one board of a project.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

use super::toolchain::{Machine, TARGET, cargo, firmware_cargo, no_cargo, target_help};
use super::{Board, board_folder};
use crate::device::Guarded;
use sinew_ident::error::{Error, Result};

/// Binaries of one board, ready to run.
#[derive(Clone, Debug)]
pub struct Built {
    /// Frames in lockstep; where there is one program only, that.
    pub lockstep: PathBuf,
    /// Beside it, paced by its own clock, frames over the serial line: in QEMU.
    pub free: Option<PathBuf>,
}

/// Builds `board` of the project in `folder`, release, and copies the programs to
/// `folder/images/BOARD/`. Build outputs go to `cache`, which projects may share, or to
/// `folder/target`.
///
/// # Errors
/// As [`compile`]; a copy that cannot be written.
pub fn build(folder: &Path, board: Board, cache: Option<&Path>) -> Result<Built> {
    let own = folder.join("target");
    let images = folder.join("images").join(board.folder());
    build_to(folder, board, cache.unwrap_or(&own), &images)
}

/// As [`build`], with the copies in `images`.
///
/// # Errors
/// As [`build`].
pub fn build_to(folder: &Path, board: Board, cache: &Path, images: &Path) -> Result<Built> {
    // Until the copies are there: another `sinew` would put its program in the place of this one.
    // The system gives it back when the process ends, however it ends.
    let lock = lock(cache)?;
    let built = compile(folder, board, cache)?;
    let copy = |from: &Path, name: &str| -> Result<PathBuf> {
        let to = images.join(name);
        sinew_files::copy(from, &to)?;
        std::path::absolute(&to).map_err(|e| Error::write(&to, e))
    };
    let name = match board {
        Board::Host => board.program().to_string(),
        _ => format!("{}.elf", board.program()),
    };
    let copies = Built {
        lockstep: copy(&built.lockstep, &name)?,
        free: built
            .free
            .as_ref()
            .map(|free| copy(free, "free.elf"))
            .transpose()?,
    };
    drop(lock);
    Ok(copies)
}

/// Waits until no other process copies from `cache`, and keeps others waiting while it lives.
fn lock(cache: &Path) -> Result<File> {
    std::fs::create_dir_all(cache).map_err(|e| Error::write(cache, e))?;
    let path = cache.join(".sinew-lock");
    let file = File::create(&path).map_err(|e| Error::write(&path, e))?;
    file.lock().map_err(|e| Error::write(&path, e))?;
    Ok(file)
}

/// Builds `board` of the project in `folder`, release; the programs are left where cargo puts them,
/// in `cache`.
///
/// # Errors
/// [`Error`] with the compiler's words when the build fails, and with what to install when the
/// compiler or its target is missing.
pub fn compile(folder: &Path, board: Board, cache: &Path) -> Result<Built> {
    let release = run(folder, board, cache, &[])?;
    Ok(Built {
        lockstep: release.join(board.program()),
        free: (board == Board::Qemu).then(|| release.join("free")),
    })
}

/// Builds the program in which a board in QEMU checks itself and says what its control steps take.
///
/// # Errors
/// As [`compile`].
pub fn checks(folder: &Path, cache: &Path) -> Result<PathBuf> {
    let program = ["--features", "checks", "--bin", "checks"];
    Ok(run(folder, Board::Qemu, cache, &program)?.join("checks"))
}

/// Builds a board's programs: their folder.
fn run(folder: &Path, board: Board, cache: &Path, more: &[&str]) -> Result<PathBuf> {
    let on = Machine::of(board);
    let arguments: Vec<&str> = ["build"].iter().chain(more).copied().collect();
    run_cargo(&board_folder(folder, board), on, cache, &arguments)
}

/// Runs cargo with `--release` in a crate that is a workspace of its own: the folder of what it
/// built, in `cache`.
///
/// # Errors
/// As [`compile`].
pub fn run_cargo(
    crate_folder: &Path,
    on: Machine,
    cache: &Path,
    arguments: &[&str],
) -> Result<PathBuf> {
    let cache = std::path::absolute(cache).map_err(|e| Error::write(cache, e))?;
    let mut command = match on {
        Machine::ThisOne => cargo("cargo"),
        Machine::Microcontroller => firmware_cargo(),
    };
    command
        .args(arguments)
        .args(["--release", "--quiet"])
        .current_dir(crate_folder)
        .env("CARGO_TARGET_DIR", &cache)
        // Flags meant for the program that calls are not the firmware's.
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS");
    if on == Machine::Microcontroller {
        command.args(["--target", TARGET]);
    }
    let (status, words) = complaints(&mut command).map_err(no_cargo)?;
    if !status.success() {
        let error = Error::failed(format!(
            "building {} failed:\n{}",
            crate_folder.display(),
            words.trim_end()
        ));
        return Err(if words.contains("target may not be installed") {
            error.help(target_help())
        } else {
            error
        });
    }
    Ok(match on {
        Machine::ThisOne => cache.join("release"),
        Machine::Microcontroller => cache.join(TARGET).join("release"),
    })
}

/// Runs `command` to its end: how it ended, and what it wrote to standard error.
fn complaints(command: &mut Command) -> std::io::Result<(ExitStatus, String)> {
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    // Guarded, because a build of minutes must not go on after Ctrl-C.
    let mut child = Guarded::spawn(command)?;
    let mut words = Vec::new();
    if let Some(mut errors) = child.stderr() {
        errors.read_to_end(&mut words)?;
    }
    Ok((child.wait()?, String::from_utf8_lossy(&words).into_owned()))
}
