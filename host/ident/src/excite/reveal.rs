//! Distinguishability of effects in an experiment: each effect of the vocabulary, weak, at each
//! place where it could sit, measured against noise and against what the rig's own parameters could
//! imitate (docs/explanation/experiments.md, eq. 5 and 6).

mod imitation;
mod instance;

use std::sync::atomic::{AtomicUsize, Ordering};

use serde::Serialize;
use sinew_sim::effects::Kind;
use sinew_sim::{InputTrajectory, Plant, Rig, SimulationSettings};

use super::Experiment;
use crate::error::{Error, Result};
use crate::parallel;
use crate::scales::range;
pub(super) use imitation::{Effort, Imitation, dot, norm};
pub(super) use instance::Instance;

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
/// Effort of an imitation: what stays below a guess is not pursued.
const EFFORT: Effort = Effort {
    steps: 3,
    enough: WEAKLY,
    halvings: 2,
    worth: 0.8,
};
/// Factor by which an effect, or other numbers, may raise the cost of a run before it is given up.
const MORE_STEPS: usize = 16;

/// Grade of a distance from everything else.
///
/// ```
/// use sinew_ident::excite::reveal::Visibility;
///
/// assert_eq!(Visibility::of(Some(1e3)), Visibility::Determined);
/// assert_eq!(Visibility::of(Some(0.0)), Visibility::NotDetermined);
/// assert_eq!(Visibility::of(None), Visibility::NotDetermined);
/// ```
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
    /// Half of the 95 % interval of each free parameter after this experiment, SI, in the rig's
    /// order; infinite where nothing determines it.
    pub half_widths: Vec<f64>,
}

impl Revelation {
    /// One entry an effect: its distance, 0 where it could not be simulated.
    pub(super) fn distances(&self) -> Vec<f64> {
        let of = |seen: &Seen| seen.distance.unwrap_or(0.0);
        self.effects.iter().map(of).collect()
    }
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
    let (instances, deviations) = weak_instances(rig, experiment, noise)?;
    measure(rig, experiment, &instances, (&deviations, EFFORT), progress)
}

/// Weak instances of all effects for an experiment, and the noise of each sensor in it, SI.
///
/// # Errors
/// As of [`reveal`].
pub(super) fn weak_instances(
    rig: &Rig,
    experiment: &Experiment,
    noise: f64,
) -> Result<(Vec<Instance>, Vec<f64>)> {
    if !(noise > 0.0 && noise <= 1.0) {
        let expectation = "a fraction of a signal's range in (0, 1]";
        return Err(Error::must_be("--noise", expectation, noise)
            .help("for example --noise 0.005: half a percent; without noise all shows"));
    }
    let plant = Plant::new(rig)?.with_settings(settings());
    let (start, drive) = driven(&plant, experiment)?;
    let plain = plant.simulate(&plant.values(), &start, &drive, &experiment.t)?;
    let deviations = deviations(&plant, noise, |sensor| range(&plain.column(sensor)));
    Ok((Instance::all(rig, &plant, experiment)?, deviations))
}

/// Steps of the runs that are compared.
pub(super) fn settings() -> SimulationSettings {
    SimulationSettings {
        rate_step: RATE_STEP,
        ..SimulationSettings::default()
    }
}

/// Start at rest, and inputs of an experiment as the simulator takes them.
pub(super) fn driven(
    plant: &Plant,
    experiment: &Experiment,
) -> Result<(Vec<f64>, InputTrajectory)> {
    let columns: Vec<&[f64]> = experiment.inputs.iter().map(Vec::as_slice).collect();
    let drive = InputTrajectory::new(plant, experiment.t.len(), &columns)?;
    let start = plant.initial_state(&plant.values(), &vec![None; plant.sensors().len()])?;
    Ok((start, drive))
}

/// Most sub-steps of a run with an effect, or with other numbers, beside those of the rig itself.
pub(super) fn bounded(settings: SimulationSettings, most_substeps: usize) -> SimulationSettings {
    SimulationSettings {
        max_substeps: (MORE_STEPS * most_substeps).min(settings.max_substeps),
        ..settings
    }
}

/// Distance of each of the given instances in an experiment, under noise of the given standard
/// deviations (SI, one a sensor). `progress` hears (done, of).
///
/// # Errors
/// `Simulation` where the rig itself cannot be simulated.
pub(super) fn measure(
    rig: &Rig,
    experiment: &Experiment,
    instances: &[Instance],
    (deviations, effort): (&[f64], Effort),
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Revelation> {
    let plant = Plant::new(rig)?.with_settings(settings());
    let (start, drive) = driven(&plant, experiment)?;
    let plain = plant.simulate(&plant.values(), &start, &drive, &experiment.t)?;
    let settings = bounded(settings(), plain.report.most_substeps);
    let plant = plant.with_settings(settings);
    let imitation = Imitation::of(&plant, &start, (&drive, &experiment.t), deviations)?;
    let done = AtomicUsize::new(0);
    let tried: Vec<(Seen, Vec<f32>)> = parallel::map(instances, |instance| {
        let signals = instance.signals(rig, experiment, settings);
        let left = signals.map(|signals| imitation.left(&signals, effort));
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, instances.len());
        let distance = left.as_deref().map(norm);
        let seen = Seen {
            kind: instance.kind,
            component: rig.site_name(instance.site).to_string(),
            values: instance.values.clone(),
            distance,
        };
        let length = distance.unwrap_or(0.0).max(f64::MIN_POSITIVE);
        let left = left.unwrap_or_default();
        let unit = left.iter().map(|x| (x / length) as f32).collect();
        (seen, unit)
    });
    Ok(Revelation {
        confusions: confusions(&tried),
        effects: tried.into_iter().map(|(seen, _)| seen).collect(),
        directions: imitation.directions(),
        noise: deviations.to_vec(),
        half_widths: imitation.half_widths(),
    })
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
    let of_first = parallel::map(&shown, |&a| -> Vec<Confusion> {
        let later = shown.iter().copied().filter(|&b| b > a);
        let confused = later.filter_map(|b| {
            let products = tried[a].1.iter().zip(&tried[b].1);
            let cosine = products.map(|(x, y)| f64::from(x * y)).sum::<f64>().abs();
            (cosine >= PARALLEL).then_some(Confusion {
                pair: [a, b],
                cosine,
            })
        });
        confused.collect()
    });
    let mut found = of_first.concat();
    found.sort_by(|a, b| b.cosine.total_cmp(&a.cosine).then(a.pair.cmp(&b.pair)));
    found
}

#[cfg(test)]
mod tests;
