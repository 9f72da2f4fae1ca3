//! `cargo xtask dist`: the release archive of this computer's system, or of another target that
//! runs here; `cargo xtask cross`: the program checked for the targets of releases.
//!
//! On Linux x86-64 the program is linked statically with glibc, so that it runs on any
//! distribution. It looks up no host and no user, which are what a static glibc cannot do. For
//! aarch64 Linux the static program is that of the target with musl.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};

use xtask::process::{self, answer, cargo, root, target_folder};

/// Shells with the names of their completion scripts.
const SHELLS: [(&str, &str); 5] = [
    ("bash", "sinew.bash"),
    ("zsh", "_sinew"),
    ("fish", "sinew.fish"),
    ("elvish", "sinew.elv"),
    ("powershell", "_sinew.ps1"),
];
/// Files of the checkout that go along as they are.
const FILES: [&str; 4] = ["README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE"];
/// Longest time from an archive to a first report, seconds.
const PATIENCE_S: f64 = 60.0;
/// Target whose program is linked statically.
const STATIC: &str = "x86_64-unknown-linux-gnu";
/// Command line of the first report, in the folder of the archive.
const FIRST: [&str; 8] = [
    "diagnose",
    "rigs/mass-spring-damper.toml",
    "--fit",
    "rigs/mass-spring-damper.fit.csv",
    "--test",
    "rigs/mass-spring-damper.test.csv",
    "--report",
    "report.html",
];

/// Targets of releases with what is checked for each: packages and features.
const CROSS: [(&str, &[&str]); 3] = [
    (
        "aarch64-unknown-linux-musl",
        &["--package", "sinew", "--features", "probe"],
    ),
    (
        "aarch64-unknown-linux-gnu",
        &["--package", "sinew-ident", "--features", "cli"],
    ),
    (
        "x86_64-pc-windows-gnu",
        &["--package", "sinew-ident", "--features", "cli"],
    ),
];

/// Options of [`run`].
#[derive(Debug, Default, PartialEq)]
struct Options<'a> {
    profile: Option<&'a str>,
    target: Option<&'a str>,
}

impl<'a> Options<'a> {
    fn parse(arguments: &'a [String]) -> Result<Self> {
        let mut options = Self::default();
        for pair in arguments.chunks(2) {
            match pair {
                [flag, name] if flag == "--profile" => options.profile = Some(name),
                [flag, name] if flag == "--target" => options.target = Some(name),
                _ => bail!("dist takes nothing, or --profile NAME, or --target TRIPLE"),
            }
        }
        Ok(options)
    }
}

/// `cargo check` of the program, debug probes included, for each target of a release. A target
/// that rustup cannot add is named as skipped.
///
/// # Errors
/// The program does not compile for a target.
pub fn cross(arguments: &[String]) -> Result<()> {
    crate::arguments::none(arguments)?;
    process::run(&mut cargo(&[
        "check",
        "--package",
        "sinew",
        "--features",
        "probe",
    ]))?;
    for (target, what) in CROSS {
        let mut add = Command::new("rustup");
        if process::run(add.args(["target", "add", target])).is_err() {
            println!("SKIPPED: rustup cannot add {target}");
            continue;
        }
        process::run(cargo(&["check", "--target", target]).args(what))?;
    }
    Ok(())
}

/// Builds the archive, unpacks it elsewhere and makes a first report with it. `--profile NAME`
/// takes another profile than `release`, `--target TRIPLE` another target that runs here.
///
/// # Errors
/// The program does not build, a file is missing, the unpacked program fails or takes too long.
pub fn run(arguments: &[String]) -> Result<()> {
    let options = Options::parse(arguments)?;
    let profile = options.profile.unwrap_or("release");
    let target = match options.target {
        Some(target) => target.to_owned(),
        None => host()?,
    };
    let program = build(profile, &target, options.target.is_some())?;
    let name = format!("sinew-{}-{target}", env!("CARGO_PKG_VERSION"));
    let out = target_folder().join("dist");
    let folder = out.join(&name);
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fill(&folder, &program)?;
    let archive = out.join(format!("{name}.tar.gz"));
    let mut tar = Command::new("tar");
    tar.args(["--create", "--gzip", "--file"]).arg(&archive);
    process::run(tar.arg("--directory").arg(&out).arg(&name))?;
    try_out(&archive, &name, &target)?;
    let size = fs::metadata(&archive)?.len();
    println!("{} ({:.1} MB)", archive.display(), size as f64 / 1e6);
    Ok(())
}

