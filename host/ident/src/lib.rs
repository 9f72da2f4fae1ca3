//! System identification of mechanical plants described by a rig file.
//!
//! | module | turns | into |
//! |---|---|---|
//! | [`recording`] | a CSV file | columns |
//! | [`check`] | recordings, with or without a rig | faults by kind, line and remedy |
//! | [`fit`] | a rig and recordings | the rig with its parameters refitted |
//! | [`learn`] | a rig and recordings | laws of springs and dampers that no rig names |
//! | [`fleet`] | a rig and recordings of several devices | the distribution of their parameters |
//! | [`population`] | fitted devices | the distribution of a fleet, as a file |
//! | [`diagnose`] | a rig and recordings | the physics that the rig lacks |
//! | [`excite`] | a rig with limits | inputs for an experiment |
//! | `mjcf` (feature `mechanism`) | a rig | a MuJoCo model |
//! | `mechanism` (its feature) | an MJCF or URDF file | a rig |
//! | [`validation`] | a rig and recordings | chapters of a page: residuals, responses, coverage |
//! | [`report`] | results | a page |

pub mod check;
#[cfg(feature = "cli")]
pub mod cli;
pub mod diagnose;
pub mod error;
pub mod excite;
pub mod fit;
pub mod fleet;
pub mod learn;
#[cfg(feature = "mechanism")]
pub mod mechanism;
#[cfg(feature = "mechanism")]
pub mod mjcf;
pub mod noise;
mod order;
mod parallel;
pub mod population;
pub mod recording;
pub mod report;
mod scales;
pub mod validation;
