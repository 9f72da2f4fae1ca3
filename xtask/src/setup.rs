//! `cargo xtask setup`: what a bare machine lacks. Silent and quick when nothing is missing. Other
//! verbs say what they would install, and on a terminal they ask; nothing is ever removed. Where
//! apt would have to, or nobody may install, QEMU is unpacked in the build folder.
//!
//! The target comes from rustup. Where rustup is absent or cannot add it, Debian's Rust builds
//! `core` from its own sources (packages rustc-web, cargo-web, rust-web-src) and links with
//! Debian's lld.

use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Result, bail};

use crate::apt::{apt, install};
use crate::process::{self, answer, cargo, succeeds, target_folder};
use crate::unpacked;

const TARGET: &str = "thumbv7em-none-eabihf";
const QEMU: &str = "qemu-system-arm";
const DEBIAN_PACKAGES: &[&str] = &["rustc-web", "cargo-web", "rust-web-src", "lld"];
/// Browsers that the tests of pages try (host/sinew/tests/cli/browser.rs); the first is installed.
const BROWSERS: &[&str] = &[
    "chromium-headless-shell",
    "chromium",
    "chromium-browser",
    "google-chrome",
];
const DEBIAN_CARGO: &str = "/usr/bin/cargo";
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
const DEBIAN_LLD: &str = "/usr/bin/ld.lld";

/// Extent of the search.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// Tools that build and run images: the target and QEMU.
    Build,
    /// rustfmt and clippy as well.
    Everything,
}

/// Tools that build firmware: environment for children, read by the host program, the tests and
/// [`Toolchain::board_cargo`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Toolchain {
    variables: Vec<(&'static str, String)>,
}

impl Toolchain {
    /// Debian's compiler, which has no `core` for the target and builds it.
    fn debian() -> Self {
        let variables = vec![
            ("SINEW_FIRMWARE_CARGO", DEBIAN_CARGO.to_string()),
            ("SINEW_FIRMWARE_RUSTC", DEBIAN_RUSTC.to_string()),
            ("SINEW_FIRMWARE_BUILD_STD", "1".to_string()),
            // rust-lld is the target's default linker and Debian has none.
            (
                "CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER",
                DEBIAN_LLD.to_string(),
            ),
        ];
        Self { variables }
    }

    /// Lets `command` and everything it starts build firmware in the same way.
    pub fn equip<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        command.envs(self.variables.iter().map(|(name, value)| (name, value)))
    }

    fn variable(&self, name: &str) -> Option<String> {
        let own = self.variables.iter().find(|(known, _)| *known == name);
        own.map(|(_, value)| value.clone())
            .or_else(|| std::env::var(name).ok())
    }

    /// `cargo VERB --release ARGUMENTS` for a board, to be run in `boards/NAME`, where its
    /// configuration stands. A board that names no target there is built for this machine, by the
    /// plain cargo.
    pub fn board_cargo(&self, board: &Path, verb: &str, arguments: &[&str]) -> Command {
        let for_a_chip = board.join(".cargo/config.toml").is_file();
        let mut command = match self.variable("SINEW_FIRMWARE_CARGO") {
            Some(program) if for_a_chip => Command::new(program),
            _ => cargo(&[]),
        };
        command
            .current_dir(board)
            .args([verb, "--release", "--target-dir"]);
        // Not in the board's folder: the host program embeds that, and would be built again after
        // each build there. The tests look in the same place (tests/src/image.rs).
        command.arg(target_folder().join("boards"));
        if for_a_chip {
            if let Some(rustc) = self.variable("SINEW_FIRMWARE_RUSTC") {
                command.env("RUSTC", rustc);
            }
            if self.variable("SINEW_FIRMWARE_BUILD_STD").as_deref() == Some("1") {
                command.env("RUSTC_BOOTSTRAP", "1").arg("-Zbuild-std=core");
            }
            self.equip(&mut command);
        }
        command.args(arguments);
        command
    }
}

/// Permission to install what is missing.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Consent {
    /// It was given: `setup` itself, and `--yes`.
    Given,
    /// Somebody at a terminal is asked. Without a terminal nobody can be: it is said and done.
    Asked,
}

/// Installs what is missing once somebody agrees, and says so while it does.
///
/// # Errors
/// Something is missing that it may not or cannot install; the message is the line to type.
pub fn run(extent: Extent) -> Result<Toolchain> {
    run_with(extent, Consent::Asked)
}

/// As [`run`], with permission or without.
///
/// # Errors
/// As [`run`].
pub fn run_with(extent: Extent, consent: Consent) -> Result<Toolchain> {
    let toolchain = target(consent)?;
    if extent == Extent::Everything {
        component("rustfmt", "fmt", consent)?;
        component("clippy", "clippy", consent)?;
    }
    qemu(consent)?;
    if extent == Extent::Everything {
        browser(consent);
    }
    Ok(toolchain)
}

/// Says what would be installed, and asks.
///
/// # Errors
/// The answer is no.
fn agree(consent: Consent, what: &str) -> Result<()> {
    let input = std::io::stdin();
    let terminal = input.is_terminal() && std::io::stdout().is_terminal();
    if agreed(consent, what, terminal, &mut input.lock())? {
        return Ok(());
    }
    bail!("nothing was installed; `cargo xtask setup` or --yes installs it unasked")
}

