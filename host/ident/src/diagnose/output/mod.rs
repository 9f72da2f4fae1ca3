//! A diagnosis as people and programs read it. Nothing here decides anything.
//!
//! | file | is read by |
//! |---|---|
//! | `text` | a person at a terminal |
//! | `json` | a program: `sinew-diagnosis/1` (docs/reference/results.md) |
//! | `html`, `plots`, `tables` | a person with a browser |
//! | `mended` | every other verb: the user's rig with what was found in it |

mod html;
mod json;
mod mended;
mod plots;
mod tables;
mod text;

pub use html::{Shown, chapter, report};
pub use json::json;
pub use mended::mended;
pub use text::text;

use super::Estimate;
use super::wording::with_article;
use crate::report::quantity;

/// `19.8 N to 20.4 N`, or why there is no interval.
fn interval(estimate: &Estimate) -> String {
    match estimate.ci95 {
        Some([low, high]) => format!(
            "{} to {}",
            quantity(low, &estimate.unit),
            quantity(high, &estimate.unit)
        ),
        None => "not determined by these recordings".into(),
    }
}

/// `63 %`; no more digits than a probability has.
fn percent(probability: f64) -> String {
    let percent = 100.0 * probability;
    if probability > 0.0 && percent < 0.5 {
        "under 1 %".into()
    } else if probability < 1.0 && percent > 99.5 {
        "over 99 %".into()
    } else {
        format!("{percent:.0} %")
    }
}

/// `coulomb_friction at carriage`.
fn placed(kind: &str, component: &str) -> String {
    format!("{kind} at {component}")
}
