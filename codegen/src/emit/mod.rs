//! Prints a model as a Rust crate.
