//! Files appear whole or not at all.
//!
//! A result is written beside its place under a temporary name and renamed into it. A program that
//! is stopped by a signal calls [`remove_unfinished`] so that no temporary file stays behind.
//!
//! Only a regular file is ever replaced: a link is followed, and a pipe or a device is written
//! through. `-` is standard output.

use std::fs;
use std::io::Write;
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::{Error, Result};

/// Temporary files that exist at this moment.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Tells two writers of the same file in one process apart.
static COUNTER: AtomicU32 = AtomicU32::new(0);

/// Writes `contents` to `path`, whole or not at all; an existing file is replaced. Folders that are
/// missing on the way are made.
///
/// # Errors
/// `Write` where the folder cannot be made, the disk is full, or the name is a folder's.
pub fn write(path: impl AsRef<Path>, contents: impl AsRef<[u8]>) -> Result<()> {
    whole(path.as_ref(), |file| file.write_all(contents.as_ref()))
}

/// Copies the file `from` to `to`, permissions included; otherwise as [`write()`].
///
/// # Errors
/// `Read` where `from` cannot be opened; as [`write()`].
pub fn copy(from: impl AsRef<Path>, to: impl AsRef<Path>) -> Result<()> {
    let from = from.as_ref();
    let mut source = fs::File::open(from).map_err(|e| Error::read(from, e))?;
    let permissions = source
        .metadata()
        .map_err(|e| Error::read(from, e))?
        .permissions();
    let replaced = !is_stream(to.as_ref());
    whole(to.as_ref(), |file| {
        std::io::copy(&mut source, file)?;
        match replaced {
            true => file.set_permissions(permissions),
            false => Ok(()),
        }
    })
}

/// Finds out whether [`write()`] can succeed, for work of minutes whose result would be lost at its
/// end. Folders that are missing on the way are made; a file that is there stays as it is.
///
/// # Errors
/// As [`write()`], but for a disk that is full by then.
pub fn prepare(path: &Path) -> Result<()> {
    // A pipe without a reader would block here: streams are not tried.
    let Destination::File(place) = destination(path) else {
        return Ok(());
    };
    let temporary = beside(&place)?;
    let made = match place.is_dir() {
        true => Err(std::io::ErrorKind::IsADirectory.into()),
        false => create(&temporary).and_then(|_| fs::remove_file(&temporary)),
    };
    unfinished().retain(|other| *other != temporary);
    made.map_err(|source| Error::write(path, source))
}

/// True where writing to `path` replaces nothing: standard output, a pipe or a device.
pub fn is_stream(path: &Path) -> bool {
    !matches!(destination(path), Destination::File(_))
}

/// True where writing to `path` writes to this process's standard output.
pub fn is_output(path: &Path) -> bool {
    matches!(destination(path), Destination::Output)
}

/// Place where the bytes go.
enum Destination {
    /// Standard output of this process.
    Output,
    /// A pipe or a device.
    Through(PathBuf),
    /// A regular file, or none yet; no link.
    File(PathBuf),
}

/// Longest chain of links that is followed, as in Linux.
const LINKS: usize = 40;

fn destination(path: &Path) -> Destination {
    let mut place = path.to_path_buf();
    for _ in 0..LINKS {
        let text = place.as_os_str();
        if text == "-" || text == "/dev/stdout" || text == "/proc/self/fd/1" {
            return Destination::Output;
        }
        // Open files of a process: to replace the file behind one would leave its owner's behind.
        if place.starts_with("/dev/fd") || place.starts_with("/proc") {
            return Destination::Through(place);
        }
        let Ok(target) = fs::read_link(&place) else {
            break;
        };
        place = match place.parent() {
            Some(folder) => folder.join(target),
            None => target,
        };
    }
    match fs::metadata(&place) {
        Ok(found) if !found.is_file() && !found.is_dir() => Destination::Through(place),
        _ => Destination::File(place),
    }
}

fn whole(path: &Path, fill: impl FnOnce(&mut fs::File) -> std::io::Result<()>) -> Result<()> {
    let place = match destination(path) {
        Destination::File(place) => place,
        Destination::Through(place) => {
            let opened = fs::OpenOptions::new().append(true).open(&place);
            let written = opened.and_then(|mut file| fill(&mut file));
            return written.map_err(|source| Error::write(path, source));
        }
        Destination::Output => {
            // The same descriptor, so that this text and printed text keep their order.
            let mut output = std::io::stdout().lock();
            let written = output.flush().and_then(|()| {
                let descriptor = output.as_fd().try_clone_to_owned()?;
                fill(&mut fs::File::from(descriptor))
            });
            return written.map_err(|source| Error::write(path, source));
        }
    };
    let temporary = beside(&place)?;
    let written = create(&temporary)
        .and_then(|mut file| {
            fill(&mut file)?;
            file.sync_all()
        })
        .and_then(|()| fs::rename(&temporary, &place));
    if written.is_err() {
        // Best effort: the first error is the one worth reporting.
        let _ = fs::remove_file(&temporary);
    }
    unfinished().retain(|other| *other != temporary);
    written.map_err(|source| Error::write(path, source))
}

