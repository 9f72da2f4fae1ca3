//! Validation of a rig against recordings: chapters of a page that every verb with free runs shares
//! (docs/explanation/identification.md, "Validation").
//!
//! | file | has |
//! |---|---|
//! | `correlation` | whiteness of residuals and their correlation with the inputs |
//! | `response` | frequency responses, measured and modelled |
//! | `coverage` | where the recordings have been |
//! | `motions` | measured over simulated, and their difference |
//! | `chapters` | tables and plots of all of them |
//! | `free` | recordings, and the models that are held against them |
//! | `fit_page` | the page of a fit |

mod chapters;
mod correlation;
mod coverage;
mod fit_page;
mod free;
mod motions;
mod response;

pub use chapters::{chapters, fit_table};
pub use correlation::{CROSS_BAND, Correlation, autocorrelation, cross_correlation};
pub use fit_page::{FitPage, fit_page};
pub use free::{Free, Model};
pub use motions::motions;
pub use response::{Block, Response, response};
