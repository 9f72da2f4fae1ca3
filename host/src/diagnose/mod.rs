//! Diagnosis: where a simulation and a recording differ, and which physics was left out (docs/diagnosis.md).

mod details;
#[cfg(test)]
mod example;
mod finding;
pub mod output;

pub use self::details::{Details, Finalist, ForceTrace, Recovered};
pub use self::finding::{
    Diagnosis, Errors, Estimate, FORMAT, FoundEffect, Interval, Location, Rival, SignalFit, Verdict,
};