/// A name for a file beside `path` that nobody else writes; its folder is made.
fn beside(path: &Path) -> Result<PathBuf> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    fs::create_dir_all(folder).map_err(|source| {
        let source = match folder.is_file() {
            true => std::io::ErrorKind::NotADirectory.into(),
            false => source,
        };
        Error::write(folder, source)
    })?;
    let name = path.file_name().ok_or_else(|| {
        Error::write(
            path,
            std::io::Error::new(std::io::ErrorKind::InvalidInput, "not a file name"),
        )
    })?;
    let mut temporary_name = std::ffi::OsString::from(".");
    temporary_name.push(name);
    let unique = COUNTER.fetch_add(1, Ordering::Relaxed);
    temporary_name.push(format!(".{}-{unique}.tmp", std::process::id()));
    Ok(folder.join(temporary_name))
}

/// While it lives no temporary file is made.
#[must_use = "hold it until the process ends"]
pub struct AllRemoved {
    _held: MutexGuard<'static, Vec<PathBuf>>,
}

/// Removes every temporary file that a writer in this process has not finished: for a Ctrl-C
/// handler, which holds the result until it ends the process.
pub fn remove_unfinished() -> AllRemoved {
    let mut unfinished = unfinished();
    for path in unfinished.drain(..) {
        // The writer may have renamed it in the meantime.
        let _ = fs::remove_file(path);
    }
    AllRemoved { _held: unfinished }
}

/// Under the lock, so that no file exists that [`remove_unfinished`] does not know.
fn create(temporary: &Path) -> std::io::Result<fs::File> {
    let mut unfinished = unfinished();
    let file = fs::File::create(temporary)?;
    unfinished.push(temporary.to_path_buf());
    Ok(file)
}

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    // A panicking writer cannot leave the list half-changed: push and retain are the only changes.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_no_temporary_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/deep/result.txt");
        write(&path, "one").unwrap();
        write(&path, "two").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn a_copied_program_can_still_be_run() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (from, to) = (folder.path().join("from"), folder.path().join("to"));
        fs::write(&from, "#!/bin/sh\nexit 7\n").unwrap();
        fs::set_permissions(&from, fs::Permissions::from_mode(0o750)).unwrap();
        copy(&from, &to).unwrap();
        assert_eq!(
            fs::metadata(&to).unwrap().permissions().mode() & 0o777,
            0o750
        );
        assert_eq!(fs::read(&to).unwrap(), fs::read(&from).unwrap());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
        let absent = copy(folder.path().join("absent"), &to).unwrap_err();
        assert_eq!(absent.exit_code(), 2);
    }

    #[test]
    fn what_cannot_be_written_is_known_before() {
        let folder = tempfile::tempdir().unwrap();
        let fresh = folder.path().join("new/result.txt");
        prepare(&fresh).unwrap();
        assert_eq!(fs::read_dir(fresh.parent().unwrap()).unwrap().count(), 0);
        fs::write(&fresh, "kept").unwrap();
        prepare(&fresh).unwrap();
        assert_eq!(fs::read_to_string(&fresh).unwrap(), "kept");
        assert!(prepare(folder.path()).is_err(), "a folder");
        assert!(prepare(&fresh.join("below")).is_err(), "below a file");
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let occupied = folder.path().join("occupied");
        fs::create_dir(&occupied).unwrap();
        fs::write(occupied.join("inside"), "x").unwrap();
        assert!(write(&occupied, "two").is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_link_stays_and_its_target_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("kept")).unwrap();
        std::os::unix::fs::symlink("kept/result.txt", at("link")).unwrap();
        std::os::unix::fs::symlink("link", at("further")).unwrap();
        for text in ["into nothing", "over a file"] {
            prepare(&at("further")).unwrap();
            write(at("further"), text).unwrap();
            assert_eq!(fs::read_to_string(at("kept/result.txt")).unwrap(), text);
            for link in ["link", "further"] {
                assert!(fs::symlink_metadata(at(link)).unwrap().is_symlink());
            }
        }
        assert_eq!(fs::read_dir(at("kept")).unwrap().count(), 1);
    }

    #[test]
    fn a_pipe_is_written_through_and_a_device_stays_one() {
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read_to_string(pipe).unwrap()
        });
        prepare(&pipe).unwrap();
        write(&pipe, "through").unwrap();
        assert_eq!(reader.join().unwrap(), "through");
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
        // A link, so that a wrong writer replaces the link and not this computer's device.
        let null = folder.path().join("null");
        std::os::unix::fs::symlink("/dev/null", &null).unwrap();
        assert!(is_stream(&null));
        write(&null, "nowhere").unwrap();
        assert!(fs::symlink_metadata(&null).unwrap().is_symlink());
        assert!(is_stream(Path::new("-")) && is_stream(Path::new("/dev/stdout")));
    }
}
