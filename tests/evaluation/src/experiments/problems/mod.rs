//! The published problems, a file each: rigs, paths, controllers and targets
//! (docs/evaluation/published.md).

mod hasel;
mod mass;
mod paths;
mod steps;
mod tendon;

pub use hasel::HASEL;
pub use mass::MASS;
pub use steps::STEPS;
pub use tendon::{EIGHT, TENDON, TENDON_CALM};

use super::problem::{Knowledge, Variant};

/// The published rate, which any controller is to keep.
const FLOOR_HZ: f64 = 120.0;

/// Trained on the nominal rig with the rig's own tables, and tuned as it is.
const PLAIN: Variant = Variant {
    name: "",
    tables: None,
    knows: Knowledge::Nominal,
    imported: None,
    network_of: None,
    tune: &[],
    small: None,
};

/// Name of a controller that sees no more of the reference than where the output should be
/// now.
pub fn without_preview(name: &str) -> String {
    format!("{name} without preview")
}
