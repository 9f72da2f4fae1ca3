//! End positions: one actuator slowly to each side, until its motion ends or its command does.

use std::collections::BTreeMap;

use super::bench::{Bench, Cut};
use super::journal::{AtRest, End, Moved};
use super::rest::{mean, threshold};
use super::setup::{Actuator, Setup};
use sinew_ident::error::{Error, Result};

/// Steps of the command, on each of which the readings are averaged.
const STEPS: usize = 40;
/// Fewest and most steps in a row without motion that make an end.
const FLAT: std::ops::RangeInclusive<usize> = 3..=10;
/// Part of the usual slope below which a step counts as one without motion.
const SLOPE: f64 = 0.2;
/// Part of the way by which the soft limit stays in front of an end.
const MARGIN: f64 = 0.05;

/// A search for an end, fed with steps of the command and the readings there.
///
/// A sensor's slope is compared with the median of its slopes so far. An end is where no sensor
/// moves any more; steps too small for the noise decide nothing.
pub struct Search {
    /// Steps in a row without motion that make an end.
    flat: usize,
    thresholds: Vec<f64>,
    last: Option<Vec<f64>>,
    changes: Vec<Vec<f64>>,
}

impl Search {
    /// Nothing seen yet; one threshold a sensor, the change that noise alone does not make.
    pub fn new(thresholds: Vec<f64>, flat: usize) -> Self {
        Self {
            flat,
            changes: vec![Vec::new(); thresholds.len()],
            thresholds,
            last: None,
        }
    }

    /// Takes the mean readings of the next step: true once the last ones had no motion.
    pub fn step(&mut self, readings: &[f64]) -> bool {
        if let Some(last) = &self.last {
            let changes = readings.iter().zip(last).map(|(now, before)| now - before);
            for (kept, change) in self.changes.iter_mut().zip(changes) {
                kept.push(change.abs());
            }
        }
        self.last = Some(readings.to_vec());
        let sensors = self.changes.iter().zip(&self.thresholds);
        let flat: Vec<Option<bool>> = sensors
            .map(|(changes, threshold)| flat(changes, *threshold, self.flat))
            .collect();
        // One that still moves is no end; with none that can be judged nothing is known.
        flat.contains(&Some(true)) && !flat.contains(&Some(false))
    }
}

/// True where the last steps have no motion, false where they have, none where noise hides it.
fn flat(changes: &[f64], threshold: f64, steps: usize) -> Option<bool> {
    let (before, last) = changes.split_at(changes.len().checked_sub(steps)?);
    let mut before: Vec<f64> = before.iter().copied().filter(|c| c.is_finite()).collect();
    if before.len() < steps {
        return None;
    }
    let middle = before.len() / 2;
    let usual = *before.select_nth_unstable_by(middle, f64::total_cmp).1;
    if usual * (steps as f64) < threshold {
        return None;
    }
    Some(last.iter().sum::<f64>() < SLOPE * usual * steps as f64)
}

/// Steps without motion that make an end of a rig whose predicted readings are these, a row a step.
/// A springy rig swings on its way and stands still now and then: one more step than makes an end
/// of that. A prediction that ends by itself decides nothing.
fn steps_of_an_end(predicted: &[Vec<f64>]) -> usize {
    let sensors = predicted.first().map_or(0, Vec::len);
    let goes_on = |flat: &usize| {
        let mut search = Search::new(vec![0.0; sensors], *flat);
        !predicted.iter().any(|readings| search.step(readings))
    };
    FLAT.clone().find(goes_on).unwrap_or(*FLAT.start()) + 1
}

