//! Files that an earlier run wrote: an edited one is kept, a stale one goes, and nobody else's file
//! is replaced.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use sinew_ident::error::{Error, Result};
use sinew_model::emit::HEADER;

/// List of the written files with their checksums, in the project's folder.
const LIST: &str = ".sinew-written";

/// First line of the list.
const TITLE: &str = "# Written by sinew, with checksums: an edited file is kept.";

/// A file of a project.
pub struct SourceFile {
    /// Path within the project, with `/`.
    pub path: String,
    pub contents: Cow<'static, [u8]>,
}

/// Standing of a file that is there with other contents.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Standing {
    /// As an earlier run left it.
    Ours,
    /// Written by an earlier run, and changed since.
    Edited,
    /// Never written by this program.
    Foreign,
}

/// Writes the files of a project, and removes those of an earlier run that are no longer among
/// them. Returns the edited files, which stay; a new version stands beside one as `NAME.new`.
///
/// # Errors
/// Before anything is written, where somebody else's file stands in the place of one; a file that
/// cannot be written.
pub fn update(folder: &Path, files: &[SourceFile]) -> Result<Vec<PathBuf>> {
    let before = List::read(folder);
    let foreign = files
        .iter()
        .find(|file| before.standing(folder, file) == Some(Standing::Foreign));
    if let Some(foreign) = foreign {
        return Err(in_the_way(folder.join(&foreign.path)));
    }
    let mut kept = Vec::new();
    for file in files {
        let path = folder.join(&file.path);
        if before.standing(folder, file) != Some(Standing::Edited) {
            sinew_files::write_changed(&path, &file.contents)?;
            continue;
        }
        if before.checksum(&file.path) != Some(checksum(&file.contents)) {
            sinew_files::write(path.with_added_extension("new"), &file.contents)?;
        }
        kept.push(path);
    }
    for path in before.checksums.iter().flat_map(BTreeMap::keys) {
        let stale = files.iter().all(|file| file.path != *path);
        let place = folder.join(path);
        if stale && before.is_as_written(path, &place) {
            fs::remove_file(&place).map_err(|error| Error::write(&place, error))?;
        }
    }
    let lines = files.iter().map(|file| {
        let checksum = checksum(&file.contents);
        format!("{checksum:08x} {}\n", file.path)
    });
    let text = format!("{TITLE}\n{}", lines.collect::<String>());
    sinew_files::write_changed(folder.join(LIST), text)?;
    Ok(kept)
}

/// Refuses a folder in which somebody else's file stands at one of these paths.
///
/// # Errors
/// The first such file.
pub fn is_free<'a>(folder: &Path, mut paths: impl Iterator<Item = &'a str>) -> Result<()> {
    let before = List::read(folder);
    if before.checksums.is_none() && before.is_older {
        return Ok(());
    }
    let foreign = |path: &&str| before.checksum(path).is_none() && !path.ends_with("Cargo.lock");
    match paths.find(|path| foreign(path) && folder.join(path).exists()) {
        Some(path) => Err(in_the_way(folder.join(path))),
        None => Ok(()),
    }
}

fn in_the_way(path: PathBuf) -> Error {
    Error::file(path, "not written by sinew, and would be replaced")
        .help("name another folder, or move the file")
}

fn checksum(contents: &[u8]) -> u32 {
    crc32fast::hash(contents)
}

/// The list of an earlier run.
struct List {
    /// Checksums by path; `None` where there is no list.
    checksums: Option<BTreeMap<String, u32>>,
    /// A folder that a program without lists wrote.
    is_older: bool,
}

impl List {
    fn read(folder: &Path) -> Self {
        let text = fs::read_to_string(folder.join(LIST)).ok();
        let text = text.filter(|text| text.starts_with(TITLE));
        let entry = |line: &str| {
            let (checksum, path) = line.split_once(' ')?;
            Some((path.to_owned(), u32::from_str_radix(checksum, 16).ok()?))
        };
        let manifest = fs::read_to_string(folder.join("model/Cargo.toml"));
        Self {
            checksums: text.map(|text| text.lines().skip(1).filter_map(entry).collect()),
            is_older: manifest.is_ok_and(|text| text.contains(HEADER)),
        }
    }

