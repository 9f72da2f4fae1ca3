//! Moves of the search.

pub(crate) mod pair;
pub(crate) mod restart;
pub(crate) mod short_horizon;
pub(crate) mod swap;
