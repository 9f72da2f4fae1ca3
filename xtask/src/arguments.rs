//! Arguments of verbs.

use anyhow::{Result, bail};

/// For verbs that take none.
///
/// # Errors
/// There is an argument.
pub fn none(arguments: &[String]) -> Result<()> {
    match arguments.first() {
        None => Ok(()),
        Some(argument) => bail!("unexpected argument '{argument}'"),
    }
}