/// Target triple of this computer.
fn host() -> Result<String> {
    let version = answer(Command::new("rustc").arg("-vV")).context("rustc does not answer")?;
    let line = version.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(line.context("rustc names no host")?.to_owned())
}

/// Builds the program and returns its path.
fn build(profile: &str, target: &str, is_named: bool) -> Result<PathBuf> {
    let mut command = cargo(&["rustc", "--package", "sinew", "--bin", "sinew"]);
    // `flash` is for who has no sources: debug probes are in. probe-rs needs no library of the
    // system: it talks to USB by nusb, and to HID by basic-udev.
    command.args(["--features", "probe", "--profile", profile]);
    if is_named {
        command.args(["--target", target]);
    }
    if target == STATIC {
        // For the last step alone: the dependencies are those of every other build.
        command.args(["--", "-C", "target-feature=+crt-static", "-C"]);
        let script = root().join("xtask/static.ld");
        command.arg(format!("link-arg={}", script.display()));
    }
    process::run(&mut command)?;
    let folder = if profile == "dev" { "debug" } else { profile };
    let name = format!("sinew{}", std::env::consts::EXE_SUFFIX);
    let built = target_folder();
    let built = if is_named { built.join(target) } else { built };
    Ok(built.join(folder).join(name))
}

/// Puts the files of the archive into its folder.
fn fill(folder: &Path, program: &Path) -> Result<()> {
    fs::create_dir_all(folder.join("completions"))?;
    let name = program.file_name().context("a program has a name")?;
    fs::copy(program, folder.join(name))?;
    for file in FILES {
        fs::copy(root().join(file), folder.join(file)).with_context(|| file.to_owned())?;
    }
    fs::create_dir_all(folder.join("rigs"))?;
    for entry in fs::read_dir(root().join("rigs"))? {
        let entry = entry?;
        if entry.file_type()?.is_file() {
            fs::copy(entry.path(), folder.join("rigs").join(entry.file_name()))?;
        }
    }
    for (shell, file) in SHELLS {
        let script = answer(Command::new(program).args(["completions", shell]));
        let script = script.with_context(|| format!("no completions for {shell}"))?;
        fs::write(folder.join("completions").join(file), script + "\n")?;
    }
    let mut pages = Command::new(program);
    process::run(
        pages
            .args(["man-pages", "--out"])
            .arg(folder.join("man/man1")),
    )
}

/// Unpacks the archive into an empty folder and makes a first report. For root and a static program
/// that folder is the root of the file system: nothing else of this computer can be of help.
fn try_out(archive: &Path, name: &str, target: &str) -> Result<()> {
    let place = archive.with_file_name("tried");
    if place.exists() {
        fs::remove_dir_all(&place)?;
    }
    fs::create_dir_all(&place)?;
    let begun = Instant::now();
    let mut tar = Command::new("tar");
    tar.args(["--extract", "--gzip", "--file"]).arg(archive);
    process::run(tar.arg("--directory").arg(&place))?;
    let folder = place.join(name);
    let is_root = answer(Command::new("id").arg("-u")).is_some_and(|id| id == "0");
    let is_static = target == STATIC || target.ends_with("-musl");
    let mut first = if is_static && is_root {
        let mut command = Command::new("/usr/sbin/chroot");
        command.arg(&folder).arg("/sinew");
        command
    } else {
        Command::new(folder.join("sinew"))
    };
    process::run(
        first
            .args(FIRST)
            .arg("--quiet")
            .env_clear()
            .current_dir(&folder),
    )?;
    let seconds = begun.elapsed().as_secs_f64();
    let report = fs::read_to_string(folder.join("report.html"))?;
    ensure!(
        report.contains("coulomb_friction"),
        "the report names no friction"
    );
    println!("from the archive to a first report: {seconds:.1} s");
    ensure!(
        seconds < PATIENCE_S,
        "it took {seconds:.0} s: expected less than {PATIENCE_S:.0} s"
    );
    fs::remove_dir_all(&place)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profile_and_target_are_read_in_any_order_and_nothing_else() {
        let words =
            |line: &str| -> Vec<String> { line.split_whitespace().map(str::to_owned).collect() };
        let line = words("--target aarch64-unknown-linux-musl --profile dev");
        let options = Options::parse(&line).expect("both are options");
        assert_eq!(
            (options.profile, options.target),
            (Some("dev"), Some("aarch64-unknown-linux-musl"))
        );
        for wrong in ["--target", "--triple x", "dev"] {
            assert!(Options::parse(&words(wrong)).is_err(), "{wrong}");
        }
    }
}
