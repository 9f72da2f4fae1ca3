//! Embeds the sources that a user's own firmware is built from, so that the program works wherever
//! it is installed: the crates of `firmware/`, the boards, and the workspace settings they inherit.
//!
//! `embedded/` holds links to them, and copies in a package. Cargo leaves folders with a
//! `Cargo.toml` out of a package, hence the other names ([`NAMES`]).

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// Name in `embedded/`, name in a project.
const NAMES: [(&str, &str); 4] = [
    ("workspace.toml", "Cargo.toml"),
    ("manifest.toml", "Cargo.toml"),
    ("lock.toml", "Cargo.lock"),
    ("cargo-config.toml", ".cargo/config.toml"),
];

/// Path in a project, file that holds it.
type Source = (PathBuf, PathBuf);

fn main() -> io::Result<()> {
    let package = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").ok_or(io::ErrorKind::NotFound)?);
    let mut files = Vec::new();
    collect(&package.join("embedded"), Path::new(""), &mut files)?;
    files.sort();

    let mut list = String::from("/// (path from the project's root, contents), sorted by path.\n");
    list.push_str("pub static SOURCES: &[(&str, &[u8])] = &[\n");
    for (path, file) in &files {
        println!("cargo:rerun-if-changed={}", file.display());
        let _ = writeln!(
            list,
            "    ({:?}, include_bytes!({file:?})),",
            path.display().to_string()
        );
    }
    list.push_str("];\n");
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or(io::ErrorKind::NotFound)?);
    fs::write(out.join("sources.rs"), list)
}

/// The files below a folder, links followed to what they stand for.
fn collect(folder: &Path, path: &Path, files: &mut Vec<Source>) -> io::Result<()> {
    // A file that comes or goes changes its folder.
    println!("cargo:rerun-if-changed={}", folder.display());
    for entry in fs::read_dir(folder)? {
        let name = entry?.file_name();
        let source = fs::canonicalize(folder.join(&name))?;
        let known = NAMES.iter().find(|(link, _)| name == **link);
        let target = match known {
            Some((_, project)) => path.join(project),
            None => path.join(&name),
        };
        if source.is_dir() {
            collect(&source, &target, files)?;
        } else {
            files.push((target, source));
        }
    }
    Ok(())
}
