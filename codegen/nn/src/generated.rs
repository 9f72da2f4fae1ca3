//! Folder of a printed crate: its own files come and go, those of others stay.

use std::fs;
use std::path::Path;

use crate::BuildError;
use crate::emit::{File, HEADER};
use sinew_files::FileError;

/// Folders of a printed crate.
const FOLDERS: [&str; 5] = ["", "src", "tests", "examples", "c"];

/// Writes the files of a printed crate, and removes those of an earlier one that are not among
/// them.
///
/// # Errors
/// [`BuildError::Foreign`], before anything is written, where somebody else's file stands in the
/// place of one; [`BuildError::File`].
pub(crate) fn write(out: &Path, printed: &[File]) -> Result<(), BuildError> {
    for file in printed {
        let path = out.join(&file.path);
        let other = fs::read(&path).is_ok_and(|old| old != file.text.as_bytes());
        if other && file.text.contains(HEADER) && !is_printed(&path) {
            return Err(BuildError::Foreign { file: path });
        }
    }
    for file in printed {
        sinew_files::write_changed(out.join(&file.path), file.text.as_bytes())?;
    }
    for folder in FOLDERS {
        // A folder that is not there holds nothing.
        let Ok(entries) = out.join(folder).read_dir() else {
            continue;
        };
        for path in entries.flatten().map(|entry| entry.path()) {
            let kept = printed.iter().any(|file| out.join(&file.path) == path);
            if !kept && path.is_file() && is_printed(&path) {
                fs::remove_file(&path).map_err(|error| FileError::write(&path, error))?;
            }
        }
    }
    Ok(())
}

/// The file bears the line that heads every printed file.
fn is_printed(path: &Path) -> bool {
    fs::read_to_string(path).is_ok_and(|text| text.contains(HEADER))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(path: &str, text: &str) -> File {
        File {
            path: path.into(),
            text: text.into(),
        }
    }

    #[test]
    fn printed_files_that_are_printed_no_more_go_and_others_stay() {
        let out = tempfile::tempdir().expect("a temporary folder can be made");
        let of_tool = format!("//! {HEADER}\n");
        let first = [
            file("src/lib.rs", &of_tool),
            file("tests/golden.rs", &of_tool),
        ];
        write(out.path(), &first).expect("an empty folder");
        fs::write(out.path().join("src/own.rs"), "// mine\n")
            .expect("the folder is this test's own");
        write(out.path(), &first[..1]).expect("the test's folder is writable");
        assert!(!out.path().join("tests/golden.rs").exists());
        assert!(out.path().join("src/lib.rs").exists());
        assert!(out.path().join("src/own.rs").exists());
    }

    #[test]
    fn a_file_of_somebody_else_is_not_replaced() {
        let out = tempfile::tempdir().expect("a temporary folder can be made");
        fs::create_dir(out.path().join("src")).expect("the folder is this test's own");
        let mine = out.path().join("src/lib.rs");
        fs::write(&mine, "// mine\n").expect("the folder is this test's own");
        let of_tool = format!("//! {HEADER}\n");
        let printed = [file("Cargo.toml", &of_tool), file("src/lib.rs", &of_tool)];
        let refused = write(out.path(), &printed).expect_err("it is mine");
        assert!(refused.to_string().contains("src/lib.rs"), "{refused}");
        assert_eq!(
            fs::read_to_string(&mine).expect("the file is there"),
            "// mine\n"
        );
        assert!(!out.path().join("Cargo.toml").exists(), "before anything");
    }
}
