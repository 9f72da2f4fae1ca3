//! Roles of recordings: one that estimates or chooses cannot judge as well.

use std::path::PathBuf;

use super::overwrite::identity;
use crate::error::{Error, Result};

/// Refuses a recording with two roles; each list comes with its flag.
///
/// # Errors
/// `Arguments`, with both flags.
pub(super) fn refuse_two(roles: [(&'static str, &Vec<PathBuf>); 3]) -> Result<()> {
    let mut seen: Vec<(PathBuf, &str)> = Vec::new();
    for (flag, paths) in roles {
        for path in paths {
            let file = identity(path);
            if let Some((_, before)) = seen.iter().find(|(other, _)| *other == file) {
                let what = if *before == flag {
                    format!("{} is given to {flag} twice", path.display())
                } else {
                    format!("{} is given to {before} and to {flag}", path.display())
                };
                return Err(Error::arguments(what).help(
                    "each recording has one role: fit estimates, check decides, test is only scored; cut a long \
                     recording in two if there is only one",
                ));
            }
            seen.push((file, flag));
        }
    }
    Ok(())
}
