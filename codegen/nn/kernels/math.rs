//! The only home of transcendental functions. They use `+ - * /`, comparisons and shifts of an
//! exponent, each rounded once, so that every machine gives the same bits.

mod activation;
pub mod coarse;
mod exponential;
pub mod precise;
mod root;
pub mod rough;
pub mod rougher;

pub use activation::*;
pub use exponential::{erf, exp, ln, ln_1p};
pub use root::{reciprocal_root, root};
