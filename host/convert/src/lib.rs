#![doc = include_str!("../README.md")]

mod contents;
mod cursor;
#[cfg(feature = "hdf5")]
mod hdf5;
mod json;
mod mat5;
mod mcap;
mod names;
mod ros;
mod table;

use std::fmt;

pub use contents::{Array, Contents, Other};
pub use table::{Base, Join, Table, Wanted, bases, column, table};

/// Largest file that is read, bytes.
pub const MOST_BYTES: u64 = 1 << 30;

/// Most numbers that are taken from one file, whatever it says of itself.
const MOST_VALUES: usize = 1 << 26;

/// Result of a reader.
pub type Result<T> = std::result::Result<T, Error>;

/// Refusal of a file or of a choice of columns: one sentence without a full stop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    /// The fault.
    pub message: String,
    /// The likely fix.
    pub help: Option<String>,
}

impl Error {
    pub(crate) fn new(message: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            help: None,
        }
    }

    pub(crate) fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.message)?;
        match &self.help {
            Some(help) => write!(f, "\n  help: {help}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Error {}

/// Format of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// MATLAB level 5 (`save -v6`, `-v7`).
    Mat5,
    /// HDF5, MATLAB v7.3 among it.
    Hdf5,
    /// MCAP.
    Mcap,
    /// JSON, BAM's logs among it.
    Json,
    /// Parquet, which is known and not read.
    Parquet,
}

impl Format {
    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mat5 => "MATLAB v5",
            Self::Hdf5 => "HDF5",
            Self::Mcap => "MCAP",
            Self::Json => "JSON",
            Self::Parquet => "Parquet",
        }
    }
}

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
