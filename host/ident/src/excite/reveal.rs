//! Distinguishability of effects in an experiment: each effect of the vocabulary, weak, at each
//! place where it could sit, measured against noise and against what the rig's own parameters could
//! imitate (docs/explanation/experiments.md, eq. 5 and 6).

mod imitation;

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::Serialize;
use sinew_sim::effects::Kind;
use sinew_sim::rig::Site;
use sinew_sim::{InputTrajectory, Plant, Rig, Settings};

use super::Experiment;
use crate::error::{Error, Result};
use crate::scales::{Run, range};
use imitation::{Imitation, norm};

/// At this distance from everything else, in standard deviations, an effect is revealed.
pub const REVEALED: f64 = 10.0;
/// At this one it can be guessed at.
pub const WEAKLY: f64 = 3.0;
/// From this cosine on two effects look the same.
pub const PARALLEL: f64 = 0.95;
/// Longest sub-step of the runs that are compared, in units of one over the fastest rate. Both of a
/// pair err alike by some thousandths of the motion, and what is left of that in their difference
/// is far less.
const RATE_STEP: f64 = 0.5;
/// By how much an effect, or other numbers, may make a run dearer before it is given up.
const DEARER: usize = 16;

/// Grade of a distance from everything else.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Visibility {
    /// The effect would be named.
    Determined,
    /// It would be guessed at.
    Weakly,
    /// It would not be seen.
    NotDetermined,
}

impl Visibility {
    /// Grade of a distance in standard deviations of the noise; none of what cannot be simulated.
    pub fn of(distance: Option<f64>) -> Self {
        match distance {
            Some(distance) if distance >= REVEALED => Self::Determined,
            Some(distance) if distance >= WEAKLY => Self::Weakly,
            _ => Self::NotDetermined,
        }
    }
}

/// Visibility of one effect in an experiment.
#[derive(Clone, Debug)]
pub struct Seen {
    /// Law of the effect.
    pub kind: Kind,
    /// The name of the place where it sits.
    pub component: String,
    /// Its parameters, weak for this experiment.
    pub values: Vec<f64>,
    /// Distance of its effect on the signals from all that the rig's free parameters and its start
    /// could do, in standard deviations of the noise; none where it could not be simulated.
    pub distance: Option<f64>,
}

/// Two effects that would be taken for one another.
#[derive(Clone, Debug)]
pub struct Confusion {
    /// Indices of [`Revelation::effects`].
    pub pair: [usize; 2],
    /// Of the angle between what is left of their signals, without sign.
    pub cosine: f64,
}

/// Visibility of all effects in an experiment.
#[derive(Clone, Debug)]
pub struct Revelation {
    /// Every effect at every place.
    pub effects: Vec<Seen>,
    /// Those that would be confused, the closest first.
    pub confusions: Vec<Confusion>,
    /// Free parameters and start states that were projected off.
    pub directions: usize,
    /// Standard deviation of the noise on each sensor, SI.
    pub noise: Vec<f64>,
}