fn agreed(consent: Consent, what: &str, terminal: bool, input: &mut impl BufRead) -> Result<bool> {
    println!("setup: {what}");
    if consent == Consent::Given || !terminal {
        return Ok(true);
    }
    print!("setup: install it? [y/N] ");
    std::io::stdout().flush()?;
    let mut line = String::new();
    input.read_line(&mut line)?;
    Ok(["y", "yes"].contains(&line.trim().to_lowercase().as_str()))
}

/// The compiler that cargo uses here has a `core` for the target.
fn target_present() -> bool {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let folder = answer(Command::new(rustc).args(["--print", "target-libdir", "--target", TARGET]));
    let entries = folder.and_then(|folder| PathBuf::from(folder).read_dir().ok());
    entries.is_some_and(|mut entries| {
        entries.any(|entry| {
            entry.is_ok_and(|e| e.file_name().to_string_lossy().starts_with("libcore"))
        })
    })
}

fn debian_present() -> bool {
    let sources =
        answer(Command::new(DEBIAN_RUSTC).args(["--print", "sysroot"])).is_some_and(|root| {
            Path::new(&root)
                .join("lib/rustlib/src/rust/library/core")
                .is_dir()
        });
    sources
        && [DEBIAN_CARGO, DEBIAN_LLD]
            .iter()
            .all(|file| Path::new(file).exists())
}

/// The road to the target: the environment's, rustup's, or Debian's.
fn target(consent: Consent) -> Result<Toolchain> {
    if std::env::var_os("SINEW_FIRMWARE_CARGO").is_some() {
        return Ok(Toolchain::default());
    }
    if target_present() {
        return Ok(Toolchain::default());
    }
    if succeeds(Command::new("rustup").arg("--version")) {
        agree(
            consent,
            &format!("the target {TARGET} is missing: rustup target add {TARGET}"),
        )?;
        let added = process::run(Command::new("rustup").args(["target", "add", TARGET]));
        if added.is_ok() && target_present() {
            return Ok(Toolchain::default());
        }
        println!("setup: rustup could not add it; Debian's Rust can build for it");
    }
    if !debian_present() {
        agree(
            consent,
            &format!(
                "Debian's Rust, its sources and lld are missing: apt-get {}",
                install(DEBIAN_PACKAGES).join(" ")
            ),
        )?;
        apt(DEBIAN_PACKAGES)?;
    }
    if !debian_present() {
        bail!(
            "no compiler for {TARGET}: neither rustup nor Debian's packages ({}) gave one",
            DEBIAN_PACKAGES.join(", ")
        );
    }
    Ok(Toolchain::debian())
}

/// A component of the toolchain that only `ci` needs: what cannot be had there is said and skipped
/// here.
fn component(name: &str, verb: &str, consent: Consent) -> Result<()> {
    if component_present(verb) {
        return Ok(());
    }
    let what = format!("{name} is missing: rustup component add {name}");
    agree(consent, &what)?;
    if process::run(Command::new("rustup").args(["component", "add", name])).is_err() {
        println!("setup: there is no {name} on this machine, and ci cannot run without it");
    }
    Ok(())
}

fn component_present(verb: &str) -> bool {
    succeeds(&mut cargo(&[verb, "--version"]))
}

fn qemu(consent: Consent) -> Result<()> {
    let present = || succeeds(Command::new(QEMU).arg("--version"));
    if present() {
        return Ok(());
    }
    if unpacked::present(QEMU) {
        return unpacked::start_again();
    }
    let line = install(&[QEMU]).join(" ");
    agree(consent, &format!("{QEMU} is missing: apt-get {line}"))?;
    let Err(error) = apt(&[QEMU]) else {
        if !present() {
            bail!("apt installed {QEMU}, but it does not run");
        }
        return Ok(());
    };
    println!("setup: {error:#}");
    if let Err(second) = unpacked::unpack(QEMU) {
        println!("setup: {second:#}");
        return Err(error);
    }
    unpacked::start_again()
}

/// The browser in which pages are looked at: where it cannot be had, those looks are skipped.
fn browser(consent: Consent) {
    let there = |name: &&str| succeeds(Command::new(name).arg("--version"));
    if std::env::var_os("SINEW_BROWSER").is_some() || BROWSERS.iter().any(there) {
        return;
    }
    let packages = [BROWSERS[0]];
    let line = install(&packages).join(" ");
    let asked = agree(
        consent,
        &format!("no browser to look at pages in: apt-get {line}"),
    );
    if asked.and_then(|()| apt(&packages)).is_err() {
        println!("setup: no browser on this machine, so pages are not looked at");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_installed_on_a_terminal_before_somebody_says_yes() {
        let on = |consent, terminal, answer: &str| {
            agreed(consent, "qemu", terminal, &mut answer.as_bytes()).expect("an answer")
        };
        for (answer, wanted) in [
            ("y\n", true),
            (" YES \n", true),
            ("\n", false),
            ("n\n", false),
            ("", false),
        ] {
            assert_eq!(on(Consent::Asked, true, answer), wanted, "{answer:?}");
        }
        // `--yes`, and a machine without anybody at it.
        assert!(on(Consent::Given, true, "n\n") && on(Consent::Asked, false, ""));
    }

    #[test]
    fn apt_removes_nothing() {
        let line = install(&["a", "b"]);
        assert!(line.contains(&"--no-remove"));
        assert_eq!(line[line.len() - 2..], ["a", "b"]);
    }
}
