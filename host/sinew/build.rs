//! Embeds the sources that a user's own firmware is built from, so that the program works wherever
//! it is installed: `firmware/`, the boards, and the workspace settings they inherit.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// What travels, relative to the project's root.
const TREES: [&str; 6] = [
    "firmware",
    "boards/runtime",
    "boards/host",
    "boards/qemu",
    "boards/stm32f446",
    "boards/nrf52840",
];
const FILES: [&str; 1] = ["Cargo.toml"];
/// Build outputs and snapshots of tests are not sources.
const SKIPPED: [&str; 4] = ["target", "tests", "proptest-regressions", "README.md"];

fn main() -> io::Result<()> {
    let package = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").ok_or(io::ErrorKind::NotFound)?);
    let root = package.ancestors().nth(2).ok_or(io::ErrorKind::NotFound)?;
    let mut files = Vec::new();
    for file in FILES {
        files.push(PathBuf::from(file));
    }
    for tree in TREES {
        println!("cargo:rerun-if-changed={}", root.join(tree).display());
        collect(root, Path::new(tree), &mut files)?;
    }
    files.sort();

    let mut list = String::from("/// (path from the project's root, contents), sorted by path.\n");
    list.push_str("pub static SOURCES: &[(&str, &[u8])] = &[\n");
    for file in &files {
        let path = root.join(file);
        println!("cargo:rerun-if-changed={}", path.display());
        let _ = writeln!(
            list,
            "    ({:?}, include_bytes!({path:?})),",
            file.display().to_string()
        );
    }
    list.push_str("];\n");
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or(io::ErrorKind::NotFound)?);
    fs::write(out.join("sources.rs"), list)
}

fn collect(root: &Path, folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(root.join(folder))? {
        let entry = entry?;
        let name = entry.file_name();
        if SKIPPED.iter().any(|s| name == *s) {
            continue;
        }
        let path = folder.join(&name);
        if entry.file_type()?.is_dir() {
            collect(root, &path, files)?;
        } else {
            files.push(path);
        }
    }
    Ok(())
}
