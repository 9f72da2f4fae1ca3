//! A policy as sources: its crates, and the firmware's that hold the limits.
//!
//! ```text
//! DIR/firmware/mpc/    limits and history
//! DIR/network/         the network
//! DIR/policy/          the policy: a step from outputs and reference to commands
//! ```

use std::path::Path;

use sinew_ident::error::{Error, Result};
use sinew_model::policy::{PolicySpec, emit};
use sinew_nn::emit::Options;

use super::written::{self, Kept, SourceFile};
use super::{sources, workspace};

/// Writes the sources of a policy to `folder`. Returns the files that were edited since an earlier
/// run wrote them: they stay as they are.
///
/// # Errors
/// A policy that is not valid, somebody else's file in the way, a file that cannot be written.
pub fn write(folder: &Path, spec: &PolicySpec, options: &Options) -> Result<Vec<Kept>> {
    let printed = emit(spec, options, "../firmware/mpc").map_err(Error::refused)?;
    let mut files: Vec<SourceFile> = (printed.into_iter())
        .map(|file| SourceFile {
            path: file.path,
            contents: file.text.into_bytes().into(),
            once: false,
        })
        .collect();
    for (path, contents) in sources::SOURCES {
        let contents = match *path {
            "Cargo.toml" => {
                workspace(contents, &["firmware/mpc"], &["network", "policy"])?.into_bytes()
            }
            path if path.starts_with("firmware/mpc/") => contents.to_vec(),
            _ => continue,
        };
        files.push(SourceFile {
            path: (*path).into(),
            contents: contents.into(),
            once: false,
        });
    }
    written::update(folder, &files)
}
