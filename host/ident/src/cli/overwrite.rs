//! Results that would replace what they are made from, or each other, or that cannot be written at
//! all: refused before the work.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// The same file, however it is written: through links or with `./`. The folder of a file that does
/// not exist is resolved.
pub fn identity(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| {
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        match (folder.canonicalize(), path.file_name()) {
            (Ok(folder), Some(name)) => folder.join(name),
            _ => path.to_path_buf(),
        }
    })
}

/// No result may replace what it was made from, or another result, and each can be written. One
/// result alone may go to standard output. Each path comes with what names it, a flag or words.
///
/// # Errors
/// `Arguments`, with both names; `Write`.
pub fn refuse<'a>(
    read: impl IntoIterator<Item = (&'static str, &'a Path)>,
    written: impl IntoIterator<Item = (&'static str, Option<&'a Path>)>,
) -> Result<()> {
    let read = read.into_iter().map(|(name, path)| (identity(path), name));
    let mut taken: Vec<(PathBuf, &str)> = read.collect();
    let mut output: Option<&str> = None;
    for (flag, path) in written {
        let Some(path) = path else { continue };
        if sinew_files::is_output(path)
            && let Some(before) = output.replace(flag)
        {
            return Err(Error::arguments(format!(
                "{before} and {flag} both go to standard output, where they would mix"
            ))
            .help(format!("name a file for {before} or {flag}")));
        }
        if sinew_files::is_stream(path) {
            continue;
        }
        let file = identity(path);
        if let Some((_, before)) = taken.iter().find(|(other, _)| *other == file) {
            let path = path.display();
            return Err(Error::arguments(format!(
                "{flag} {path} would overwrite what {before} names"
            ))
            .help("give it another name"));
        }
        sinew_files::prepare(path)?;
        taken.push((file, flag));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_names_of_one_file_are_the_same_before_it_exists_too() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::os::unix::fs::symlink(folder.path(), at("link")).unwrap();
        for name in ["kept.csv", "new.csv"] {
            std::fs::write(at("kept.csv"), "t").unwrap();
            let (plain, other) = (at(name), at("link").join(".").join(name));
            assert_eq!(identity(&plain), identity(&other));
            let refused = refuse(
                [("--fit", plain.as_path())],
                [("--out", Some(other.as_path()))],
            );
            let message = refused.unwrap_err().to_string();
            assert!(
                message.contains("would overwrite what --fit names"),
                "{message}"
            );
        }
        refuse(
            [("--fit", Path::new("/dev/null"))],
            [("--out", Some(Path::new("/dev/null")))],
        )
        .unwrap();
    }

    #[test]
    fn one_result_alone_goes_to_standard_output() {
        let (json, report) = (Path::new("-"), Path::new("/dev/stdout"));
        refuse([], [("--json", Some(json)), ("--report", None)]).unwrap();
        let both = refuse([], [("--json", Some(json)), ("--report", Some(report))]);
        let message = both.unwrap_err().to_string();
        assert!(message.starts_with("--json and --report both"), "{message}");
    }
}
