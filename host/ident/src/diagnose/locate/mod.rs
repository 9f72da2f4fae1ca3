//! Place and time of the mismatch: a force without a law is tried at every place, and the one
//! that explains the recordings best is shown (docs/explanation/diagnosis.md, eq. 12 to 17).

mod latent_force;
pub(crate) mod learned_force;
pub mod regime;
mod regressors;
mod traces;

use crate::diagnose::config::CONFIG;
use sinew_sim::effects::Quantity;
use sinew_sim::{Plant, Rig};

use crate::diagnose::data::Data;
use crate::diagnose::details::{ForceTrace, Recovered};
use crate::diagnose::finding::Interval;
use crate::diagnose::locate::latent_force::{Place, Pushed, Trace, Wander, places};
use crate::diagnose::locate::regime::{ForceSample, Regime, driving, regime, units};
use crate::diagnose::locate::regressors::{Company, follows};
use crate::diagnose::locate::traces::{recover_all, thin, wanders};
use crate::diagnose::residuals::Residuals;
use crate::error::Result;
use crate::fit::free_run;
use crate::order;
use crate::parallel;
use crate::recording::Recording;

/// A place with the force that it lacks.
pub(crate) struct Located {
    pub component: String,
    pub follows: String,
    pub regime: Option<Regime>,
    pub recovered: Recovered,
}

/// The rig with the named effects, and the recordings that its own values are found from.
#[derive(Clone, Copy)]
pub(crate) struct Corrected<'a> {
    pub rig: &'a Rig,
    pub recordings: &'a [Recording],
}

impl Corrected<'_> {
    /// Its plant, and its values in a recording.
    fn in_recording(&self, index: usize) -> Option<(Plant, Vec<f64>)> {
        let plant = Plant::new(self.rig).ok()?;
        let values = free_run(self.rig, self.recordings.get(index)?).ok()?.values;
        Some((plant, values))
    }
}

/// Tries a force at every place of the refitted rig; `at` asks for one place only, `corrected` for
/// the law that the named effects give there.
///
/// # Errors
/// None that reading the recordings has not excluded.
pub(crate) fn locate(
    rig: &Rig,
    data: &Data,
    at: Option<&str>,
    corrected: Option<Corrected<'_>>,
) -> Result<Option<Located>> {
    let Some(pushed) = Pushed::new(rig) else {
        return Ok(None);
    };
    let plant = Plant::new(rig)?;
    let thinned = thin(data, rig, &plant);
    let tries: Vec<(Place, Wander)> = places(rig)
        .into_iter()
        .filter(|place| at.is_none_or(|at| place.component == at))
        .flat_map(|place| {
            wanders(rig, &thinned, &place)
                .into_iter()
                .map(move |wander| (place.clone(), wander))
        })
        .collect();
    let done = parallel::try_map(&tries, |(place, wander)| {
        let trace = pushed.recover(rig, place, *wander, &thinned, 0)?;
        Ok(trace.map(|trace| (place.clone(), *wander, trace)))
    })?;
    let best = done
        .into_iter()
        .flatten()
        .max_by(|a, b| a.2.evidence.total_cmp(&b.2.evidence));
    let Some((place, wander, _)) = best else {
        return Ok(None);
    };
    let traces = recover_all(&pushed, rig, (&place, wander), &thinned)?;
    let (what, samples) = followed(rig, &plant, &place, &thinned, &traces);
    let motion = rig.bodies[place.to].motion;
    let laws: Vec<Vec<f64>> = (traces.iter().zip(&thinned.experiments).enumerate())
        .map(|(index, (trace, experiment))| {
            let named = corrected.and_then(|corrected| corrected.in_recording(index));
            named.map_or_else(Vec::new, |(plant, values)| {
                pushed.named_law(&place, (&plant, &values), experiment, trace)
            })
        })
        .collect();
    // Effects of a sensor are no force.
    let largest = laws
        .iter()
        .flatten()
        .fold(0.0, |most: f64, f| most.max(f.abs()));
    let most = samples
        .iter()
        .fold(0.0, |most: f64, s| most.max(s.force.abs()));
    let is_force = largest > CONFIG.locate.no_force * most;
    let units = units(rig, &plant, &place, driving(rig, &plant, &place));
    Ok(Some(Located {
        component: place.component.clone(),
        follows: what.to_owned(),
        regime: regime(&place.component, &units, &samples),
        recovered: Recovered {
            component: place.component,
            unit: Quantity::Force.unit(motion).to_owned(),
            position_unit: Quantity::Coordinate.unit(motion).to_owned(),
            traces: traces
                .into_iter()
                .zip(&thinned.experiments)
                .zip(laws)
                .map(|((trace, experiment), law)| ForceTrace {
                    recording: experiment.name.clone(),
                    t: experiment.t.clone(),
                    position: trace.position,
                    velocity: trace.velocity,
                    force: trace.force,
                    law: if is_force { law } else { Vec::new() },
                })
                .collect(),
        },
    }))
}

