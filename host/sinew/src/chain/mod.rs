//! The chain from a recording to a controlled microcontroller, link by link; the verbs of the program
//! are these links.

pub mod adopt;
pub mod build;
pub mod built;
pub mod contest;
pub mod contestant;
pub mod learn;
pub mod moved;
pub mod page;
pub mod retune;
pub mod side_by_side;
pub mod size;
pub mod summary;
pub mod task;
pub mod tune;
pub mod weights;
