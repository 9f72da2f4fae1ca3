//! Faults of recordings, before any work with them.

use sinew_ident::check::Check;
use sinew_ident::error::{Error, Result};

/// Refuses recordings that are certainly wrong, as the command line does.
pub fn refuse(checks: &[Check]) -> Result<()> {
    let Some(check) = checks.iter().find(|check| check.certain) else {
        return Ok(());
    };
    let (file, line, kind) = (&check.file, check.line, check.kind);
    let words = format!("{file}:{line}: {kind}: {}", check.sentence);
    Err(Error::failed(words).help(check.remedy.clone()))
}
