//! The search for what is missing: races, finals, pairs (docs/diagnosis.md).

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use sinew_sim::Rig;

use super::data::Data;
use super::evidence::Contender;
use super::race::{Track, Tried};
use super::suspect::{Suspect, suspects};
use crate::error::Result;
use crate::fit::levenberg::Unknowns;

/// How many of a race are fitted to everything.
const FINALISTS: usize = 4;

/// How many explanations a second effect is looked for on top of.
const BEAM: usize = 2;

/// What leaves more than this part of the squares is no half of a pair.
const HOPELESS: f64 = 0.9;

/// Sub-steps of the integrator that one simulation of a race takes, about; and one of a final.
const RACE_WORK: usize = 2500;
const FINAL_WORK: usize = 8000;

/// Thinned recordings are still at least this dense, in steps per unit of the fastest rate.
const THIN_RATE: f64 = 0.1;

/// Stretches that a race is cut into.
const RACE_PARTS: usize = 8;

/// Steps of a final fit.
pub(super) const FINAL_STEPS: usize = 7;

/// Recordings and how they are cut for judging.
pub(super) struct Bench<'a> {
    pub written: &'a Rig,
    pub fit: &'a Data,
    pub check: &'a Data,
    /// The recordings of both.
    pub both: &'a Data,
    pub fit_stretches: Vec<(usize, Range<usize>)>,
    pub check_stretches: Vec<(usize, Range<usize>)>,
    pub seed: u64,
    /// Less than 1 where recordings are too short to be checked by others.
    pub trust: f64,
    pub told: &'a (dyn Fn(&str, usize, usize) + Sync),
}

/// What the search found: contenders, best first; the believed rig itself is `base`.
pub(super) struct Found {
    pub base: Contender,
    pub finalists: Vec<Contender>,
    /// Index into `finalists` of what is believed.
    pub chosen: Option<usize>,
    /// What was believed on the way: the chosen one's effects in the order in which they were found.
    pub probabilities: Vec<f64>,
}

impl Bench<'_> {
    /// Whether the stretches of the fit recordings are these recordings whole.
    pub fn sees_whole_recordings(&self) -> bool {
        self.fit_stretches == self.fit.cut(1)
    }

    /// The whole search.
    pub fn search(&self, rig: &Rig, values: &[f64]) -> Result<Option<Found>> {
        let plant = sinew_sim::Plant::new(rig)?;
        let pace = pace(&plant, values, self.fit);
        let thin = self.thinning(pace);
        let thinned;
        let data = if thin > 1 {
            thinned = self.fit.thinned(rig, &plant, thin);
            &thinned
        } else {
            self.fit
        };
        let budget = RACE_WORK / substeps(pace * thin as f64);
        let track = Track {
            written: self.written,
            data,
            stretches: data.select(RACE_PARTS, budget.max(1000)),
        };
        let Some(start) = track.first(rig, values, 15)? else {
            return Ok(None);
        };
        let Some(base) = self.base(&start)? else {
            return Ok(None);
        };
        if !self.leaves_something(&base) {
            return Ok(Some(Found {
                base,
                finalists: Vec::new(),
                chosen: None,
                probabilities: Vec::new(),
            }));
        }
        let all = suspects(rig, &plant);
        let mut finalists = self.round(&track, &start, &all, "one effect")?;
        let mut chosen = self.best(&base, &finalists);
        let done = chosen.is_some_and(|index| !self.leaves_something(&finalists[index]));
        // A second effect in a few dozen rows is whatever the first one got wrong.
        let enough = self.fit.rows().min(self.check.rows()) >= super::roles::SHORTEST;
        if !done && enough && !finalists.is_empty() {
            let order = self.order(&base, &finalists);
            let beam: Vec<Tried> = order
                .iter()
                .map(|&index| &finalists[index])
                .filter(|parent| self.share_left(parent, &base) < HOPELESS)
                .map(|parent| &parent.tried)
                .filter(|tried| matches!(tried.suspects[..], [Suspect::Effect { .. }]))
                .take(BEAM)
                .cloned()
                .collect();
            let mut pairs = Vec::new();
            for parent in &beam {
                let Some(parent) = self.on_track(&track, parent)? else {
                    continue;
                };
                let rest: Vec<Suspect> = all
                    .iter()
                    .filter(|suspect| {
                        !parent.suspects.contains(suspect)
                            && matches!(suspect, Suspect::Effect { .. })
                    })
                    .cloned()
                    .collect();
                pairs.extend(self.round(&track, &parent, &rest, "two effects")?);
            }
            finalists.extend(pairs);
            chosen = self.best_of_sizes(&base, &finalists);
        }
        let probabilities = self.probabilities(&base, &finalists, chosen);
        Ok(Some(Found {
            base,
            finalists,
            chosen,
            probabilities,
        }))
    }

    /// How many rows one may stand for in a race: the plant hardly moves between them.
    fn thinning(&self, pace: f64) -> usize {
        let most = if pace > 0.0 {
            (THIN_RATE / pace) as usize
        } else {
            1
        };
        (self.fit.rows() / RACE_WORK).min(most).max(1)
    }

    /// The final's values, taken back to the track.
    fn on_track(&self, track: &Track, tried: &Tried) -> Result<Option<Tried>> {
        let mut segments = track.data.segments(&tried.model.plant, &track.stretches)?;
        let states = track.data.starts(
            &tried.model.rig,
            &tried.model.plant,
            &segments,
            &tried.point.values,
        )?;
        let from = Unknowns {
            values: tried.point.values.clone(),
            states,
        };
        let point = tried
            .model
            .improve(track.data, &mut segments, from, 6, 1e-4);
        Ok(point.map(|point| Tried {
            point,
            ..tried.clone()
        }))
    }

    /// One race and its final.
    fn round(
        &self,
        track: &Track,
        parent: &Tried,
        all: &[Suspect],
        what: &str,
    ) -> Result<Vec<Contender>> {
        use rayon::prelude::*;
        let done = AtomicUsize::new(0);
        let tried = track.race(parent, all, &|| {
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            (self.told)(what, done, all.len());
        })?;
        let finals: Vec<Option<Contender>> = tried
            .par_iter()
            .take(FINALISTS)
            .map(|tried| self.contender(tried, FINAL_STEPS).ok().flatten())
            .collect();
        Ok(finals.into_iter().flatten().collect())
    }
}

/// Rows of a final: what a whole simulation may cost.
pub(super) fn final_budget(plant: &sinew_sim::Plant, values: &[f64], data: &Data) -> usize {
    (FINAL_WORK / substeps(pace(plant, values, data))).max(2000)
}

/// Sub-steps that the integrator takes for a row, about (docs/plant.md, eq. 19).
fn substeps(pace: f64) -> usize {
    ((pace / 0.1).ceil() as usize).next_power_of_two().max(1)
}

/// The plant's fastest rate at rest times the usual interval of the recordings.
fn pace(plant: &sinew_sim::Plant, values: &[f64], data: &Data) -> f64 {
    let rest = vec![0.0; plant.state_len()];
    let rate =
        sinew_sim::Stepper::new(plant, values, &rest).map_or(0.0, |stepper| stepper.report().rate);
    let interval = data.experiments.first().map_or(0.0, |experiment| {
        let t = &experiment.t;
        (t[t.len() - 1] - t[0]) / (t.len() - 1).max(1) as f64
    });
    rate * interval
}
