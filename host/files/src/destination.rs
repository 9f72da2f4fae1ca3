//! Regular file, stream or standard output: the end of a path.

use std::fs;
use std::path::{Path, PathBuf};

/// True where writing to `path` replaces nothing: standard output, a pipe or a device.
pub fn is_stream(path: impl AsRef<Path>) -> bool {
    !matches!(destination(path.as_ref()), Destination::File(_))
}

/// True where writing to `path` writes to this process's standard output.
pub fn is_output(path: impl AsRef<Path>) -> bool {
    matches!(destination(path.as_ref()), Destination::Output)
}

/// Place of the bytes.
pub(crate) enum Destination {
    /// Standard output of this process.
    Output,
    /// A pipe or a device.
    Through(PathBuf),
    /// A regular file, or none yet; no link.
    File(PathBuf),
}

/// Longest chain of links that is followed, as in Linux.
const LINKS: usize = 40;

pub(crate) fn destination(path: &Path) -> Destination {
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
