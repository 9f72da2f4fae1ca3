//! Images of `boards/step`, one for each model of the reference problem, in QEMU.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, bail, ensure};

use xtask::process::{self, root, target_folder};
use xtask::setup::Toolchain;

/// One instruction takes 1024 ns of virtual time, a tick of the counter 40 ns: exact counts.
const ICOUNT: &str = "shift=10,sleep=off";

/// Instructions between two readings of the counter.
pub fn instructions(ticks: u32) -> u64 {
    (u64::from(ticks) * 40 + 512) / 1024
}

/// Unit in which a program of `boards/step` counts.
#[derive(Clone, Copy)]
pub enum Content<'a> {
    /// Our control step, our network.
    Ours,
    /// Nothing: what the counting takes.
    Empty,
    /// `peer_step` or `peer_predict` of an archive.
    Peer(&'a Path),
}

/// Controller in a program of `boards/step`.
pub struct Around {
    /// Name of its image.
    name: String,
    /// The model's crate, and what it is called.
    model: (PathBuf, String),
    /// The firmware that the model's crate depends on.
    firmware: PathBuf,
    /// As `--optimise size` makes images, and not as the bench does.
    small: bool,
}

impl Around {
    /// The model in `models/MODEL`, or in `target/bench/models/MODEL` where that is none of ours.
    fn reference(model: &str) -> Self {
        let ours = root().join("models").join(model);
        let path = if ours.exists() {
            ours
        } else {
            target_folder().join("bench/models").join(model)
        };
        Self {
            name: model.into(),
            model: (path, format!("sinew-model-{model}")),
            firmware: root().join("firmware"),
            small: false,
        }
    }

    /// A project that `sinew emit` wrote, for size.
    ///
    /// # Errors
    /// It has no model.
    pub fn project(folder: &Path, name: &str) -> Result<Self> {
        let model = folder.join("model");
        let manifest = model.join("Cargo.toml");
        let text = fs::read_to_string(&manifest)
            .with_context(|| format!("cannot read {}", manifest.display()))?;
        let mut lines = text.lines();
        let package = lines.find_map(|line| line.strip_prefix("name = \"")?.strip_suffix('"'));
        let package = package.with_context(|| format!("{} has no name", manifest.display()))?;
        Ok(Self {
            name: name.into(),
            model: (model, package.into()),
            firmware: folder.join("firmware"),
            small: true,
        })
    }
}

/// Builds program `bin` of `boards/step` around a model of the reference problem and copies it to
/// `target/bench/MODEL.NAME.elf`.
///
/// # Errors
/// As [`build_around`].
pub fn build(
    toolchain: &Toolchain,
    model: &str,
    bin: &str,
    content: Content<'_>,
) -> Result<PathBuf> {
    build_around(toolchain, &Around::reference(model), bin, content)
}

