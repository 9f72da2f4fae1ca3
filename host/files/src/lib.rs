//! Files appear whole or not at all.
//!
//! A result is written beside its place under a temporary name and renamed into it. A program that
//! is stopped by a signal calls [`remove_unfinished`] so that no temporary file stays behind.
//!
//! Only a regular file is ever replaced: a link is followed, and a pipe or a device is written
//! through. `-` is standard output.

mod destination;
mod error;
mod unfinished;

use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::Path;

use destination::{Destination, destination};
pub use destination::{is_output, is_stream};
pub use error::FileError;
pub use unfinished::{AllRemoved, remove_unfinished};

/// Writes `contents` to `path`, whole or not at all; an existing file is replaced. Folders that are
/// missing on the way are made.
///
/// # Errors
/// [`FileError::Write`] where the folder cannot be made, the disk is full, or the name is a
/// folder's.
pub fn write(path: impl AsRef<Path>, contents: impl AsRef<[u8]>) -> Result<(), FileError> {
    let contents = contents.as_ref();
    whole(path.as_ref(), None, |file| file.write_all(contents))
}

/// Opens a file that is written as it goes, line by line, for what must be kept up to the moment
/// when something breaks. A regular file begins anew; a link is followed; a pipe or a device is
/// written through, and `-` is standard output.
///
/// # Errors
/// [`FileError::Write`] where it cannot be opened.
pub fn open(path: impl AsRef<Path>) -> Result<Box<dyn Write + Send>, FileError> {
    let path = path.as_ref();
    let opened = match destination(path) {
        Destination::File(place) => File::create(place),
        Destination::Through(place) => fs::OpenOptions::new().append(true).open(place),
        Destination::Output => return Ok(Box::new(std::io::stdout())),
    };
    let file = opened.map_err(|error| FileError::write(path, error))?;
    Ok(Box::new(file))
}

/// Writes a file unless it has these contents already: what is built from it is then up to date
/// too.
///
/// # Errors
/// As [`write()`].
pub fn write_changed(path: impl AsRef<Path>, contents: impl AsRef<[u8]>) -> Result<(), FileError> {
    let (path, contents) = (path.as_ref(), contents.as_ref());
    if fs::read(path).is_ok_and(|old| old == contents) {
        return Ok(());
    }
    write(path, contents)
}

/// Copies the file `from` to `to`, permissions included; otherwise as [`write()`].
///
/// # Errors
/// [`FileError::Read`] where `from` cannot be opened; as [`write()`].
pub fn copy(from: impl AsRef<Path>, to: impl AsRef<Path>) -> Result<(), FileError> {
    let from = from.as_ref();
    let opened = File::open(from).and_then(|file| Ok((file.metadata()?.permissions(), file)));
    let (permissions, mut source) = opened.map_err(|error| FileError::read(from, error))?;
    whole(to.as_ref(), Some(permissions), |file| {
        std::io::copy(&mut source, file).map(|_| ())
    })
}

/// Contents of a file of at most `max` bytes.
///
/// # Errors
/// [`FileError::Read`], [`FileError::TooLarge`].
pub fn read(path: impl AsRef<Path>, max: u64) -> Result<Vec<u8>, FileError> {
    let path = path.as_ref();
    let mut bytes = Vec::new();
    // The limit holds for what is read, not for what the file system claims: it may be a device.
    File::open(path)
        .and_then(|file| file.take(max + 1).read_to_end(&mut bytes))
        .map_err(|error| FileError::read(path, error))?;
    if bytes.len() as u64 > max {
        return Err(FileError::TooLarge {
            file: path.into(),
            max,
        });
    }
    Ok(bytes)
}

/// Finds out whether [`write()`] can succeed, for work of minutes whose result would be lost at its
/// end. Folders that are missing on the way are made; a file that is there stays as it is.
///
/// # Errors
/// As [`write()`], but for a disk that is full by then.
pub fn prepare(path: impl AsRef<Path>) -> Result<(), FileError> {
    let path = path.as_ref();
    // A pipe without a reader would block here: streams are not tried.
    let Destination::File(place) = destination(path) else {
        return Ok(());
    };
    let temporary = unfinished::beside(&place)?;
    let made = if place.is_dir() {
        Err(std::io::ErrorKind::IsADirectory.into())
    } else {
        unfinished::create(&temporary).and_then(|_| fs::remove_file(&temporary))
    };
    unfinished::forget(&temporary);
    made.map_err(|error| FileError::write(path, error))
}

fn whole(
    path: &Path,
    permissions: Option<fs::Permissions>,
    fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<(), FileError> {
    let written = match destination(path) {
        Destination::File(place) => {
            let temporary = unfinished::beside(&place)?;
            let filled = unfinished::create(&temporary).and_then(|mut file| {
                fill(&mut file)?;
                permissions.map_or(Ok(()), |permissions| file.set_permissions(permissions))?;
                file.sync_all()
            });
            let renamed = filled.and_then(|()| fs::rename(&temporary, &place));
            if renamed.is_err() {
                // Best effort: the first error is the one worth reporting.
                let _ = fs::remove_file(&temporary);
            }
            unfinished::forget(&temporary);
            renamed
        }
        Destination::Through(place) => {
            let opened = fs::OpenOptions::new().append(true).open(&place);
            opened.and_then(|mut file| fill(&mut file))
        }
        Destination::Output => {
            // After what was printed before, and at once.
            let mut output = std::io::stdout().lock();
            fill(&mut output).and_then(|()| output.flush())
        }
    };
    written.map_err(|error| FileError::write(path, error))
}

#[cfg(all(test, unix))]
mod tests {
    use std::fs;
    use std::path::Path;

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
        assert!(matches!(absent, FileError::Read { .. }), "{absent}");
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
        assert!(prepare(fresh.join("below")).is_err(), "below a file");
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
            prepare(at("further")).unwrap();
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

    #[test]
    fn a_file_that_is_written_as_it_goes_follows_links_and_keeps_pipes() {
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::os::unix::fs::symlink("rows.csv", at("link")).unwrap();
        for text in ["a longer first run", "again"] {
            open(at("link"))
                .unwrap()
                .write_all(text.as_bytes())
                .unwrap();
            assert_eq!(fs::read_to_string(at("rows.csv")).unwrap(), text);
        }
        assert!(fs::symlink_metadata(at("link")).unwrap().is_symlink());
        let pipe = at("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.unwrap().success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read_to_string(pipe).unwrap()
        });
        open(&pipe).unwrap().write_all(b"rows").unwrap();
        assert_eq!(reader.join().unwrap(), "rows");
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
        assert!(open(folder.path()).is_err(), "a folder");
    }

    #[test]
    fn a_file_with_these_contents_already_is_not_written_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("source.rs");
        write_changed(&path, "same").unwrap();
        let before = fs::metadata(&path).unwrap();
        write_changed(&path, "same").unwrap();
        use std::os::unix::fs::MetadataExt;
        assert_eq!(fs::metadata(&path).unwrap().ino(), before.ino());
        write_changed(&path, "other").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"other");
    }

    #[test]
    fn no_more_is_read_than_was_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.toml");
        write(&path, "12345").unwrap();
        assert_eq!(read(&path, 5).unwrap(), b"12345");
        assert!(matches!(
            read(&path, 4),
            Err(FileError::TooLarge { max: 4, .. })
        ));
        assert!(matches!(
            read("/dev/zero", 4),
            Err(FileError::TooLarge { .. })
        ));
    }
}
