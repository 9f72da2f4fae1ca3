//! Files that an earlier run wrote: an edited one is kept, a stale one goes, and nobody else's file
//! is replaced.
//!
//! A list in the project's folder has the checksum of every written file. Nothing outside the
//! folder is ever written or removed, whatever the list says and wherever links lead.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Component, Path, PathBuf};

use sinew_ident::error::{Error, Result};

/// List of the written files with their checksums, in the project's folder.
const LIST: &str = ".sinew-written";

/// First line of the list.
const TITLE: &str = "# Written by sinew, with checksums: an edited file is kept.";

/// Ending of a new version beside an edited file.
const NEW: &str = "new";

/// A file of a project.
pub struct SourceFile {
    /// Path within the project, with `/`.
    pub path: String,
    pub contents: Cow<'static, [u8]>,
    /// Written where it is absent only: other programs change it in place.
    pub once: bool,
}

/// An edited file, which stayed as it is.
#[derive(Debug, PartialEq, Eq)]
pub struct Kept {
    /// The file.
    pub path: PathBuf,
    /// Its new version is written beside it, as `NAME.new`.
    pub new: bool,
}

/// Checksums of the versions of each file, by path.
type Checksums = BTreeMap<String, Vec<u32>>;

/// Standing of a file that is there with other contents.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Standing {
    /// As an earlier run left it.
    Ours,
    /// Written by an earlier run, and changed since.
    Edited,
    /// Never written by this program, no file, or outside the folder.
    Foreign,
}

/// Writes the files of a project, and removes those of an earlier run that are no longer among
/// them. Returns the edited files, which stay; a new version stands beside one as `NAME.new`.
///
/// # Errors
/// Before anything is written, where somebody else's file stands in the place of one, a link leads
/// out of the folder, or the list is damaged; a file that cannot be written.
pub fn update(folder: &Path, files: &[SourceFile]) -> Result<Vec<Kept>> {
    let before = List::read(folder)?;
    let in_the_way = |file: &&SourceFile| {
        let standing = before.standing(folder, &file.path, &file.contents);
        standing == Some(Standing::Foreign) && !(file.once && folder.join(&file.path).is_file())
    };
    if let Some(foreign) = files.iter().find(in_the_way) {
        return Err(before.refusal(folder, &foreign.path));
    }
    let lasting = files.iter().filter(|file| !file.once);
    let mut now: Checksums = lasting
        .map(|file| (file.path.clone(), vec![checksum(&file.contents)]))
        .collect();
    // A program that is stopped on the way leaves files of both versions, and both are its own.
    List::write(folder, before.checksums.iter().chain([&now]))?;
    let mut kept = Vec::new();
    for file in files {
        let path = folder.join(&file.path);
        if file.once {
            if !path.exists() {
                sinew_files::write(&path, &file.contents)?;
            }
            continue;
        }
        if before.standing(folder, &file.path, &file.contents) != Some(Standing::Edited) {
            sinew_files::write_changed(&path, &file.contents)?;
            make_startable(&path, &file.contents)?;
            continue;
        }
        let beside = format!("{}.{NEW}", file.path);
        let waits = before.has_written(&beside) && folder.join(&beside).exists();
        let is_new = waits || !before.wrote(&file.path, checksum(&file.contents));
        let standing = before.standing(folder, &beside, &file.contents);
        let new = is_new && matches!(standing, None | Some(Standing::Ours));
        if new {
            sinew_files::write_changed(folder.join(&beside), &file.contents)?;
            now.insert(beside, vec![checksum(&file.contents)]);
        }
        kept.push(Kept { path, new });
    }
    for path in before.checksums.iter().flat_map(BTreeMap::keys) {
        let place = folder.join(path);
        if !now.contains_key(path) && before.is_as_written(folder, path) {
            fs::remove_file(&place).map_err(|error| Error::write(&place, error))?;
        }
    }
    List::write(folder, [&now])?;
    Ok(kept)
}

/// Refuses a folder in which somebody else's file stands at one of these paths.
///
/// # Errors
/// The first such file, or a list that is damaged.
pub fn is_free<'a>(folder: &Path, mut paths: impl Iterator<Item = &'a str>) -> Result<()> {
    let before = List::read(folder)?;
    let foreign = |path: &&str| !before.has_written(path) && !path.ends_with("Cargo.lock");
    match paths.find(|path| foreign(path) && folder.join(path).exists()) {
        Some(path) => Err(before.refusal(folder, path)),
        None => Ok(()),
    }
}

/// Lets a script be started by its name, as cargo starts the runner of a board.
fn make_startable(path: &Path, contents: &[u8]) -> Result<()> {
    if !contents.starts_with(b"#!") {
        return Ok(());
    }
    let failed = |error| Error::write(path, error);
    let mut permissions = fs::metadata(path).map_err(failed)?.permissions();
    permissions.set_mode(permissions.mode() | 0o111);
    fs::set_permissions(path, permissions).map_err(failed)
}

fn checksum(contents: &[u8]) -> u32 {
    crc32fast::hash(contents)
}

