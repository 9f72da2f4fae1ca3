//! Logs of other programs as recordings.

use std::io::Read as _;
use std::path::Path;

use sinew_convert::{Contents, Format, MOST_BYTES, Wanted};

use super::{Column, Recording};
use crate::error::{Error, Result};

/// Format of a log by its first bytes, or by the extension of its name; `None` for CSV.
pub fn format(bytes: &[u8], path: &Path) -> Option<Format> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    sinew_convert::format(bytes, &extension)
}

/// Contents of a log.
///
/// # Errors
/// `Read`; `File` for a log that is broken, cut off, too large or of no format that is read.
pub fn contents(path: &Path) -> Result<Contents> {
    refuse_huge(path)?;
    let bytes = sinew_files::read(path, MOST_BYTES)?;
    let Some(format) = format(&bytes, path) else {
        return Err(
            Error::file(path, "it is no log of a known format").expected(
                "MATLAB (.mat), HDF5 (.h5), MCAP (.mcap) or JSON (.json); CSV is read as it is",
            ),
        );
    };
    read(&bytes, format, path)
}

fn read(bytes: &[u8], format: Format, path: &Path) -> Result<Contents> {
    sinew_convert::read(bytes, format).map_err(|error| refused(path, &error))
}

/// Refuses a log that is larger than what is read, before it is read.
///
/// # Errors
/// `File` for such a log; `Read`.
pub(super) fn refuse_huge(path: &Path) -> Result<()> {
    let failed = |source| Error::read(path, source);
    let length = std::fs::metadata(path).map_err(failed)?.len();
    if length <= MOST_BYTES {
        return Ok(());
    }
    let mut start = Vec::new();
    let file = std::fs::File::open(path).map_err(failed)?;
    file.take(1 << 12).read_to_end(&mut start).map_err(failed)?;
    match format(&start, path) {
        Some(_) => {
            let message = format!("larger than {MOST_BYTES} bytes, the most that is read of a log");
            Err(Error::file(path, message))
        }
        None => Ok(()),
    }
}

/// The chosen columns of a log as a recording, its rules in [`Recording::notes`].
///
/// # Errors
/// `File` as [`sinew_convert::table`], and as [`Recording::new`].
pub fn recording(contents: &Contents, wanted: &Wanted, path: &Path) -> Result<Recording> {
    let table = sinew_convert::table(contents, wanted).map_err(|mut error| {
        let list = || {
            format!(
                "sinew convert {} --list shows what it holds",
                path.display()
            )
        };
        error.help.get_or_insert_with(list);
        refused(path, &error)
    })?;
    let columns = table.columns.into_iter();
    let columns = columns.map(|(name, values)| Column { name, values });
    let mut recording = Recording::new(path, table.t, columns.collect())?;
    recording.notes = table.said;
    Ok(recording)
}

/// A log whose signals all have the same times.
pub(super) fn direct(bytes: &[u8], format: Format, path: &Path) -> Result<Recording> {
    let contents = read(bytes, format, path)?;
    let bases = sinew_convert::bases(&contents);
    if bases.len() > 1 {
        let names: Vec<&str> = bases.iter().map(|base| base.path.as_str()).collect();
        let message = format!(
            "its signals have {} bases of times: {}",
            bases.len(),
            names.join(", ")
        );
        let help = format!(
            "sinew convert {} --out REC.csv brings them onto one",
            path.display()
        );
        return Err(Error::file(path, message).help(help));
    }
    recording(&contents, &Wanted::default(), path)
}

fn refused(path: &Path, error: &sinew_convert::Error) -> Error {
    let refused = Error::file(path, &error.message);
    match &error.help {
        Some(help) => refused.help(help),
        None => refused,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(name: &str) -> std::path::PathBuf {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        root.join("tests/foreign/logs").join(name)
    }

    #[test]
    fn a_log_with_one_base_is_read_where_a_recording_is() {
        for (name, column) in [
            ("struct", "angle_rad"),
            ("packed", "u_V"),
            ("types", "q2_rad"),
        ] {
            let recording = Recording::read(log(&format!("{name}.mat"))).unwrap();
            let expected = Recording::read(log(&format!("{name}.csv"))).unwrap();
            assert_eq!(recording.t(), expected.t(), "{name}");
            assert_eq!(recording.column(column), expected.column(column), "{name}");
        }
        let recording = Recording::read(log("bam.json")).unwrap();
        let left_out = "left out: `motor`: text \"xl330\"".to_owned();
        assert!(
            recording.notes().contains(&left_out),
            "{:?}",
            recording.notes()
        );
    }

    #[test]
    fn several_bases_are_an_error_that_names_the_verb() {
        let error = Recording::read(log("logsout.mat")).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        let message = error.to_string();
        assert!(
            message.contains("2 bases of times: logsout/angle/Time, "),
            "{message}"
        );
        assert!(message.contains("help: sinew convert "), "{message}");
    }

    #[test]
    fn a_log_that_is_too_large_is_refused_before_it_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.mat");
        // Without contents: it takes no place.
        let file = std::fs::File::create(&path).unwrap();
        file.set_len(MOST_BYTES + 1).unwrap();
        for message in [
            Recording::read(&path).unwrap_err().to_string(),
            contents(&path).unwrap_err().to_string(),
        ] {
            // Its own words: those of a file that was read end earlier.
            let own = "larger than 1073741824 bytes, the most that is read of a log";
            assert!(message.contains(own), "{message}");
        }
    }

    /// The first bytes go before the name.
    #[test]
    fn a_log_is_known_by_its_bytes_and_a_broken_one_by_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        std::fs::copy(log("packed.mat"), &path).unwrap();
        assert_eq!(Recording::read(&path).unwrap().len(), 24);
        let path = folder.path().join("log.mat");
        std::fs::write(&path, "t,q_m\n0,1\n").unwrap();
        let message = Recording::read(&path).unwrap_err().to_string();
        assert!(message.contains("no MATLAB file of level 5"), "{message}");
        let path = folder.path().join("log.parquet");
        std::fs::write(&path, "PAR1").unwrap();
        let message = Recording::read(&path).unwrap_err().to_string();
        assert!(message.contains("Parquet is not read"), "{message}");
    }
}
