//! A second start of a fit that ended far from the recordings.
//!
//! Over stretches of a few swings, values that are wrong by orders of magnitude are all missed
//! alike: a gain of 1 where 2,500 is right leads nowhere, or to a gain of the wrong sign. Within a
//! part of a swing the way to the right ones is nearly straight.

use sinew_sim::{Plant, Rig};

use super::horizons::{Continuation, FINE, USUAL};
use super::score::{SensorError, relative, score};
use super::stages::{Apart, Found};
use super::{FitOptions, POOR, undetermined};
use crate::error::Result;
use crate::recording::Recording;

/// Part of the first end's error that the second one must not exceed.
const BETTER: f64 = 0.9;

/// Runs the stages, and once more from shorter stretches where the result explains some signal
/// poorly. Gives the better end, by free-run error, and the continuation that led to it.
///
/// # Errors
/// Those of the first run; those of the second mean that nothing is gained.
pub(super) fn better(
    (rig, plant, recordings): (&Rig, &Plant, &[Recording]),
    options: &FitOptions,
    run: &mut dyn FnMut(&Continuation, Apart) -> Result<Found>,
) -> Result<(&'static Continuation, Found)> {
    let first = run(&USUAL, Apart::default())?;
    let errors = |found: &Found| score(&undetermined::fitted(rig, plant, found)?, recordings);
    let poor = |sensor: &SensorError| sensor.rms.is_nan() || sensor.rms > POOR * sensor.spread;
    // Of a plant that runs away the free run says nothing.
    if options.near || options.search_only || first.runaway.is_some() {
        return Ok((&USUAL, first));
    }
    let ended = errors(&first)?;
    if !ended.iter().any(poor) {
        return Ok((&USUAL, first));
    }
    let Ok(second) = run(&FINE, Apart::default()) else {
        return Ok((&USUAL, first));
    };
    if relative(&errors(&second)?) < BETTER * relative(&ended) {
        Ok((&FINE, second))
    } else {
        Ok((&USUAL, first))
    }
}