    fn checksum(&self, path: &str) -> Option<u32> {
        self.checksums.as_ref()?.get(path).copied()
    }

    /// The file is there as the earlier run wrote it.
    fn is_as_written(&self, path: &str, place: &Path) -> bool {
        let written = self.checksum(path);
        written.is_some() && fs::read(place).is_ok_and(|old| Some(checksum(&old)) == written)
    }

    /// `None` where the file is absent, or has the contents already.
    fn standing(&self, folder: &Path, file: &SourceFile) -> Option<Standing> {
        let old = fs::read(folder.join(&file.path)).ok()?;
        if old == *file.contents {
            return None;
        }
        Some(match self.checksum(&file.path) {
            Some(written) if written == checksum(&old) => Standing::Ours,
            Some(_) => Standing::Edited,
            None if self.checksums.is_none() && self.is_older => Standing::Ours,
            None => Standing::Foreign,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(all: &[(&str, &'static str)]) -> Vec<SourceFile> {
        let file = |&(path, text): &(&str, &'static str)| SourceFile {
            path: path.into(),
            contents: text.as_bytes().into(),
        };
        all.iter().map(file).collect()
    }

    #[test]
    fn an_edited_file_is_kept_with_the_new_one_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("boards/wiring.rs");
        let put = |text| update(folder.path(), &files(&[("boards/wiring.rs", text)])).unwrap();
        assert!(put("one").is_empty());
        assert!(put("two").is_empty());
        assert_eq!(fs::read(&place).unwrap(), b"two");
        fs::write(&place, "mine").unwrap();
        assert_eq!(put("two"), std::slice::from_ref(&place));
        assert!(!folder.path().join("boards/wiring.rs.new").exists());
        assert_eq!(put("three"), std::slice::from_ref(&place));
        assert_eq!(fs::read(&place).unwrap(), b"mine");
        let beside = fs::read(folder.path().join("boards/wiring.rs.new"));
        assert_eq!(beside.unwrap(), b"three");
    }

    #[test]
    fn somebody_elses_file_is_refused_before_anything_is_written() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("Cargo.toml"), "theirs").unwrap();
        let written = files(&[("model/a.rs", "a"), ("Cargo.toml", "ours")]);
        let refused = update(folder.path(), &written).unwrap_err().to_string();
        assert!(
            refused.contains("Cargo.toml: not written by sinew"),
            "{refused}"
        );
        assert!(!folder.path().join("model").exists());
        // The same contents are nobody's loss.
        fs::write(folder.path().join("Cargo.toml"), "ours").unwrap();
        assert!(update(folder.path(), &written).unwrap().is_empty());
    }

    #[test]
    fn a_folder_of_a_program_without_lists_is_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let older = [("model/Cargo.toml", HEADER), ("Cargo.toml", "older")];
        for (path, text) in older {
            sinew_files::write(folder.path().join(path), text).unwrap();
        }
        is_free(folder.path(), ["Cargo.toml"].into_iter()).unwrap();
        let new = files(&[("model/Cargo.toml", "new"), ("Cargo.toml", "new")]);
        assert!(update(folder.path(), &new).unwrap().is_empty());
        assert_eq!(fs::read(folder.path().join("Cargo.toml")).unwrap(), b"new");
    }

    #[test]
    fn a_file_that_is_no_longer_written_goes_and_an_edited_one_stays() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        update(folder.path(), &files(&[("a", "a"), ("b", "b"), ("c", "c")])).unwrap();
        fs::write(at("b"), "mine").unwrap();
        fs::write(at("d"), "theirs").unwrap();
        update(folder.path(), &files(&[("c", "c")])).unwrap();
        let left = ["a", "b", "c", "d"].map(|name| at(name).exists());
        assert_eq!(left, [false, true, true, true]);
    }
}