/// Rows of a way from the safe command to one end, held there for one more step, and the ticks of a
/// step.
fn ramp(setup: &Setup, driven: usize, (seconds, side): (f64, f64)) -> (Vec<Vec<f64>>, usize) {
    let ticks = (seconds / setup.period_s).ceil().max(STEPS as f64) as usize;
    let per_step = ticks / STEPS;
    let ramp = (0..=ticks).map(|k| side * k as f64 / ticks as f64);
    // Held at the end for one more step, so that its readings are whole.
    let parts: Vec<f64> = ramp.chain(std::iter::repeat_n(side, per_step)).collect();
    let rows: Vec<Vec<f64>> = (parts.iter())
        .map(|part| {
            let each = setup.actuators.iter().enumerate();
            each.map(|(j, a)| if j == driven { a.at(*part) } else { a.safe })
                .collect()
        })
        .collect();
    (rows, per_step)
}

/// Limits the board to the range of the driven actuator, with the others at their safe commands.
fn limit(bench: &mut Bench, setup: &Setup, driven: usize, seconds: f64) -> Result<()> {
    let ranges: Vec<(f64, f64)> = (setup.actuators.iter().enumerate())
        .map(|(j, a)| match j {
            j if j == driven => (a.low, a.high),
            _ => (a.safe, a.safe),
        })
        .collect();
    // On the way back four times as fast.
    let rates: Vec<f64> = (setup.actuators.iter())
        .map(|a| 4.0 * (a.high - a.low) / seconds)
        .collect();
    bench.limit(setup, &ranges, &rates)
}

fn refuse_cut(setup: &Setup, actuator: &Actuator, cut: &Option<Cut>) -> Result<()> {
    match cut {
        Some(Cut::RanAway(sensor)) => Err(Error::failed(format!(
            "`{}` left the range that the rig predicts while `{}` went to its end: the \
                 emergency stop was sent",
            setup.sensors[*sensor].column, actuator.column
        ))
        .help("narrow --range, or correct the rig where it predicts too little motion")),
        Some(Cut::Board(state)) => Err(Error::failed(format!(
            "the board stopped by itself ({:?}) while `{}` went to its end",
            state.cause, actuator.column
        ))
        .help("docs/reference/faults.md says what this means; narrow --range")),
        Some(Cut::Asked) | None => Ok(()),
    }
}

