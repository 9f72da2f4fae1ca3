//! Sources of the images that measure a network.

use std::path::{Path, PathBuf};

use super::probe;
use crate::emit::{LAYERED, Options, emit, in_layers};
use crate::{BuildError, Network};

/// The image, or none where the network is too large for the memory of QEMU's board.
pub(super) fn linked(built: Result<PathBuf, BuildError>) -> Result<Option<PathBuf>, BuildError> {
    match built {
        Ok(image) => Ok(Some(image)),
        Err(BuildError::Compile { complaints, .. })
            if complaints.contains("will not fit in region") =>
        {
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// Writes the network, the same in layers, and the workspace around both.
pub(super) fn write(network: &Network, options: &Options, folder: &Path) -> Result<(), BuildError> {
    let options = &Options {
        c_abi: false,
        ..*options
    };
    let crates = [
        ("network", emit(network, options)?),
        (LAYERED, in_layers(network, options)?),
    ];
    for (name, files) in crates {
        for file in files {
            let path = folder.join(name).join(file.path);
            sinew_files::write_changed(&path, file.text.as_bytes())?;
        }
    }
    probe::write_workspace(network, folder)
}
