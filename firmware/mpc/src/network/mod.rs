//! Layer kernels that generated predictors call.

pub mod curvature;
pub mod dense;
pub mod recurrent;
pub mod skip;
pub mod state;

pub use dense::*;
