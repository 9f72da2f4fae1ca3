//! Parameters that the recordings do not determine stay as written, to the digit.
//!
//! A fit moves along directions in which the data are silent, by noise alone. Such parameters are
//! held as written and the others are fitted again; the result counts where it leaves no more.

use sinew_sim::{Plant, Rig};

use super::bounds::bounds;
use super::score::{relative, score};
use super::stages::Found;
use crate::error::Result;
use crate::recording::Recording;

/// Error that holding parameters may add, as a part of the error.
const NO_MORE: f64 = 0.01;

/// The fit in which every undetermined parameter that can be is held as written, and its rig. `run`
/// fits with some slots held.
///
/// # Errors
/// As [`score`]; those of `run` end the search and not the fit.
pub(super) fn keep(
    rig: &Rig,
    plant: &Plant,
    recordings: &[Recording],
    first: Found,
    run: &mut dyn FnMut(&[usize]) -> Result<Found>,
) -> Result<(Found, Rig)> {
    let claimed: Vec<bool> = first.half_widths.iter().map(Option::is_some).collect();
    let (mut found, fitted) = hold(rig, plant, recordings, first, run)?;
    // Held neighbours lend no certainty: an interval counts where the fit of all has one too.
    for (width, claimed) in found.half_widths.iter_mut().zip(claimed) {
        *width = width.filter(|_| claimed);
    }
    Ok((found, fitted))
}

/// Holds undetermined parameters for as long as that adds no error.
fn hold(
    rig: &Rig,
    plant: &Plant,
    recordings: &[Recording],
    first: Found,
    run: &mut dyn FnMut(&[usize]) -> Result<Found>,
) -> Result<(Found, Rig)> {
    let free = fitted(rig, plant, &first)?;
    let least = error(&free, recordings)?;
    let mut best = (first, free);
    loop {
        let open = undetermined(plant, &best.0);
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
            if error(&fitted, recordings)? <= (1.0 + NO_MORE) * least {
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

/// Fitted parameters without an interval that rest at no bound and are not held yet.
fn undetermined(plant: &Plant, found: &Found) -> Vec<usize> {
    let open = found.slots.iter().zip(&found.half_widths);
    let open = open.filter(|(slot, width)| {
        let [low, high] = bounds(&plant.parameters()[**slot]);
        let value = found.values[**slot];
        width.is_none() && !found.held.contains(slot) && value > low && value < high
    });
    open.map(|(slot, _)| *slot).collect()
}

/// The rig with fitted values; a held one keeps its digits.
pub(super) fn fitted(rig: &Rig, plant: &Plant, found: &Found) -> Result<Rig> {
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

/// Free-run error over the spread of the signals.
fn error(rig: &Rig, recordings: &[Recording]) -> Result<f64> {
    Ok(relative(&score(rig, recordings)?))
}
