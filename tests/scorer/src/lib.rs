//! Answers of `sinew diagnose` against what was concealed: `cargo xtask proof` and the committed
//! cases are scored by the same rules. Knows nothing of the program under test but the JSON of its
//! answers.

pub mod answer;
pub mod calibration;
pub mod score;
pub mod table;
#[cfg(test)]
mod tests;
pub mod truth;

pub use answer::Answer;
pub use score::{Outcome, outcome};
pub use table::Scored;
pub use truth::Truth;
