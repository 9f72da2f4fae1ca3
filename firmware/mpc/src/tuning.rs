//! Weights of a controller that are known when it is compiled: [`Tuning`].

use crate::budget::Budget;

/// Constants of the controller around a model. The defaults are complete, and cost no instruction:
/// `impl Tuning for MyModel {}`. What may change while the controller runs is in
/// [`Settings`](crate::Settings).
pub trait Tuning {
    /// R: weight of the square of each planned command, in model units. Inputs that can do each
    /// other's work share it where it is above 0 (docs/explanation/controller.md, eq. 4c).
    const COMMAND_WEIGHT: f32 = 0.0;

    /// L: share of a measurement that enters the history, over 0 to 1; the rest is the prediction
    /// (docs/explanation/controller.md, eq. 10c). At 1 a measurement enters as it is.
    const OBSERVER_GAIN: f32 = 1.0;

    /// Most work of the optimisation of a step (docs/explanation/controller.md, section 5). `None`:
    /// the iterations alone end it.
    const BUDGET: Option<Budget> = None;
}
