//! An image into the flash, and the board's log out again.

use std::path::Path;

use probe_rs::flashing::{
    DownloadOptions, ElfLoader, ElfOptions, FlashProgress, download_file_with_options,
};

use crate::attach::{attach, chain, sorted};
use crate::log::listen;
use crate::{Chip, Options, Trouble};

/// Writes `image`, verifies it and resets the board; then `flashed` is called. With `log` a line of
/// the board's log goes to it at a time, until the program ends.
///
/// # Errors
/// The obstacle, as a [`Trouble`].
pub fn flash(
    chip: &Chip,
    image: &Path,
    options: &Options,
    flashed: impl FnOnce(),
    log: Option<&mut dyn FnMut(&str)>,
) -> Result<(), Trouble> {
    let mut session = attach(chip, options)?;
    let mut download = DownloadOptions::new();
    download.progress = FlashProgress::empty();
    download.verify = true;
    download_file_with_options(
        &mut session,
        image,
        ElfLoader(ElfOptions::default()),
        download,
    )
    .map_err(|e| Trouble::Other(chain(&e)))?;
    let mut core = session.core(0).map_err(|e| sorted(&e))?;
    core.reset().map_err(|e| sorted(&e))?;
    drop(core);
    flashed();
    match log {
        Some(tell) => listen(&mut session, image, tell),
        None => Ok(()),
    }
}
