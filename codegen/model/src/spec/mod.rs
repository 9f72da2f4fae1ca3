//! The one description of a model that everything else here reads or writes: which signals go in
//! and out, the network between them, and the control problem it is to serve.
//!
//! Trainers and importers build a [`ModelSpec`], [`crate::store`] keeps it on disk, [`crate::emit`]
//! prints it as Rust, [`crate::evaluate`] computes it in double precision.

mod control;
mod error;
mod golden;
mod layer;
pub mod limits;
mod role;
mod signal;
mod soft_sensor;
mod state;
mod validate;
mod value;

pub use control::ControlSpec;
pub use error::SpecError;
pub use golden::Golden;
pub use layer::{Activation, Dense, Layer, RowsError, gru_cell, lstm_cell, unfilled};
pub use role::Role;
pub use signal::Signal;
pub use soft_sensor::{SoftSensorSpec, WatchSpec};
pub use state::{MAX_PARAMETERS, MAX_STATES, Parameter, State, StateSpec};
pub use value::{MAX_POINTS, MAX_VALUE_ROWS, ValueSpec};

/// Meaning of the last layer's output, in model units (docs/reference/model-files.md, eq. 4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputForm {
    /// `y(k+1) = network(x)`.
    Absolute,
    /// `y(k+1) = y(k) + network(x)`: the network learns the change, which is small at a fast rate.
    Increment,
    /// `x(k+1) = x(k) + network(u, x, theta)` of a model with a state ([`StateSpec`]).
    State,
}

impl OutputForm {
    /// Every form, in the order of the documentation.
    pub const ALL: [Self; 3] = [Self::Absolute, Self::Increment, Self::State];

    /// The form's name in `model.toml`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Absolute => "absolute",
            Self::Increment => "increment",
            Self::State => "state",
        }
    }
}

/// A trained one-step predictor and the control problem it serves (docs/reference/model-files.md,
/// eq. 1 to 4).
///
/// The network sees the regressor `x = u(k)..u(k-past_inputs+1), y(k)..y(k-past_outputs+1), s(k)`,
/// each vector whole, each signal scaled to model units by its [`Signal`].
///
/// ```
/// use sinew_model::spec::*;
///
/// let signal = |name: &str| Signal { name: name.into(), unit: "1".into(), span: 1.0, offset: 0.0 };
/// let spec = ModelSpec {
///     name: "lag".into(),
///     period_s: 0.01,
///     inputs: vec![signal("u_1")],
///     outputs: vec![signal("q_1")],
///     channels: vec![],
///     past_inputs: 1,
///     past_outputs: 1,
///     form: OutputForm::Increment,
///     skip: None,
///     layers: vec![Layer::Dense(
///         Dense::from_rows(&[vec![0.1, -0.1]], vec![0.0], Activation::Linear).unwrap(),
///     )],
///     control: ControlSpec {
///         horizon: 10,
///         control_horizon: 3,
///         move_blocks: vec![],
///         first_step: 1,
///         tracking_weight: vec![1.0],
///         move_suppression: vec![0.1],
///         command_weight: 0.0,
///         budget: None,
///         observer_gain: 1.0,
///         lower: vec![-1.0],
///         upper: vec![1.0],
///         rate_limit: vec![f64::INFINITY],
///         safe: vec![0.0],
///         disturbance_gain: 0.2,
///         iterations: 2,
///         max_missing_samples: 12,
///         value: None,
///     },
///     state: None,
///     soft_sensor: None,
///     golden: vec![],
/// };
/// assert!(spec.validate().is_ok());
///
/// // Two past inputs make a regressor of three; the network takes two.
/// let wrong = ModelSpec { past_inputs: 2, ..spec };
/// assert!(matches!(wrong.validate(), Err(SpecError::RegressorMismatch { .. })));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ModelSpec {
    /// Lower-case letters, digits and `-`; the emitted package is `sinew-model-<name>`.
    pub name: String,
    /// Control period, seconds.
    pub period_s: f64,
    /// Commands u, in the order of the network's inputs.
    pub inputs: Vec<Signal>,
    /// Measured and predicted outputs y.
    pub outputs: Vec<Signal>,
    /// Sensor channels s, which hold their last reading over the horizon, or which a soft sensor
    /// takes.
    pub channels: Vec<Signal>,
    /// Lags of each input in the regressor, the value being decided included.
    pub past_inputs: usize,
    /// Lags of each output in the regressor, the present value included.
    pub past_outputs: usize,
    /// Meaning of the last layer's output.
    pub form: OutputForm,
    /// Weights of a skip connection from the regressor to the output: `outputs` rows, each as long
    /// as the regressor. A nearly linear plant leaves the network only what is not linear.
    pub skip: Option<Vec<f32>>,
    /// The network, first layer first.
    pub layers: Vec<Layer>,
    /// The control problem.
    pub control: ControlSpec,
    /// State, measurement and filter; with [`OutputForm::State`] and nothing else.
    pub state: Option<StateSpec>,
    /// Map from the channels to outputs that are not measured.
    pub soft_sensor: Option<SoftSensorSpec>,
    /// Reference vectors of the tool that made the weights, if it supplied any. They are part of
    /// the tests of the emitted crate, not of the model's identity.
    pub golden: Vec<Golden>,
}

impl ModelSpec {
    /// Length of the flattened regressor.
    #[must_use]
    pub fn regressor_len(&self) -> usize {
        if let Some(state) = &self.state {
            return self.inputs.len() + state.states.len() + state.parameters.len();
        }
        // Saturating, because a specification is asked for its length before it is validated.
        let past = |n: usize, signals: &[Signal]| n.saturating_mul(signals.len());
        past(self.past_inputs, &self.inputs)
            .saturating_add(past(self.past_outputs, &self.outputs))
            .saturating_add(self.seen_channels().len())
    }

    /// Length of a prediction: outputs, or states where there are any.
    #[must_use]
    pub fn predicted_len(&self) -> usize {
        let states = self.state.as_ref().map(|state| state.states.len());
        states.unwrap_or(self.outputs.len())
    }

    /// Length of the hidden state of a recurrent first layer; 0 for a dense one.
    #[must_use]
    pub fn hidden_state_len(&self) -> usize {
        self.layers.first().map_or(0, Layer::hidden_state_len)
    }

    /// Length of the arguments of a prediction: the flattened regressor, then the hidden state.
    #[must_use]
    pub fn point_len(&self) -> usize {
        self.regressor_len().saturating_add(self.hidden_state_len())
    }

    /// Number of weights and biases.
    #[must_use]
    pub fn parameters(&self) -> usize {
        let layers: usize = self.layers.iter().map(Layer::parameters).sum();
        let sensor = self.soft_sensor.as_ref();
        let sensor = sensor.map_or(0, |s| s.bias.len() + s.linear.len() + s.quadratic.len());
        layers + self.skip.as_ref().map_or(0, Vec::len) + sensor
    }
}