/// Finds one end of an actuator. `moved`: what its small motion said; `seconds`, `side`: duration
/// of the way, and the upper (1) or the lower (-1) end.
///
/// # Errors
/// The board is gone, stops by itself, a reading runs away; Ctrl-C.
pub fn side(
    bench: &mut Bench,
    setup: &Setup,
    driven: usize,
    (at_rest, moved): (&[AtRest], &Moved),
    (seconds, side): (f64, f64),
    guard: &[(f64, f64)],
) -> Result<End> {
    let actuator = &setup.actuators[driven];
    let readings = |values: &[f64]| -> BTreeMap<String, f64> {
        let named = setup.sensors.iter().zip(values);
        named
            .filter(|(_, value)| value.is_finite())
            .map(|(sensor, value)| (sensor.column.clone(), *value))
            .collect()
    };
    if !actuator.has_side(side) {
        let values: Vec<f64> = at_rest.iter().map(|sensor| sensor.mean).collect();
        return Ok(End {
            command: actuator.at(side),
            saturated: false,
            readings: readings(&values),
        });
    }
    let (rows, per_step) = ramp(setup, driven, (seconds, side));
    limit(bench, setup, driven, seconds)?;
    let judged: Vec<usize> = (0..setup.sensors.len())
        .filter(|i| moved.ratios.contains_key(&setup.sensors[*i].column))
        .collect();
    let predicted = setup.predict(&rows, &[])?;
    let predicted: Vec<Vec<f64>> = (0..rows.len() / per_step)
        .map(|step| {
            let of = |i: &usize| mean(&predicted[*i][step * per_step..(step + 1) * per_step]);
            judged.iter().map(of).collect()
        })
        .collect();
    let flat = steps_of_an_end(&predicted);
    let thresholds = judged.iter().map(|i| threshold(&at_rest[*i]));
    let mut search = Search::new(thresholds.collect(), flat);
    let mut sums = vec![(0.0, 0_usize); setup.sensors.len()];
    let (mut count, mut steps) = (0, Vec::new());
    let played = bench.play(&rows, guard, &mut |seen| {
        if seen.row.is_none() {
            return false;
        }
        for (sum, y) in sums.iter_mut().zip(seen.y.iter().chain(&seen.s)) {
            if y.is_finite() {
                *sum = (sum.0 + f64::from(*y), sum.1 + 1);
            }
        }
        count += 1;
        if count < per_step {
            return false;
        }
        let means: Vec<f64> = (sums.iter())
            .map(|(sum, n)| if *n > 0 { sum / *n as f64 } else { f64::NAN })
            .collect();
        count = 0;
        sums.fill((0.0, 0));
        let command = seen.u.get(driven).copied().map_or(actuator.safe, f64::from);
        let of_judged: Vec<f64> = judged.iter().map(|i| means[*i]).collect();
        steps.push((command, means));
        search.step(&of_judged)
    })?;
    refuse_cut(setup, actuator, &played.cut)?;
    let saturated = played.cut == Some(Cut::Asked);
    let last = steps.len().saturating_sub(1);
    let at = if saturated {
        last.saturating_sub(flat)
    } else {
        last
    };
    let Some((reached, means)) = steps.get(at) else {
        return Err(Error::failed(format!(
            "`{}` was not moved",
            actuator.column
        )));
    };
    let command = if saturated {
        reached - MARGIN * (reached - actuator.safe)
    } else {
        actuator.at(side)
    };
    Ok(End {
        command,
        saturated,
        readings: readings(means),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps until an end is found, by readings that are a function of the step.
    fn found(threshold: f64, reading: impl Fn(usize) -> f64) -> Option<usize> {
        let mut search = Search::new(vec![threshold], 3);
        (0..STEPS).find(|k| search.step(&[reading(*k)]))
    }

    #[test]
    fn a_motion_that_ends_is_an_end_and_one_that_goes_on_is_none() {
        assert_eq!(found(0.01, |k| 0.1 * k as f64), None);
        assert_eq!(found(0.01, |k| 0.1 * k.min(20) as f64), Some(20 + 3));
        // Both ways count, and one that bends by half is none.
        assert_eq!(found(0.01, |k| -0.1 * k.min(20) as f64), Some(20 + 3));
        let bent = |k: usize| 0.1 * k.min(20) as f64 + 0.05 * k.saturating_sub(20) as f64;
        assert_eq!(found(0.01, bent), None);
    }

    #[test]
    fn what_noise_hides_is_no_end() {
        assert_eq!(found(1.0, |k| 0.1 * k.min(20) as f64), None);
    }

    #[test]
    fn a_rig_that_swings_on_its_way_has_no_end_where_it_turns() {
        let swing = |k: usize| 0.1 * (k as f64 - (0.7 * k as f64).sin() / 0.7);
        assert!(
            found(0.01, swing).is_some(),
            "it never stands still: this tests nothing"
        );
        let predicted: Vec<Vec<f64>> = (0..STEPS).map(|k| vec![swing(k)]).collect();
        let mut search = Search::new(vec![0.01], steps_of_an_end(&predicted));
        assert!(!(0..STEPS).any(|k| search.step(&[1.2 * swing(k)])));
        // Its end is one all the same.
        let mut search = Search::new(vec![0.01], steps_of_an_end(&predicted));
        let end = (0..STEPS).find(|k| search.step(&[swing(*k.min(&22))]));
        assert!(end.is_some_and(|end| end > 22), "{end:?}");
    }

    #[test]
    fn a_sensor_that_still_moves_is_no_end() {
        let mut search = Search::new(vec![0.01; 2], 3);
        let end = (0..STEPS).find(|k| search.step(&[0.1 * *k.min(&20) as f64, *k as f64]));
        assert_eq!(end, None);
    }
}
