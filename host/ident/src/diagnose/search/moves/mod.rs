//! Moves of the search, one a file. A move proposes candidates that the pool takes.

mod drop_one;
mod from_nominal;
mod pair;
mod refine;
mod restart;
mod short_horizon;
mod single;
mod swap;

use super::context::Move;

/// Moves in the order in which the search makes them.
pub(crate) const MOVES: &[&dyn Move] = &[
    &single::Single,
    &refine::Refine,
    &from_nominal::FromNominal,
    &short_horizon::ShortIntervals,
    &pair::Pair,
    &drop_one::DropOne,
    &swap::Swap,
    &restart::Restart,
];