/// Quantity that the force at a place follows, and the force at each sample of all recordings.
fn followed(
    rig: &Rig,
    plant: &Plant,
    place: &Place,
    thinned: &Data,
    traces: &[Trace],
) -> (&'static str, Vec<ForceSample>) {
    let joined = |f: fn(&Trace) -> &Vec<f64>| -> Vec<f64> {
        traces.iter().flat_map(|trace| f(trace).clone()).collect()
    };
    let t: Vec<f64> = thinned
        .experiments
        .iter()
        .take(traces.len())
        .flat_map(|e| e.t.clone())
        .collect();
    let input: Option<Vec<f64>> = driving(rig, plant, place).map(|column| {
        let of = thinned.experiments.iter().take(traces.len());
        of.flat_map(|e| e.inputs[column].clone()).collect()
    });
    let (force, deviation, position, velocity) = (
        joined(|t| &t.force),
        joined(|t| &t.deviation),
        joined(|t| &t.position),
        joined(|t| &t.velocity),
    );
    let (what, _) = follows(&Company {
        t: &t,
        force: &force,
        deviation: &deviation,
        position: &position,
        velocity: &velocity,
        input: input.as_deref(),
    });
    let samples = (0..force.len()).map(|row| ForceSample {
        position: position[row],
        velocity: velocity[row],
        input: input.as_ref().map(|input| input[row]),
        force: force[row],
    });
    (what, samples.collect())
}

/// When a rig misses a recording most: intervals of a fortieth of it that are missed by more than
/// half as much as the worst, at most five (eq. 17).
pub(crate) fn intervals(residuals: &Residuals, data: &Data) -> Vec<Interval> {
    let mut windows: Vec<Interval> = Vec::new();
    for (index, experiment) in data.experiments.iter().enumerate() {
        let rows = experiment.rows();
        let length = (rows / CONFIG.locate.windows).max(1);
        let count = rows.div_ceil(length);
        let (mut squares, mut counts) = (vec![0.0; count], vec![0.0; count]);
        for (sensor, (series, origin)) in residuals.series.iter().zip(&residuals.origin).enumerate()
        {
            for (residual, (of, row)) in series.iter().flatten().zip(origin) {
                if *of == index {
                    squares[row / length] += (residual / data.sigma[sensor]).powi(2);
                    counts[row / length] += 1.0;
                }
            }
        }
        for window in 0..count {
            if counts[window] > 0.0 {
                let last = ((window + 1) * length).min(rows) - 1;
                windows.push(Interval {
                    t_start_s: experiment.t[window * length],
                    t_end_s: experiment.t[last],
                    recording: experiment.name.clone(),
                    score: (squares[window] / counts[window]).sqrt(),
                });
            }
        }
    }
    let worst = windows.iter().map(|w| w.score).fold(0.0, f64::max);
    let mut joined: Vec<Interval> = Vec::new();
    for window in windows
        .into_iter()
        .filter(|w| w.score > CONFIG.locate.missed * worst)
    {
        match joined.last_mut() {
            // Neighbours: nothing but one sample lies between them.
            Some(last)
                if last.recording == window.recording
                    && window.t_start_s - last.t_end_s
                        <= CONFIG.locate.gap * (window.t_end_s - window.t_start_s) =>
            {
                last.t_end_s = window.t_end_s;
                last.score = last.score.max(window.score);
            }
            _ => joined.push(window),
        }
    }
    order::sort_down(&mut joined, |it| it.score);
    joined.truncate(CONFIG.locate.intervals);
    joined
}
