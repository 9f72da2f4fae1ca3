//! A verb's result for programs.

use std::path::Path;

use serde_json::Value;
use sinew_ident::error::Result;

/// Writes a document where `--json` asks for one.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn write(json: Option<&Path>, document: impl FnOnce() -> Value) -> Result<()> {
    let Some(path) = json else {
        return Ok(());
    };
    Ok(sinew_files::write(path, format!("{:#}\n", document()))?)
}
