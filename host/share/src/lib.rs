#![doc = include_str!("../README.md")]

pub mod budget;
mod discrete;
pub mod json;
mod recordings;
pub mod region;
mod source;
pub mod statistics;
mod synthesis;

pub use budget::Budget;
pub use discrete::Noise;
pub use recordings::{Inputs, name as recording_name, recordings};
pub use region::Region;
pub use source::{Places, places, random};
pub use statistics::Release;
pub use synthesis::{Shared, enough, synthesise};
