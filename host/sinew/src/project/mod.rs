//! A project of the user's own: the firmware's sources, one model and the boards, in one folder
//! that builds with cargo and needs nothing of this checkout.
//!
//! ```text
//! DIR/Cargo.toml       workspace settings that firmware/* inherit
//! DIR/firmware/        the controller
//! DIR/model/           the generated model crate
//! DIR/boards/NAME/     one board, a workspace of its own
//! ```
//!
//! Or the controller as a library for C ([`c_library`]).

mod board;
mod build;
pub mod c_library;
pub mod image;
pub mod policy;
mod sources;
mod toolchain;
pub mod wired;
mod written;

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use sinew_model::emit::{EmitOptions, emit};
use sinew_model::spec::ModelSpec;
use toml_edit::{DocumentMut, Item, Table, value};

pub use build::{Built, build, build_to, checks, compile, run_cargo};
pub use image::Sizes;
pub use sinew_nn::footprint::chip::Chip;
pub use toolchain::{Machine, ready};

use sinew_ident::cli::progress::Stage;
use sinew_ident::error::{Error, Result};
pub use written::Kept;
use written::SourceFile;

/// Everything that the firmware is built from, for telling whether a result still holds.
pub fn hash_sources(hasher: &mut impl std::hash::Hasher) {
    use std::hash::Hash;
    sources::SOURCES.hash(hasher);
}

/// Optimisation goal of a microcontroller's image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Optimise {
    /// As few instructions a step as it knows how to.
    #[default]
    Speed,
    /// A quarter to nearly half less flash, 12 to 36 % more instructions a step (docs/lab/0055):
    /// loops stay loops, but for the network's own.
    Size,
}

impl Optimise {
    /// True for [`Optimise::Speed`].
    pub fn is_speed(&self) -> bool {
        *self == Self::Speed
    }

    /// Remark beside the size of an image; empty for speed.
    pub fn note(self) -> &'static str {
        match self {
            Self::Speed => "",
            Self::Size => ", made for size",
        }
    }
}

/// Board of a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Board {
    /// QEMU's mps2-an386, a Cortex-M4F: instruction counts are exact, time is not.
    Qemu,
    /// This computer, the same code over a pipe.
    Host,
    /// A Nucleo-F446RE.
    Stm32f446,
    /// An nRF52840 DK.
    Nrf52840,
}

/// Writes the project of `spec` to `folder`; files that would not change are left alone, so that a
/// second build has nothing to do. Returns the files that were edited since an earlier run wrote
/// them: they stay as they are.
///
/// # Errors
/// [`Error`] when the specification is not valid, somebody else's file is in the way, or a file
/// cannot be written.
pub fn write(folder: &Path, spec: &ModelSpec, optimise: Optimise) -> Result<Vec<Kept>> {
    write_wired(folder, spec, optimise, &[])
}

/// As [`write()`], with the pins and scales of a rig's own wiring in the place of the board's.
///
/// # Errors
/// As [`write()`].
pub fn write_wired(
    folder: &Path,
    spec: &ModelSpec,
    optimise: Optimise,
    wired: &[sinew_wiring::SourceFile],
) -> Result<Vec<Kept>> {
    let mut files = model(spec, "")?;
    for (path, contents) in firmware() {
        let own = wired.iter().find(|file| file.path == *path);
        let contents = own.map_or(*contents, |file| file.text.as_bytes());
        let contents: Cow<'static, [u8]> = match *path {
            "Cargo.toml" => workspace(contents, FIRMWARE, &["boards", "model"])?
                .into_bytes()
                .into(),
            path if path.starts_with("boards/") && path.ends_with("Cargo.toml") => {
                board_manifest(contents, spec, optimise)?
                    .into_bytes()
                    .into()
            }
            _ => contents.to_vec().into(),
        };
        files.push(SourceFile {
            path: (*path).into(),
            contents,
            // A board's lock names the model that it was made with; cargo mends it in place.
            once: path.ends_with("Cargo.lock"),
        });
    }
    written::update(folder, &files)
}

/// The embedded sources of a project with boards.
fn firmware() -> impl Iterator<Item = &'static (&'static str, &'static [u8])> {
    let c = c_library::FOLDER;
    sources::SOURCES
        .iter()
        .filter(move |(path, _)| !path.starts_with(c))
}

/// Files of the model's crate, in `model/` below `place`.
fn model(spec: &ModelSpec, place: &str) -> Result<Vec<SourceFile>> {
    let options = EmitOptions {
        firmware: "../firmware".into(),
        ..EmitOptions::default()
    };
    let generated = emit(spec, &options).map_err(|e| Error::failed(e.to_string()))?;
    let files = generated.into_iter().map(|file| SourceFile {
        path: format!("{place}model/{}", file.path),
        contents: file.text.into_bytes().into(),
        once: false,
    });
    Ok(files.collect())
}

/// Finds out whether [`write()`] would replace somebody else's file, before the work of minutes
/// that comes first.
///
/// # Errors
/// The first such file.
pub fn is_free(folder: &Path) -> Result<()> {
    let sources = firmware().map(|(path, _)| *path);
    written::is_free(folder, sources.chain(["model/Cargo.toml"]))
}

