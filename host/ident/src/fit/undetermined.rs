//! Parameters that the recordings do not determine stay as written, to the digit.
//!
//! A fit moves along directions in which the data are silent, by noise alone. Such parameters are
//! held as written and the others are fitted again; the result counts where it leaves no more than
//! noise alone would let them gain. Recordings of a device at rest determine no parameter: noise
//! has a resonance at some frequency, and a fit finds it.

use sinew_sim::{Plant, Rig};

use super::stages::Found;
use super::uncertainty::Width;
use crate::error::Result;
use crate::noise::{most_of_noise, noise_alone, noise_level};
use crate::recording::Recording;

/// Error that holding parameters may add, as a part of the error.
const NO_MORE: f64 = 0.01;

/// The fit in which every undetermined parameter that can be is held as written, and its rig. `run`
/// fits with some slots held.
///
/// # Errors
/// As those of `error`, the error of a rig over the spread of the signals; those of `run` end the
/// search and not the fit.
pub(super) fn keep(
    (rig, plant): (&Rig, &Plant),
    error: &dyn Fn(&Rig) -> Result<f64>,
    (mut first, at_rest): (Found, Option<f64>),
    run: &mut dyn FnMut(&[usize]) -> Result<Found>,
) -> Result<(Found, Rig)> {
    if at_rest.is_some() {
        first.widths.fill(Width::Open);
    }
    let of_all = first.widths.clone();
    let (mut found, fitted) = hold((rig, plant), error, (first, at_rest), run)?;
    widen(&mut found, &of_all);
    Ok((found, fitted))
}

/// Takes from every interval the certainty that held neighbours lend: a number that is held is not
/// known better for it. An interval counts where the fit of all has one too, and is as wide.
fn widen(found: &mut Found, of_all: &[Width]) {
    for (index, of_all) in of_all.iter().enumerate() {
        let Width::Half(half) = found.widths[index] else {
            continue;
        };
        let larger = match *of_all {
            Width::Open => {
                found.widths[index] = Width::Open;
                continue;
            }
            Width::AtBound => 1.0,
            Width::Half(of_all) => (of_all / half).max(1.0),
        };
        found.widths[index] = Width::Half(larger * half);
        found.covariance.row_mut(index).scale_mut(larger);
        found.covariance.column_mut(index).scale_mut(larger);
    }
}

/// Noise over the spread of the signals, root of the sum of the squares of all sensors. `None`
/// where any sensor shows more than noise in any recording.
pub(super) fn noise_beside_spread(plant: &Plant, recordings: &[Recording]) -> Option<f64> {
    let (mut squares, mut count) = (0.0, 0_usize);
    for recording in recordings {
        for sensor in plant.sensors() {
            let values = recording.column(&sensor.column)?;
            let spread = noise_alone(recording.t(), values)?;
            squares += (noise_level(recording.t(), values) / spread).powi(2);
            count += 1;
        }
    }
    let mean = squares / count.max(1) as f64;
    (count > 0).then(|| (plant.sensors().len() as f64 * mean).sqrt())
}

/// Holds undetermined parameters for as long as that adds no error.
fn hold(
    (rig, plant): (&Rig, &Plant),
    error: &dyn Fn(&Rig) -> Result<f64>,
    (first, at_rest): (Found, Option<f64>),
    run: &mut dyn FnMut(&[usize]) -> Result<Found>,
) -> Result<(Found, Rig)> {
    let free = fitted(rig, plant, &first)?;
    let least = error(&free)?;
    let (first_error, samples) = (first.error, first.samples);
    // A free run shows how well the first rows tell where it starts; the fit itself does not.
    let leaves_no_more = |held: usize, found: &Found, fitted: &Rig| -> Result<bool> {
        let by_noise = (1.0 + gain_of_noise(held) / samples.max(1) as f64).sqrt();
        Ok(found.error <= (by_noise + NO_MORE) * first_error
            || at_rest.is_some_and(|noise| found.error <= most_of_noise(samples) * noise)
            || error(fitted)? <= (1.0 + NO_MORE) * least)
    };
    let mut best = (first, free);
    loop {
        let open = undetermined(&best.0);
        if open.is_empty() {
            return Ok(best);
        }
        // All at once where their directions are silent altogether; else one by one, since a
        // parameter may be determined once its neighbour is held.
        let all = [&best.0.held[..], &open].concat();
        let singles = open
            .iter()
            .map(|&slot| [&best.0.held[..], &[slot]].concat());
        let choices: Vec<Vec<usize>> = match open.len() {
            1 => vec![all],
            _ => std::iter::once(all).chain(singles).collect(),
        };
        let mut kept = None;
        for held in choices {
            let Ok(found) = run(&held) else { continue };
            let fitted = fitted(rig, plant, &found)?;
            if leaves_no_more(held.len(), &found, &fitted)? {
                kept = Some((found, fitted));
                break;
            }
        }
        match kept {
            Some(kept) => best = kept,
            None => return Ok(best),
        }
    }
}

/// Squares, in units of the noise's, that so many parameters gain by noise alone: the mean of their
/// chi-squared distribution and six of its standard deviations.
fn gain_of_noise(parameters: usize) -> f64 {
    let freedom = parameters as f64;
    freedom + 6.0 * (2.0 * freedom).sqrt()
}

/// Fitted parameters that the recordings leave open and that are not held yet; one that noise drove
/// to a bound is open, too.
fn undetermined(found: &Found) -> Vec<usize> {
    let open = found.slots.iter().zip(&found.widths);
    let open = open.filter(|(slot, width)| **width == Width::Open && !found.held.contains(slot));
    open.map(|(slot, _)| *slot).collect()
}

/// The rig with fitted values; a held one keeps its digits.
pub(crate) fn fitted(rig: &Rig, plant: &Plant, found: &Found) -> Result<Rig> {
    let slots = found.slots.iter().filter(|slot| !found.held.contains(slot));
    let slots = slots.copied().chain(found.local.iter().map(|it| it.slot));
    let named: Vec<(&str, f64)> = slots
        .map(|slot| {
            let name = plant.parameters()[slot].name.as_str();
            (name, found.values[slot])
        })
        .collect();
    Ok(rig.with_values(&named)?)
}