/// Simulates the rig with and without each effect; `noise` is the standard deviation of every
/// sensor as a fraction of its signal's range. `progress` hears (done, of).
///
/// # Errors
/// `Arguments` for a noise that is not positive; `Simulation` where the rig itself cannot be
/// simulated.
pub fn reveal(
    rig: &Rig,
    experiment: &Experiment,
    noise: f64,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Revelation> {
    if !(noise > 0.0 && noise <= 1.0) {
        let expectation = "a fraction of a signal's range in (0, 1]";
        return Err(Error::must_be("--noise", expectation, noise)
            .help("for example --noise 0.005: half a percent; without noise all shows"));
    }
    let mut settings = Settings {
        rate_step: RATE_STEP,
        ..Settings::default()
    };
    let plant = Plant::new(rig)?.with_settings(settings);
    let columns: Vec<&[f64]> = experiment.inputs.iter().map(Vec::as_slice).collect();
    let drive = InputTrajectory::new(&plant, experiment.t.len(), &columns)?;
    let start = plant.initial_state(&plant.values(), &vec![None; plant.sensors().len()])?;
    let plain = plant.simulate(&plant.values(), &start, &drive, &experiment.t)?;
    settings.max_substeps = (DEARER * plain.report.most_substeps).min(settings.max_substeps);
    let plant = plant.with_settings(settings);
    let deviations = deviations(&plant, noise, |sensor| range(&plain.column(sensor)));
    let imitation = Imitation::of(&plant, &start, (&drive, &experiment.t), &deviations)?;

    let values = plant.values();
    let mut run = Run::new(rig, &plant, &values, &[&experiment.inputs]);
    run.take((&values, &start), &drive, &experiment.t)?;
    let places: Vec<(Kind, Site)> = (Kind::ALL.iter())
        .flat_map(|&kind| kind.sites(rig).into_iter().map(move |site| (kind, site)))
        .collect();
    let done = AtomicUsize::new(0);
    let tried: Vec<(Seen, Vec<f32>)> = (places.par_iter())
        .map(|&(kind, site)| {
            let values = kind
                .starts(&run.at(site))
                .into_iter()
                .next()
                .unwrap_or_default();
            let left = with_effect(rig, experiment, (kind, site, &values), settings)
                .map(|signals| imitation.left(&signals, WEAKLY));
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, places.len());
            let distance = left.as_deref().map(norm);
            let seen = Seen {
                kind,
                component: rig.site_name(site).to_string(),
                values,
                distance,
            };
            let length = distance.unwrap_or(0.0).max(f64::MIN_POSITIVE);
            let unit = left
                .unwrap_or_default()
                .iter()
                .map(|x| (x / length) as f32)
                .collect();
            (seen, unit)
        })
        .collect();
    Ok(Revelation {
        confusions: confusions(&tried),
        effects: tried.into_iter().map(|(seen, _)| seen).collect(),
        directions: imitation.directions(),
        noise: deviations,
    })
}

/// The signals of the rig with one effect more; none where it cannot be simulated so.
fn with_effect(
    rig: &Rig,
    experiment: &Experiment,
    (kind, site, values): (Kind, Site, &[f64]),
    settings: Settings,
) -> Option<Vec<f64>> {
    let plant = Plant::new(&rig.with_effect(kind, site, values).ok()?).ok()?;
    let plant = plant.with_settings(settings);
    let columns: Vec<&[f64]> = experiment.inputs.iter().map(Vec::as_slice).collect();
    let drive = InputTrajectory::new(&plant, experiment.t.len(), &columns).ok()?;
    let values = plant.values();
    let start = plant.initial_state(&values, &vec![None; plant.sensors().len()]);
    let run = plant
        .simulate(&values, &start.ok()?, &drive, &experiment.t)
        .ok()?;
    Some(run.signals)
}

/// Noise of each sensor, SI. A signal that hardly moves is taken to be as noisy as a thousandth of
/// the largest of its unit; one that nothing moves says nothing.
fn deviations(plant: &Plant, noise: f64, range: impl Fn(usize) -> (f64, f64)) -> Vec<f64> {
    let spans: Vec<f64> = (0..plant.sensors().len())
        .map(range)
        .map(|(low, high)| high - low)
        .collect();
    let units = plant.sensors().iter().map(|sensor| sensor.unit.as_str());
    let of = |(unit, span): (&str, &f64)| {
        let alike = plant
            .sensors()
            .iter()
            .zip(&spans)
            .filter(|(s, _)| s.unit == unit);
        let largest = alike.map(|(_, span)| *span).fold(0.0, f64::max);
        match noise * span.max(1e-3 * largest) {
            deviation if deviation > 0.0 => deviation,
            _ => f64::INFINITY,
        }
    };
    units.zip(&spans).map(of).collect()
}

/// Pairs of effects that show at all and look alike.
fn confusions(tried: &[(Seen, Vec<f32>)]) -> Vec<Confusion> {
    let shows = |seen: &Seen| seen.distance.is_some_and(|distance| distance >= WEAKLY);
    let shown: Vec<usize> = (0..tried.len()).filter(|&k| shows(&tried[k].0)).collect();
    let mut found: Vec<Confusion> = (shown.par_iter())
        .flat_map_iter(|&a| {
            let later = shown.iter().copied().filter(move |&b| b > a);
            later.filter_map(move |b| {
                let products = tried[a].1.iter().zip(&tried[b].1);
                let cosine = products.map(|(x, y)| f64::from(x * y)).sum::<f64>().abs();
                (cosine >= PARALLEL).then_some(Confusion {
                    pair: [a, b],
                    cosine,
                })
            })
        })
        .collect();
    found.sort_by(|a, b| b.cosine.total_cmp(&a.cosine).then(a.pair.cmp(&b.pair)));
    found
}

#[cfg(test)]
mod tests;
