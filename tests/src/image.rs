//! The images of this checkout's boards, with the model that is committed.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use object::read::archive::ArchiveFile;
use object::{Object, ObjectSymbol};
use sinew::device::Device;
use sinew::project::{Board, Built, board_folder, build_to};
use sinew_ident::error::{Error, Result};

/// Top folder of the repository.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}

/// The one place that holds QEMU's options.
pub fn runner() -> PathBuf {
    board_folder(&root(), Board::Qemu).join("run.sh")
}

/// Builds the programs of a board, and copies them out of the reach of other projects. Quick when
/// nothing has changed.
///
/// # Errors
/// What cargo printed, when it does not build.
pub fn build(board: Board) -> Result<Built> {
    let images = cache().join("images").join(board.folder());
    build_to(&root(), board, &cache(), &images)
}

/// Build folder of images: beside the workspace's own outputs, as `cargo xtask test` does. The host
/// program embeds the boards' folders and would be built again after each build in there. Projects
/// of tests share it, and what they have in common with the boards is compiled once.
pub fn cache() -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    root().join(target).join("boards")
}

/// The lockstep program of a board, started.
///
/// # Errors
/// It does not build or start.
pub fn start(board: Board) -> Result<Device> {
    let built = build(board)?;
    match board {
        Board::Qemu => Device::qemu(&runner(), &built.lockstep),
        Board::Host => Device::host(&built.lockstep),
        Board::Stm32f446 | Board::Nrf52840 => Err(Error::failed("it does not run here")),
    }
}

/// Version of the compiler that builds images, as `rustc --version` prints it.
pub fn compiler() -> Option<String> {
    let rustc = std::env::var_os("SINEW_FIRMWARE_RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(rustc).arg("--version").output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_string())
}

/// Why images cannot be run here, if so. A test that depends on QEMU asks first and says so
/// ([`crate::skip`]).
pub fn cannot_run() -> Option<&'static str> {
    let qemu = Command::new("qemu-system-arm").arg("--version").output();
    if qemu.is_err() {
        return Some("no qemu-system-arm (cargo xtask setup)");
    }
    if std::env::var_os("SINEW_FIRMWARE_CARGO").is_some() {
        return None;
    }
    let libraries = Command::new("rustc")
        .args([
            "--print",
            "target-libdir",
            "--target",
            "thumbv7em-none-eabihf",
        ])
        .output();
    let present = libraries.is_ok_and(|output| {
        let folder = String::from_utf8_lossy(&output.stdout).trim().to_string();
        Path::new(&folder).is_dir()
    });
    (!present).then_some("no target thumbv7em-none-eabihf (cargo xtask setup)")
}

/// Ends of a panic, by the names that core gives: `panicking`, `slice_index_fail` and the
/// like.
const PANICS: [&str; 6] = [
    "panic",
    "unwrap_failed",
    "expect_failed",
    "_fail",
    "rust_begin_unwind",
    "handle_alloc_error",
];

/// A function of this name is on the way to a panic.
pub fn is_panic(name: &str) -> bool {
    PANICS.iter().any(|part| name.contains(part))
}

/// Names of the symbols in an archive's objects.
#[derive(Debug, Default)]
pub struct Symbols {
    /// Defined for other programs.
    pub global: BTreeSet<String>,
    /// Defined for the object alone.
    pub local: BTreeSet<String>,
    /// Asked for.
    pub wanted: BTreeSet<String>,
}

/// Names in an archive.
pub fn symbols(archive: &Path) -> Symbols {
    let data = std::fs::read(archive).unwrap_or_else(|error| panic!("{archive:?}: {error}"));
    let file = ArchiveFile::parse(&*data).expect("an archive");
    let mut found = Symbols::default();
    for member in file.members() {
        let member = member
            .expect("a member")
            .data(&*data)
            .expect("the member has bytes");
        // The compiler's own metadata is no object.
        let Ok(object) = object::File::parse(member) else {
            continue;
        };
        for symbol in object.symbols() {
            let name = symbol.name().unwrap_or_default().to_string();
            let names = if symbol.is_undefined() {
                &mut found.wanted
            } else if symbol.is_global() {
                &mut found.global
            } else {
                &mut found.local
            };
            names.insert(name);
        }
    }
    found.wanted.remove("");
    found
}
