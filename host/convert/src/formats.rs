//! The formats, and the reader of each.

use crate::contents::{Contents, Format};
use crate::error::{Error, Result};
#[cfg(feature = "hdf5")]
use crate::hdf5;
use crate::{json, mat5, mcap};

/// Largest file that is read, bytes.
pub const MOST_BYTES: u64 = 1 << 30;

/// Format of a file by its first bytes; of what could be text by its extension. `None`: none of
/// these formats.
pub fn format(bytes: &[u8], extension: &str) -> Option<Format> {
    if bytes.starts_with(&mcap::MAGIC) {
        return Some(Format::Mcap);
    }
    // HDF5 may have a block of its owner's before it; MATLAB's has 512 bytes.
    if [0, 512, 1024, 2048].iter().any(|at| {
        bytes
            .get(*at..)
            .is_some_and(|rest| rest.starts_with(b"\x89HDF\r\n\x1a\n"))
    }) {
        return Some(Format::Hdf5);
    }
    if mat5::is_header(bytes) {
        return Some(Format::Mat5);
    }
    if bytes.starts_with(b"PAR1") {
        return Some(Format::Parquet);
    }
    match extension.to_ascii_lowercase().as_str() {
        "mat" => Some(Format::Mat5),
        "h5" | "hdf5" => Some(Format::Hdf5),
        "mcap" => Some(Format::Mcap),
        "json" => Some(Format::Json),
        "parquet" => Some(Format::Parquet),
        _ => None,
    }
}

/// Everything that a file holds.
///
/// # Errors
/// A file that is broken, cut off or too large, or a format that is not read.
pub fn read(bytes: &[u8], format: Format) -> Result<Contents> {
    let mut contents = match format {
        Format::Mat5 => mat5::read(bytes)?,
        #[cfg(feature = "hdf5")]
        Format::Hdf5 => hdf5::read(bytes)?,
        #[cfg(not(feature = "hdf5"))]
        Format::Hdf5 => {
            return Err(Error::new("this program was built without HDF5")
                .help("`sinew` reads it; in MATLAB `save -v7` writes a file without it"));
        }
        Format::Mcap => mcap::read(bytes)?,
        Format::Json => json::read(bytes)?,
        Format::Parquet => {
            return Err(Error::new("Parquet is not read").help(
                "write it as CSV, for example with pandas: \
                 read_parquet(IN).to_csv(OUT, index=False)",
            ));
        }
    };
    contents.format = Some(format);
    Ok(contents)
}
