//! Trained weights in model units, as the firmware has them, and their evaluation.

/// Offset and range of a signal: `scaled = (physical - offset) / span`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Physical units per model unit, above 0.
    pub span: f64,
    /// Physical value of model zero.
    pub offset: f64,
}

impl Scale {
    /// Middle and half range of `values`; a span of 1 where they do not differ.
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        if high > low {
            Self {
                span: (high - low) / 2.0,
                offset: f64::midpoint(high, low),
            }
        } else {
            Self {
                span: 1.0,
                offset: if low.is_finite() { low } else { 0.0 },
            }
        }
    }

    /// In model units.
    pub fn scaled(&self, physical: f64) -> f64 {
        (physical - self.offset) / self.span
    }
}

/// Weights of docs/explanation/controller.md, eq. 20: x(k+1) = x + A z + b + G tanh(W z + w),
/// m = C x + c, with z = (x, u, theta). Matrices row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct StateModel {
    /// Scales of the states, inputs and measurements; parameters are in standard deviations.
    pub states: Vec<Scale>,
    /// Scales of the inputs.
    pub inputs: Vec<Scale>,
    /// Scales of the measurements.
    pub measurements: Vec<Scale>,
    /// A, `[n][n + n_u + p]`.
    pub linear: Vec<Vec<f32>>,
    /// b, `[n]`.
    pub bias: Vec<f32>,
    /// W, `[units][n + n_u + p]`.
    pub hidden: Vec<Vec<f32>>,
    /// w, `[units]`.
    pub hidden_bias: Vec<f32>,
    /// G, `[n][units]`.
    pub output: Vec<Vec<f32>>,
    /// C, `[n_m][n]`.
    pub measurement: Vec<Vec<f32>>,
    /// c, `[n_m]`.
    pub measurement_bias: Vec<f32>,
    /// Root mean square of `m - C x - c` over the training data, model units: what a linear
    /// measurement leaves, `[n_m]`.
    pub measurement_error: Vec<f64>,
    /// Root mean square error of the state after one period on data that trained nothing and chose
    /// nothing, model units, `[n]`.
    pub one_step_error: Vec<f64>,
}

fn dot(row: &[f32], z: &[f64]) -> f64 {
    row.iter().zip(z).map(|(a, z)| f64::from(*a) * z).sum()
}

impl StateModel {
    /// The next state in double precision; `z` = (x, u, theta), model units.
    ///
    /// # Panics
    /// A `z` shorter than the state.
    pub fn next(&self, z: &[f64]) -> Vec<f64> {
        let units: Vec<f64> = self
            .hidden
            .iter()
            .zip(&self.hidden_bias)
            .map(|(row, b)| (dot(row, z) + f64::from(*b)).tanh())
            .collect();
        let rows = self.linear.iter().zip(&self.bias).zip(&self.output);
        rows.enumerate()
            .map(|(i, ((a, b), g))| z[i] + dot(a, z) + f64::from(*b) + dot(g, &units))
            .collect()
    }
}
