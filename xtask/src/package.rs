//! `cargo xtask package`: every crate that can be published packages, and what lies in the packages
//! compiles.
//!
//! Cargo's own verification would build each package with the profile of its own manifest: burn
//! once more, in full. So the packages are unpacked side by side into a workspace that has this
//! one's lock file and profiles, and checked there with the dependencies that the other stages have
//! compiled.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;
use xtask::process::{self, cargo, root, target_folder};

/// Behind a feature of `sinew`; a workspace of its own, so the others' packages do not know it.
const PROBE: &str = "boards/probe";
/// Links to these stand in `host/sinew/embedded`.
const EMBEDDED: &[&str] = &[
    "firmware/mpc",
    "firmware/device",
    "boards/runtime",
    "boards/host",
    "boards/qemu",
    "boards/stm32f446",
    "boards/nrf52840",
];
/// Parts of those that a project needs no copy of.
const LEFT_OUT: &[&str] = &["tests", "examples", "benches", "scripts", "README.md"];

/// A package of the workspace that can be published.
struct Package {
    name: String,
    version: String,
}

/// # Errors
/// A crate does not package, a package does not compile, or an embedded file differs from its
/// source.
pub fn check() -> Result<()> {
    let packages = publishable()?;
    let mut command = cargo(&["package", "--offline", "--no-verify", "--quiet"]);
    command
        .arg("--config")
        .arg(patch("sinew-probe", Path::new(PROBE)));
    for package in &packages {
        command.args(["--package", &package.name]);
    }
    process::run(&mut command)?;
    let folder = target_folder().join("package/checked");
    if folder.exists() {
        fs::remove_dir_all(&folder)
            .with_context(|| format!("cannot remove {}", folder.display()))?;
    }
    fs::create_dir_all(&folder)?;
    for package in &packages {
        let archive = target_folder().join(format!("package/{}.crate", package.stem()));
        let mut tar = Command::new("tar");
        // Of this moment: cargo would take what it compiled of an older package for up to date.
        tar.args(["--touch", "-xzf"])
            .arg(archive)
            .arg("-C")
            .arg(&folder);
        process::run(&mut tar)?;
    }
    embedded(&folder, &packages)?;
    fs::write(folder.join("Cargo.toml"), workspace(&packages)?)?;
    fs::copy(root().join("Cargo.lock"), folder.join("Cargo.lock"))?;
    let mut command = cargo(&["check", "--workspace", "--offline", "--quiet"]);
    command.arg("--target-dir").arg(target_folder());
    process::run(command.current_dir(&folder))
}

impl Package {
    fn stem(&self) -> String {
        format!("{}-{}", self.name, self.version)
    }
}

fn publishable() -> Result<Vec<Package>> {
    let arguments = ["metadata", "--no-deps", "--format-version", "1"];
    let metadata = process::json(&mut cargo(&arguments))?;
    let packages = metadata["packages"]
        .as_array()
        .context("cargo metadata lists packages")?;
    let text = |package: &Value, key: &str| -> Result<String> {
        let text = package[key].as_str();
        Ok(text
            .with_context(|| format!("a package has a {key}"))?
            .into())
    };
    (packages.iter())
        .filter(|package| package["publish"].is_null())
        .map(|package| {
            Ok(Package {
                name: text(package, "name")?,
                version: text(package, "version")?,
            })
        })
        .collect()
}

fn patch(name: &str, path: &Path) -> String {
    format!("patch.crates-io.{name}.path={:?}", root().join(path))
}

/// The manifest of the workspace of unpacked packages.
fn workspace(packages: &[Package]) -> Result<String> {
    let ours = fs::read_to_string(root().join("Cargo.toml"))?;
    let profiles = ours.find("[profile").context("Cargo.toml has profiles")?;
    let members: Vec<String> = packages.iter().map(Package::stem).collect();
    let mut text =
        format!("[workspace]\nresolver = \"3\"\nmembers = {members:?}\n\n[patch.crates-io]\n");
    for package in packages {
        text += &format!("{} = {{ path = {:?} }}\n", package.name, package.stem());
    }
    text += &format!("sinew-probe = {{ path = {:?} }}\n\n", root().join(PROBE));
    Ok(text + &ours[profiles..])
}

/// Every source that a project needs lies in the package of `sinew`, byte by byte.
fn embedded(folder: &Path, packages: &[Package]) -> Result<()> {
    let sinew = packages.iter().find(|package| package.name == "sinew");
    let sinew = sinew.context("the program is publishable")?;
    let copies = folder.join(sinew.stem()).join("embedded");
    let mut wrong = Vec::new();
    let files = process::answer(
        Command::new("git")
            .arg("ls-files")
            .args(EMBEDDED)
            .current_dir(root()),
    );
    for file in files.context("git lists files")?.lines() {
        let Some(copy) = copy_of(file) else {
            continue;
        };
        if fs::read(root().join(file)).ok() != fs::read(copies.join(&copy)).ok() {
            wrong.push(format!(
                "host/sinew/embedded/{} is no link to {file}",
                copy.display()
            ));
        }
    }
    if wrong.is_empty() {
        return Ok(());
    }
    bail!("{}", wrong.join("\n"))
}

/// Path below `embedded` of a tracked file; none where a project does without.
fn copy_of(file: &str) -> Option<PathBuf> {
    let (name, inside) = EMBEDDED.iter().find_map(|name| {
        let inside = file.strip_prefix(name)?.strip_prefix('/')?;
        Some((*name, inside))
    })?;
    if LEFT_OUT
        .iter()
        .any(|part| inside.split('/').next() == Some(part))
    {
        return None;
    }
    let inside = match inside {
        "Cargo.toml" => "manifest.toml",
        "Cargo.lock" => "lock.toml",
        ".cargo/config.toml" => "cargo-config.toml",
        other => other,
    };
    Some(Path::new(name).join(inside))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_manifest_has_another_name_in_the_package() {
        let copy = copy_of("boards/qemu/Cargo.toml");
        assert_eq!(copy, Some(PathBuf::from("boards/qemu/manifest.toml")));
        let copy = copy_of("firmware/mpc/src/lib.rs");
        assert_eq!(copy, Some(PathBuf::from("firmware/mpc/src/lib.rs")));
        assert_eq!(copy_of("firmware/mpc/tests/a.rs"), None);
        assert_eq!(copy_of("sim/src/lib.rs"), None);
    }
}
