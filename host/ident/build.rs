//! Commit of the program, for the last line of pages: `SINEW_COMMIT` at compile time.
//!
//! Release builds only: a build for development would compile anew after each commit.

use std::path::PathBuf;
use std::process::Command;
use std::{env, fs};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("PROFILE").as_deref() != Ok("release") {
        return;
    }
    let package = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let of_package = || {
        let text = fs::read_to_string(package.join(".cargo_vcs_info.json")).ok()?;
        let (_, rest) = text.split_once("\"sha1\"")?;
        Some(rest.split('"').nth(1)?.get(..12)?.to_owned())
    };
    let git = |arguments: &[&str]| {
        let said = Command::new("git")
            .args(arguments)
            .current_dir(&package)
            .output()
            .ok()?;
        let text = String::from_utf8(said.stdout).ok()?;
        said.status.success().then(|| text.trim().to_owned())
    };
    let Some(commit) = of_package().or_else(|| git(&["rev-parse", "--short=12", "HEAD"])) else {
        return;
    };
    println!("cargo:rustc-env=SINEW_COMMIT={commit}");
    // The log grows by a line with every commit and checkout.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) {
        println!("cargo:rerun-if-changed={}", package.join(log).display());
    }
}
