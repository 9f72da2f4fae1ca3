//! A program of a Debian package, unpacked in the build folder with the libraries that are missing.
//!
//! The way out where apt would have to remove a package, or nobody may install one: packages are
//! fetched and unpacked, and nothing of the system changes.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::process::{self, answer, target_folder};

/// Folder that is searched for programs behind the system's own.
fn programs() -> PathBuf {
    target_folder().join("tools/bin")
}

/// True where [`unpack`] has left `program`, and the search for programs does not reach it yet.
pub(crate) fn present(program: &str) -> bool {
    programs().join(program).is_file() && !searched(&programs())
}

fn searched(folder: &Path) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|entry| entry == folder)
}

/// Fetches the package named as `program` and what it needs, and unpacks all into the build folder.
///
/// # Errors
/// The package lists are empty, a package cannot be fetched, or the program does not run.
pub(crate) fn unpack(program: &str) -> Result<()> {
    let into = target_folder().join("tools").join(program);
    let mut plan = Command::new("apt-get");
    plan.args(["install", "--simulate", "--no-install-recommends", program]);
    let plan = answer(&mut plan).with_context(|| format!("apt-get knows no way to {program}"))?;
    let packages = to_install(&plan);
    ensure!(
        !packages.is_empty(),
        "apt-get names no package for {program}"
    );
    println!(
        "setup: unpacking it in {} instead; nothing of the system changes",
        into.display()
    );
    let fetched = into.join("packages");
    let root = into.join("root");
    fs::create_dir_all(&fetched)?;
    let mut fetch = Command::new("apt-get");
    fetch.args(["download", "--quiet"]).args(&packages);
    process::run(fetch.current_dir(&fetched))?;
    for package in files(&fetched)? {
        let mut extract = Command::new("dpkg-deb");
        extract.arg("--extract").arg(&package).arg(&root);
        if answer(&mut extract).is_none() {
            bail!("dpkg-deb cannot unpack {}", package.display());
        }
    }
    fs::remove_dir_all(&fetched)?;
    let mut libraries = BTreeSet::new();
    folders_of_libraries(&root, &mut libraries)?;
    write_starter(program, &root, &libraries)?;
    let starter = programs().join(program);
    if answer(Command::new(&starter).arg("--version")).is_none() {
        bail!(
            "{program} was unpacked, but {} does not run",
            starter.display()
        );
    }
    Ok(())
}

/// Packages that a simulated `apt-get install` would install.
fn to_install(plan: &str) -> Vec<&str> {
    let lines = plan.lines().filter_map(|line| line.strip_prefix("Inst "));
    lines.filter_map(|line| line.split(' ').next()).collect()
}

fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = folder.read_dir()?.map(|entry| Ok(entry?.path()));
    entries.collect()
}

fn folders_of_libraries(folder: &Path, found: &mut BTreeSet<PathBuf>) -> Result<()> {
    for path in files(folder)? {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if path.is_dir() && !path.is_symlink() {
            folders_of_libraries(&path, found)?;
        } else if name.contains(".so") {
            found.insert(folder.to_path_buf());
        }
    }
    Ok(())
}

/// Writes the script that starts the program with its libraries. The process becomes the program:
/// what kills one kills the other.
fn write_starter(program: &str, root: &Path, libraries: &BTreeSet<PathBuf>) -> Result<()> {
    let libraries: Vec<_> = libraries.iter().map(|l| l.display().to_string()).collect();
    let script = format!(
        "#!/bin/sh\nexec env LD_LIBRARY_PATH='{}' '{}' \"$@\"\n",
        libraries.join(":"),
        root.join("usr/bin").join(program).display()
    );
    fs::create_dir_all(programs())?;
    let starter = programs().join(program);
    fs::write(&starter, script)?;
    fs::set_permissions(&starter, fs::Permissions::from_mode(0o755))?;
    Ok(())
}

/// Starts this program again with the folder of unpacked programs behind all others: it and all its
/// children find them. It returns only where that fails.
///
/// # Errors
/// This program cannot be started.
pub(crate) fn start_again() -> Result<()> {
    let folder = programs();
    ensure!(
        !searched(&folder),
        "a program of {} does not run; delete that folder and try again",
        folder.display()
    );
    println!(
        "setup: for other commands, export PATH=\"$PATH:{}\"",
        folder.display()
    );
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(std::env::split_paths(&path).chain([folder]))?;
    let mut again = Command::new(std::env::current_exe()?);
    let error = again
        .args(std::env::args_os().skip(1))
        .env("PATH", path)
        .exec();
    Err(error).context("cannot start again with another PATH")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_apt_would_install_is_fetched() {
        let plan = "Remv qemu-utils [1:10.0.2]\n\
                    Inst libfdt1 (1.6.1-4 Debian:12 [amd64])\n\
                    Inst qemu-system-arm (1:7.2 Debian:12 [amd64])\n\
                    Conf libfdt1 (1.6.1-4 Debian:12 [amd64])\n";
        assert_eq!(to_install(plan), ["libfdt1", "qemu-system-arm"]);
    }

    #[test]
    fn folders_of_libraries_are_found_at_any_depth() {
        let folder = tempfile::tempdir().expect("a folder");
        let deep = folder.path().join("usr/lib/own");
        fs::create_dir_all(&deep).expect("folders");
        fs::write(deep.join("libown.so.1"), "").expect("a file");
        fs::write(folder.path().join("usr/readme"), "").expect("a file");
        let mut found = BTreeSet::new();
        folders_of_libraries(folder.path(), &mut found).expect("read");
        assert_eq!(found.into_iter().collect::<Vec<_>>(), [deep]);
    }
}
