//! Texts of `sinew import`, `sinew size`, and `sinew emit` of a network.

use std::path::{Path, PathBuf};

use super::emit::{self, LIBRARY, Options, Weights};
use super::footprint::{self, BOARDS, Board};
use super::{Network, quantise, store, summary, target};
use crate::BuildError;
use crate::files::{self, FileError};

/// Writes a network as a folder, if `out` is given; the answer is its table.
///
/// # Errors
/// [`BuildError`].
pub fn import(network: &Network, out: Option<&Path>) -> Result<String, BuildError> {
    if let Some(out) = out {
        store::save(out, network).map_err(|error| error.within(&out.display().to_string()))?;
    }
    let written = out.map_or(String::new(), |out| format!("\nwrote {}\n", out.display()));
    Ok(format!(
        "{}\n\n{}{written}",
        network.name,
        summary::table(network)
    ))
}

/// Prints the crate of a network into `out`, and with the C interface builds its library; the
/// answer names what was written.
///
/// # Errors
/// [`BuildError`].
pub fn emit(network: &Network, out: &Path, options: &Options) -> Result<String, BuildError> {
    for file in emit::emit(network, options)? {
        files::write_changed(&out.join(file.path), file.text.as_bytes())?;
    }
    let mut text = format!("wrote {}\n{}", out.display(), loss(network, options));
    if options.c_abi {
        let folder = absolute(&out.join("c"))?;
        target::build(&folder, &format!("{}-c", network.name))?;
        let library = format!("target/{}/release/lib{LIBRARY}.a", target::TARGET);
        text += &format!("library {}\n", folder.join(library).display());
        text += &format!("header {}\n", folder.join(format!("{LIBRARY}.h")).display());
    }
    Ok(text)
}

/// The footprint of a network on a board; `folder` keeps the compiled parts for the next time.
///
/// # Errors
/// [`BuildError`].
pub fn size(
    network: &Network,
    board: &str,
    options: &Options,
    folder: &Path,
) -> Result<String, BuildError> {
    let board = self::board(board)?;
    let folder = absolute(folder)?;
    let size = footprint::measure(network, options, &folder)?;
    Ok(footprint::table(network, &size, board) + &loss(network, options))
}

/// The line that says what integers cost; nothing where weights stay as they are.
fn loss(network: &Network, options: &Options) -> String {
    match options.weights {
        Weights::Float32 => String::new(),
        Weights::Int8 => format!("{}\n", quantise::loss(network)),
    }
}

fn absolute(path: &Path) -> Result<PathBuf, FileError> {
    std::path::absolute(path).map_err(|error| FileError::io(path, error))
}

/// The board of a name.
///
/// # Errors
/// [`BuildError::Board`]; the message has the names.
pub fn board(name: &str) -> Result<&'static Board, BuildError> {
    Board::named(name).ok_or_else(|| BuildError::Board {
        name: name.into(),
        expected: BOARDS.map(|board| board.name).join(", "),
    })
}
