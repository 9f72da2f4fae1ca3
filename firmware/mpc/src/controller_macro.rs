//! The macro `controller!`, which hides the const parameters of a controller.

/// Names of a controller's const parameters, and its types.
///
/// Prints the constants `INPUTS`, `OUTPUTS`, `CHANNELS`, `PAST_INPUTS` and `PAST_OUTPUTS`, with
/// which a [`Model`](crate::Model) is implemented, and the types `Regressor`, `Jacobian`,
/// `Scaling`, `Horizons` and `Controller`.
///
/// ```
/// use sinew_mpc::{Limits, Model, Propagate, Settings, Tuning};
///
/// sinew_mpc::controller! {
///     model: Lag,
///     inputs: 1,
///     outputs: 1,
///     channels: 0,
///     past_inputs: 1,
///     past_outputs: 1,
///     horizon: 10,
///     move_blocks: 2,
/// }
///
/// /// y(k+1) = 0.9 y(k) + 0.1 u(k).
/// struct Lag;
///
/// impl Model<INPUTS, OUTPUTS, CHANNELS, PAST_INPUTS, PAST_OUTPUTS> for Lag {
///     type Trace = ();
///     const TRACE: () = ();
///
///     fn predict(&self, x: &Regressor, _: &mut ()) -> [f32; OUTPUTS] {
///         [0.9 * x.y[0][0] + 0.1 * x.u[0][0]]
///     }
///
///     fn jacobian(&self, _: &(), jacobian: &mut Jacobian) {
///         jacobian.y[0][0][0] = 0.9;
///         jacobian.u[0][0][0] = 0.1;
///     }
/// }
///
/// impl Propagate<INPUTS, OUTPUTS, CHANNELS, PAST_INPUTS, PAST_OUTPUTS> for Lag {}
/// impl Tuning for Lag {}
///
/// let mut controller = Controller::new(
///     Lag,
///     Scaling::IDENTITY,
///     Limits { lower: [-1.0], upper: [1.0], rate: [0.5], safe: [0.0] },
///     Settings {
///         tracking_weight: [1.0],
///         move_suppression: [0.01],
///         disturbance_gain: 0.5,
///         iterations: 2,
///         max_missing_samples: 5,
///     },
///     Horizons::new(1, [1, 2]),
/// );
/// let mut y = 0.0;
/// for _ in 0..50 {
///     let step = controller.step(&[y], &[], &[[0.5]; 10]);
///     assert!(step.status.is_controlled());
///     y = 0.9 * y + 0.1 * step.u[0];
/// }
/// assert!((y - 0.5).abs() < 1e-3);
/// ```
#[macro_export]
macro_rules! controller {
    (
        model: $model:ty,
        inputs: $inputs:expr,
        outputs: $outputs:expr,
        channels: $channels:expr,
        past_inputs: $past_inputs:expr,
        past_outputs: $past_outputs:expr,
        horizon: $horizon:expr,
        move_blocks: $move_blocks:expr $(,)?
    ) => {
        /// Commands.
        pub const INPUTS: usize = $inputs;
        /// Outputs.
        pub const OUTPUTS: usize = $outputs;
        /// Sensor channels.
        pub const CHANNELS: usize = $channels;
        /// Values of each command that the model sees, the one being decided included.
        pub const PAST_INPUTS: usize = $past_inputs;
        /// Values of each output that the model sees, the present one included.
        pub const PAST_OUTPUTS: usize = $past_outputs;
        /// Regressor of the model.
        pub type Regressor = $crate::model::Regressor<
            { $inputs },
            { $outputs },
            { $channels },
            { $past_inputs },
            { $past_outputs },
        >;
        /// Derivatives of the model.
        pub type Jacobian =
            $crate::model::Jacobian<{ $inputs }, { $outputs }, { $past_inputs }, { $past_outputs }>;
        /// Scaling between physical and model units.
        pub type Scaling = $crate::scaling::ModelScaling<{ $inputs }, { $outputs }, { $channels }>;
        /// Horizons and the blocks of the plan.
        pub type Horizons = $crate::move_blocking::Horizons<{ $horizon }, { $move_blocks }>;
        /// The controller.
        pub type Controller = $crate::controller::ControlLoop<
            $model,
            { $inputs },
            { $outputs },
            { $channels },
            { $past_inputs },
            { $past_outputs },
            { $horizon },
            { $move_blocks },
            { $inputs * $move_blocks },
        >;
    };
}
