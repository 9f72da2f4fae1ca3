//! The weights that a person prefers: loops of many weights, shown two by two, and the answers.

mod ask;
mod document;
mod features;
mod loops;
mod page;

pub use ask::{Asked, ask};
pub use document::{Document, Given, Settings};
pub use features::{Feature, Features};
pub use loops::{Loop, candidates};
pub use page::pair_page;
