//! Reference vectors that come with a model.

/// One input and what the tool that made the weights computed for it, in double precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Golden {
    /// The flattened regressor, then the hidden state, model units.
    pub x: Vec<f32>,
    /// The next output, model units.
    pub y: Vec<f64>,
}