/// Builds program `bin` of `boards/step` around a model and copies it to
/// `target/bench/AROUND.NAME.elf`.
///
/// # Errors
/// It does not build or link.
pub fn build_around(
    toolchain: &Toolchain,
    around: &Around,
    bin: &str,
    content: Content<'_>,
) -> Result<PathBuf> {
    let step = root().join("boards/step");
    let folder = target_folder().join("bench/step").join(&around.name);
    fs::create_dir_all(folder.join(".cargo"))?;
    let read = |file: &str| {
        fs::read_to_string(step.join(file))
            .with_context(|| format!("cannot read boards/step/{file}"))
    };
    let (model, package) = &around.model;
    // The committed crate with another model and absolute paths; its sources stay where they are.
    let model_line = format!("model = {{ package = {package:?}, path = {model:?} }}");
    let mut of_model = false;
    let mut manifest = String::new();
    for line in read("Cargo.toml")?.lines() {
        let line = if line.starts_with("model = ") {
            model_line.clone()
        } else if line.starts_with("sinew-mpc = ") {
            format!("sinew-mpc = {{ path = {:?} }}", around.firmware.join("mpc"))
        } else if around.small && line == "[profile.release.package.\"*\"]" {
            of_model = true;
            format!("[profile.release.package.{package}]")
        } else if of_model && line.starts_with("opt-level = ") {
            of_model = false;
            "opt-level = 2".into()
        } else if line == "[lib]" {
            format!("[lib]\npath = {:?}", step.join("src/lib.rs"))
        } else if let Some(name) = line
            .strip_prefix("name = \"")
            .and_then(|l| l.strip_suffix('"'))
            && ["count", "forward"].contains(&name)
        {
            let source = step.join("src/bin").join(name).with_extension("rs");
            format!("{line}\npath = {source:?}")
        } else {
            line.into()
        };
        manifest.push_str(&line);
        manifest.push('\n');
    }
    write(&folder.join("Cargo.toml"), &manifest)?;
    ensure!(
        !around.small
            || manifest.contains(&format!(
                "[profile.release.package.{package}]\nopt-level = 2\n"
            )),
        "boards/step/Cargo.toml has another profile"
    );
    for file in [
        "build.rs",
        "memory-qemu.x",
        "Cargo.lock",
        ".cargo/config.toml",
    ] {
        write(&folder.join(file), &read(file)?)?;
    }
    let mut arguments = vec!["--quiet", "--bin", bin];
    let (features, name): (&[&str], _) = match content {
        Content::Ours => (&[], bin.to_string()),
        Content::Empty => (&["--no-default-features"], "empty".into()),
        Content::Peer(_) => (
            &["--no-default-features", "--features", "peer"],
            format!("peer-{bin}"),
        ),
    };
    arguments.extend(features);
    let mut command = toolchain.board_cargo(&folder, "build", &arguments);
    if let Content::Peer(archive) = content {
        command.env("SINEW_PEER", archive);
    }
    process::run(&mut command)?;
    let image = target_folder().join(format!("bench/{}.{name}.elf", around.name));
    fs::copy(
        target_folder()
            .join("boards/thumbv7em-none-eabihf/release")
            .join(bin),
        &image,
    )?;
    Ok(image)
}

/// Leaves a file alone that would not change, so that cargo has nothing to do.
fn write(path: &Path, text: &str) -> Result<()> {
    if fs::read_to_string(path).is_ok_and(|old| old == text) {
        return Ok(());
    }
    fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
}

/// Starts an image in QEMU, its two files on the child's standard input and output.
///
/// # Errors
/// QEMU does not start.
pub fn start(image: &Path) -> Result<Child> {
    let folder = image.with_extension("run");
    fs::create_dir_all(&folder)?;
    for (name, to) in [("to_device", "/dev/stdin"), ("to_host", "/dev/fd/3")] {
        let link = folder.join(name);
        if fs::symlink_metadata(&link).is_err() {
            symlink(to, &link)?;
        }
    }
    Command::new(root().join("boards/qemu/run.sh"))
        .arg(image)
        .current_dir(&folder)
        .env("LOG", folder.join("log"))
        .env("ICOUNT", ICOUNT)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .context("QEMU does not start")
}

/// Flash (code, constants, initial values) and statics in bytes, from the ELF file's program
/// headers.
///
/// # Errors
/// It is no 32-bit little-endian ELF file.
pub fn sizes(image: &Path) -> Result<(u64, u64)> {
    let data = fs::read(image)?;
    let word = |at: usize, length: usize| -> Result<u64> {
        let bytes = data.get(at..at + length).context("the image is cut off")?;
        Ok(bytes
            .iter()
            .rev()
            .fold(0, |sum, b| sum << 8 | u64::from(*b)))
    };
    if !data.starts_with(b"\x7fELF\x01\x01") {
        bail!("{} is no image", image.display());
    }
    let (headers, size, count) = (word(28, 4)?, word(42, 2)?, word(44, 2)?);
    let (mut flash, mut ram) = (0, 0);
    for i in 0..count {
        let at = usize::try_from(headers + i * size)?;
        // PT_LOAD; address in memory, bytes in the file, bytes in memory.
        if word(at, 4)? == 1 {
            flash += word(at + 16, 4)?;
            if (0x2000_0000..0x4000_0000).contains(&word(at + 8, 4)?) {
                ram += word(at + 20, 4)?;
            }
        }
    }
    Ok((flash, ram))
}