/// The path stays within a folder by its own words.
fn is_plain(path: &str) -> bool {
    let mut parts = Path::new(path).components();
    !path.is_empty() && parts.all(|part| matches!(part, Component::Normal(_)))
}

/// No link on the way to `path`, the last part included, leads out of the folder.
fn is_inside(folder: &Path, path: &str) -> bool {
    let Ok(root) = folder.canonicalize() else {
        // There is no folder yet, so there is no link in it.
        return true;
    };
    let mut place = folder.to_path_buf();
    Path::new(path).components().all(|part| {
        place.push(part);
        match place.symlink_metadata() {
            Ok(found) if found.is_symlink() => {
                place.canonicalize().is_ok_and(|end| end.starts_with(&root))
            }
            _ => true,
        }
    })
}

/// The list of an earlier run.
struct List {
    /// `None` where there is no list.
    checksums: Option<Checksums>,
}

impl List {
    fn read(folder: &Path) -> Result<Self> {
        let file = folder.join(LIST);
        let bytes = match fs::read(&file) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Ok(Self { checksums: None });
            }
            Err(error) => return Err(Error::read(file, error)),
        };
        let damaged = |line: usize| {
            Error::file(&file, "damaged: it lists the files that sinew wrote here")
                .at(line, 1)
                .expected("a checksum and a path within the folder, a line a file")
                .help("restore it, or name another folder")
        };
        let text = String::from_utf8(bytes).map_err(|_| damaged(1))?;
        let mut lines = text.lines();
        if lines.next() != Some(TITLE) || !is_inside(folder, LIST) {
            return Err(damaged(1));
        }
        let entry = |line: &str| {
            let (checksum, path) = line.split_once(' ')?;
            let checksum = u32::from_str_radix(checksum, 16).ok()?;
            is_plain(path).then(|| (path.to_owned(), checksum))
        };
        let mut checksums = Checksums::new();
        for (index, line) in lines.enumerate() {
            let (path, checksum) = entry(line).ok_or_else(|| damaged(index + 2))?;
            checksums.entry(path).or_default().push(checksum);
        }
        let checksums = Some(checksums);
        Ok(Self { checksums })
    }

    fn write<'a>(folder: &Path, all: impl IntoIterator<Item = &'a Checksums>) -> Result<()> {
        let entries = all.into_iter().flatten();
        let lines = entries.flat_map(|(path, checksums)| {
            let line = move |checksum: &u32| format!("{checksum:08x} {path}\n");
            checksums.iter().map(line)
        });
        let text = format!("{TITLE}\n{}", lines.collect::<String>());
        Ok(sinew_files::write_changed(folder.join(LIST), text)?)
    }

    /// An earlier run has written a file at this path.
    fn has_written(&self, path: &str) -> bool {
        self.checksums.iter().any(|all| all.contains_key(path))
    }

    /// An earlier run has written these contents at this path.
    fn wrote(&self, path: &str, checksum: u32) -> bool {
        let versions = self.checksums.iter().filter_map(|all| all.get(path));
        versions.flatten().any(|known| *known == checksum)
    }

    /// The file is there as the earlier run wrote it.
    fn is_as_written(&self, folder: &Path, path: &str) -> bool {
        let old = fs::read(folder.join(path));
        is_inside(folder, path) && old.is_ok_and(|old| self.wrote(path, checksum(&old)))
    }

    /// `None` where the file is absent, or has the contents already.
    fn standing(&self, folder: &Path, path: &str, contents: &[u8]) -> Option<Standing> {
        if !is_inside(folder, path) {
            return Some(Standing::Foreign);
        }
        let place = folder.join(path);
        if place.is_dir() {
            return Some(Standing::Foreign);
        }
        let old = fs::read(place).ok()?;
        if old == contents {
            return None;
        }
        Some(if self.wrote(path, checksum(&old)) {
            Standing::Ours
        } else if self.has_written(path) {
            Standing::Edited
        } else {
            Standing::Foreign
        })
    }

    /// Error about a path at which nothing may be written.
    fn refusal(&self, folder: &Path, path: &str) -> Error {
        let place = folder.join(path);
        let message = if !is_inside(folder, path) {
            "a link that leads out of the folder"
        } else if place.is_dir() {
            "a folder, where a file would be written"
        } else if self.checksums.is_none() {
            "would be replaced, and there is no list of files that sinew wrote here (.sinew-written)"
        } else {
            "would be replaced, and is not among the files that sinew wrote here (.sinew-written)"
        };
        Error::file(place, message).help("name another folder, or move the file")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(all: &[(&str, &'static str)]) -> Vec<SourceFile> {
        let file = |&(path, text): &(&str, &'static str)| SourceFile {
            path: path.into(),
            contents: text.as_bytes().into(),
            once: false,
        };
        all.iter().map(file).collect()
    }

    /// Cargo starts the runner of a board by its name.
    #[test]
    fn a_script_may_be_started_and_other_files_may_not() {
        let folder = tempfile::tempdir().unwrap();
        let both = [("run.sh", "#!/bin/sh\n"), ("run.rs", "fn run() {}")];
        update(folder.path(), &files(&both)).unwrap();
        let startable = |name| {
            let mode = fs::metadata(folder.path().join(name)).unwrap();
            mode.permissions().mode() & 0o111
        };
        assert_eq!((startable("run.sh"), startable("run.rs")), (0o111, 0));
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
        let kept = |new| {
            [Kept {
                path: place.clone(),
                new,
            }]
        };
        assert_eq!(put("two"), kept(false));
        assert!(!folder.path().join("boards/wiring.rs.new").exists());
        assert_eq!(put("three"), kept(true));
        assert_eq!(fs::read(&place).unwrap(), b"mine");
        let beside = fs::read(folder.path().join("boards/wiring.rs.new"));
        assert_eq!(beside.unwrap(), b"three");
        // It waits, and goes with the edit.
        assert_eq!(put("three"), kept(true));
        fs::write(&place, "three").unwrap();
        assert!(put("four").is_empty());
        assert!(!folder.path().join("boards/wiring.rs.new").exists());
    }

    #[test]
    fn somebody_elses_file_is_refused_before_anything_is_written() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("Cargo.toml"), "theirs").unwrap();
        let written = files(&[("model/a.rs", "a"), ("Cargo.toml", "ours")]);
        let refused = update(folder.path(), &written).unwrap_err().to_string();
        assert!(
            refused.contains("Cargo.toml: would be replaced"),
            "{refused}"
        );
        assert!(!folder.path().join("model").exists());
        // The same contents are nobody's loss.
        fs::write(folder.path().join("Cargo.toml"), "ours").unwrap();
        assert!(update(folder.path(), &written).unwrap().is_empty());
    }

    #[test]
    fn without_its_list_a_project_is_refused_and_a_damaged_list_too() {
        let folder = tempfile::tempdir().unwrap();
        let (list, file) = (folder.path().join(LIST), folder.path().join("a.rs"));
        let put = |text| update(folder.path(), &files(&[("a.rs", text)]));
        put("one").unwrap();
        let whole = fs::read_to_string(&list).unwrap();
        let outside = tempfile::NamedTempFile::new_in(folder.path().parent().unwrap()).unwrap();
        let escape = format!(
            "../{}",
            outside.path().file_name().unwrap().to_string_lossy()
        );
        let absolute = outside.path().display().to_string();
        let named = |path: &str| format!("{whole}{:08x} {path}\n", checksum(b""));
        for (text, line) in [
            (String::new(), 1),
            (format!("<<<<<<< ours\n{whole}"), 1),
            (format!("{whole}no checksum\n"), 3),
            (named(&escape), 3),
            (named(&absolute), 3),
            (named(&format!("src/../{escape}")), 3),
        ] {
            fs::write(&list, &text).unwrap();
            let refused = put("two").unwrap_err().to_string();
            assert!(
                refused.contains(&format!("{LIST}:{line}:1: damaged")),
                "{text}: {refused}"
            );
        }
        fs::remove_file(&list).unwrap();
        let refused = put("two").unwrap_err().to_string();
        assert!(refused.contains("there is no list"), "{refused}");
        assert!(is_free(folder.path(), ["a.rs"].into_iter()).is_err());
        assert_eq!(fs::read(&file).unwrap(), b"one");
        assert!(outside.path().exists());
    }

    #[cfg(unix)]
    #[test]
    fn no_link_leads_a_file_out_of_the_folder() {
        let [folder, outside] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let put = |text| update(folder.path(), &files(&[("src/a.rs", text)]));
        put("one").unwrap();
        let theirs = outside.path().join("a.rs");
        fs::write(&theirs, "one").unwrap();
        fs::remove_dir_all(folder.path().join("src")).unwrap();
        std::os::unix::fs::symlink(outside.path(), folder.path().join("src")).unwrap();
        let refused = put("two").unwrap_err().to_string();
        assert!(refused.contains("leads out of the folder"), "{refused}");
        // It is as it was written, and no longer among the files.
        update(folder.path(), &files(&[("b.rs", "b")])).unwrap();
        assert_eq!(fs::read(&theirs).unwrap(), b"one");
    }

    #[test]
    fn nothing_is_written_where_a_folder_is_in_the_way() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("b.rs")).unwrap();
        let mut all = files(&[("a.rs", "a"), ("b.rs", "b"), ("Cargo.lock", "lock")]);
        all[2].once = true;
        assert!(update(folder.path(), &all).is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_lock_is_written_once_and_a_new_version_spares_somebody_elses_file() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let put = |text| {
            let mut all = files(&[("a.rs", text), ("Cargo.lock", text)]);
            all[1].once = true;
            update(folder.path(), &all).unwrap()
        };
        put("one");
        fs::write(at("Cargo.lock"), "resolved").unwrap();
        fs::write(at("a.rs"), "mine").unwrap();
        fs::write(at("a.rs.new"), "my merge").unwrap();
        assert_eq!(
            put("two"),
            [Kept {
                path: at("a.rs"),
                new: false
            }]
        );
        assert_eq!(fs::read(at("Cargo.lock")).unwrap(), b"resolved");
        assert_eq!(fs::read(at("a.rs.new")).unwrap(), b"my merge");
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
