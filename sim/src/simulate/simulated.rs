//! Instances of the simulator: compiled here, once a type, and not again in every crate that calls
//! it.
//!
//! The simulator is generic, and a generic function is compiled where it is called: for three types
//! in the host, for three again in its tests, whenever a line of theirs changed
//! (docs/decisions/0040-simulator-compiled-once.md).

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::dual::Dual;
use crate::error::SimulationError;
use crate::input_trajectory::InputTrajectory;
use crate::integrator::Stepper;
use crate::integrator::exact::TransitionCache;
use crate::plant::Plant;
use crate::scalar::Scalar;
use crate::statics::Rest;

/// Methods of [`Simulated`]. In the trait these are generic bodies; in an `impl` that names its
/// type nothing generic is left, and that makes them this crate's.
macro_rules! bodies {
    () => {
        /// [`Stepper::new`].
        fn begin(
            plant: &Plant,
            values: &[Self],
            start: &[Self],
        ) -> Result<Stepper<Self>, SimulationError> {
            Stepper::begin(plant, values, start)
        }

        /// [`Stepper::set_state`].
        fn place(stepper: &mut Stepper<Self>, state: &[Self]) -> Result<(), SimulationError> {
            stepper.place(state)
        }

        /// [`Stepper::advance_between`].
        fn pass(
            stepper: &mut Stepper<Self>,
            dt: f64,
            inputs: [&[Self]; 2],
        ) -> Result<(), SimulationError> {
            stepper.pass(dt, inputs)
        }

        /// [`Stepper::signal`].
        fn signal(stepper: &Stepper<Self>, sensor: usize) -> Self {
            stepper.sensor_signal(sensor)
        }

        /// [`Stepper::read`].
        fn signals(stepper: &Stepper<Self>, out: &mut Vec<Self>) {
            stepper.append_signals(out);
        }

        /// [`Plant::initial_state`].
        fn start(
            plant: &Plant,
            values: &[Self],
            first: &[Option<f64>],
        ) -> Result<Vec<Self>, SimulationError> {
            plant.start(values, first)
        }

        /// [`Plant::rest`].
        fn rest(
            plant: &Plant,
            values: &[Self],
            inputs: &[Self],
            start: &[f64],
        ) -> Result<Rest<Self>, SimulationError> {
            plant.find_rest(values, inputs, start)
        }

        /// [`Plant::simulate_until`], and
        /// [`ParameterizedPlant::simulate_until`](crate::ParameterizedPlant::simulate_until) with
        /// what is kept.
        fn run(
            plant: &Plant,
            values_and_start: [&[Self]; 2],
            kept: Option<&Arc<TransitionCache<Self>>>,
            drive: &InputTrajectory,
            times: &[f64],
            visit: &mut dyn FnMut(usize, &Stepper<Self>) -> ControlFlow<()>,
        ) -> Result<Stepper<Self>, SimulationError> {
            plant.run(values_and_start, kept, drive, times, visit)
        }
    };
}

/// A [`Scalar`] that a plant can be simulated in: `f64`, and [`Dual`] of 1 to 24 seeds.
///
/// Every method has a body; a scalar of one's own needs `impl Simulated for Mine {}`, and the
/// simulator is then compiled for it where it is used.
#[doc(hidden)]
pub trait Simulated: Scalar {
    bodies!();
}

macro_rules! compiled_here {
    ($($scalar:ty),*) => {$( impl Simulated for $scalar { bodies!(); } )*};
}

macro_rules! compiled_where_used {
    ($($seeds:literal)*) => {$( impl Simulated for Dual<$seeds> {} )*};
}

// What fits and diagnosis are made of.
compiled_here!(f64, Dual<4>, Dual<8>);
compiled_where_used!(1 2 3 5 6 7 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24);