/// Warnings of edited files that stayed as they are; empty of none.
pub fn kept(files: &[Kept]) -> String {
    let line = |Kept { path, new }: &Kept| {
        let beside = if *new {
            "; its new version ends in .new"
        } else {
            ""
        };
        format!("warning: {}: edited, so it stays{beside}\n", path.display())
    };
    files.iter().map(line).collect()
}

/// Members of the firmware's workspace.
const FIRMWARE: &[&str] = &["firmware/mpc", "firmware/device"];

/// The workspace settings that `firmware/*` inherit, with those `members` that are there. What uses
/// them, in the folders `apart`, are workspaces of their own.
fn workspace(contents: &[u8], members: &[&str], apart: &[&str]) -> Result<String> {
    let mut document = parse("Cargo.toml", contents)?;
    if let Some(workspace) = document["workspace"].as_table_mut() {
        let members = members.iter().copied().collect::<toml_edit::Array>();
        workspace.insert("members", value(members));
        let apart = apart.iter().copied().collect::<toml_edit::Array>();
        workspace.insert("exclude", value(apart));
    }
    document.remove("profile");
    Ok(document.to_string())
}

/// A manifest under `boards/`; its `model` line, where it has one, points at this project's model,
/// and its profile says what the image is made for.
fn board_manifest(contents: &[u8], spec: &ModelSpec, optimise: Optimise) -> Result<String> {
    manifest_around(contents, spec, optimise, "../../model")
}

/// A manifest whose `model` line, where it has one, points at the model's crate at `path`.
fn manifest_around(
    contents: &[u8],
    spec: &ModelSpec,
    optimise: Optimise,
    path: &str,
) -> Result<String> {
    let mut document = parse("Cargo.toml", contents)?;
    if optimise == Optimise::Size && document.get("profile").is_some() {
        small(&mut document, &spec.name);
    }
    let Some(dependencies) = document
        .get_mut("dependencies")
        .and_then(Item::as_table_mut)
    else {
        return Err(Error::failed(
            "the board's Cargo.toml has no [dependencies]",
        ));
    };
    if !dependencies.contains_key("model") {
        return Ok(document.to_string());
    }
    let mut model = Table::new();
    model.insert("package", value(format!("sinew-model-{}", spec.name)));
    model.insert("path", value(path));
    dependencies.insert("model", value(model.into_inline_table()));
    Ok(document.to_string())
}

/// Everything for size but the model of this name, in a manifest that has a profile: the sums over
/// its weights take more than half of a step's instructions.
fn small(document: &mut DocumentMut, model: &str) {
    let release = &mut document["profile"]["release"];
    release["opt-level"] = value("s");
    let mut of_model = Table::new();
    of_model.insert("opt-level", value(2));
    let mut packages = Table::new();
    packages.set_implicit(true);
    packages.insert(&format!("sinew-model-{model}"), Item::Table(of_model));
    release["package"] = Item::Table(packages);
}

fn parse(name: &str, contents: &[u8]) -> Result<DocumentMut> {
    let text = String::from_utf8_lossy(contents);
    text.parse()
        .map_err(|e| Error::failed(format!("the embedded {name}: {e}")))
}

/// Builds one board of the project in `folder`, with progress.
///
/// # Errors
/// As [`build`].
pub fn build_shown(
    folder: &Path,
    board: Board,
    cache: Option<&Path>,
    quiet: bool,
) -> Result<Built> {
    let stage = Stage::begin(format!("build the firmware for {}", board.name()), quiet);
    let built = build(folder, board, cache)?;
    stage.end(match board {
        Board::Host => "the same code for this computer".to_string(),
        _ => {
            let sizes = image::sizes(&built.lockstep)?;
            format!(
                "{} B flash, {} B RAM before its stack",
                sizes.flash_bytes, sizes.ram_bytes
            )
        }
    });
    Ok(built)
}

/// The board's folder in a project.
pub fn board_folder(folder: &Path, board: Board) -> PathBuf {
    folder.join("boards").join(board.folder())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn manifest(optimise: Optimise) -> DocumentMut {
        let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/reference-s");
        let mut spec = sinew_model::store::load(&model).expect("the file ships with the project");
        spec.name = "finger".into();
        let (_, contents) = sources::SOURCES
            .iter()
            .find(|(path, _)| *path == "boards/stm32f446/Cargo.toml")
            .expect("the file is embedded");
        let text = board_manifest(contents, &spec, optimise).expect("the text is TOML");
        text.parse().expect("the reduced manifest is TOML")
    }

    #[test]
    fn an_image_for_size_keeps_the_model_quick() {
        let release = &manifest(Optimise::Size)["profile"]["release"];
        assert_eq!(release["opt-level"].as_str(), Some("s"));
        let model = &release["package"]["sinew-model-finger"]["opt-level"];
        assert_eq!(model.as_integer(), Some(2));
    }

    #[test]
    fn an_image_for_speed_is_as_the_board_has_it() {
        let release = &manifest(Optimise::Speed)["profile"]["release"];
        assert_eq!(release["opt-level"].as_integer(), Some(3));
        assert!(release.get("package").is_none());
    }
}
