//! A demonstration: one motion, a row a control period.

/// One recorded motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Demonstration {
    /// Outputs, a row a period, SI.
    pub y: Vec<Vec<f64>>,
    /// Commands that made them, where they were recorded: a row a period, SI.
    pub u: Option<Vec<Vec<f64>>>,
}
