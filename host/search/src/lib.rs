#![doc = include_str!("../README.md")]

mod population;

pub use population::{Population, Scored};
