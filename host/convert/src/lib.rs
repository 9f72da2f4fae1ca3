#![doc = include_str!("../README.md")]

mod contents;
mod cursor;
mod error;
mod formats;
#[cfg(feature = "hdf5")]
mod hdf5;
mod json;
mod mat5;
mod mcap;
mod names;
mod ros;
mod table;

pub use contents::{Array, Contents, Format, Other};
pub use error::{Error, Result};
pub use formats::{MOST_BYTES, format, read};
pub use table::{Base, Join, Table, Wanted, bases, columns, table};
