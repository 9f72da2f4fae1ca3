//! The search for what is missing: races, finals, pairs (docs/explanation/diagnosis.md).

pub(crate) mod all_rows;
pub(crate) mod family;
pub(crate) mod halving;
pub(crate) mod moves;
pub(crate) mod refit;
pub(crate) mod refocus;
pub(crate) mod screen;
pub(crate) mod start;

use std::ops::Range;

use rayon::prelude::*;
use sinew_sim::{Plant, Rig, Settings};

use crate::diagnose::candidate::{Term, terms};
use crate::diagnose::data::Data;
use crate::diagnose::evidence::Candidate;
use crate::diagnose::progress::Progress;
use crate::diagnose::search::halving::{Subset, Trial};
use crate::diagnose::search::moves::short_horizon::Short;
use crate::error::Result;
use crate::fit::pace::{dearness, pace, settings, substeps};

/// How many of a race are fitted to everything.
const FINALISTS: usize = 4;

/// Sub-steps of the integrator that one simulation of a race takes, about; and one of a final.
const RACE_WORK: usize = 2500;
const FINAL_WORK: usize = 8000;

// Of a dear rig (`fit/pace.rs`) sub-steps are longer and the fewest rows are fewer.

/// Longest sub-step of a race, in units of one over the fastest rate: three times a simulation's. An undamped
/// mode is off by a ten-thousandth of its phase then, alike in all who race.
const RACE_STEP: f64 = 0.3;

/// The same of a final, and of everything that is judged.
const FINAL_STEP: f64 = 0.2;

/// Thinned recordings are still at least this dense, in steps per unit of the fastest rate.
const THIN_RATE: f64 = 0.1;

/// Stretches that a race is cut into, and the fewest rows that it is run on.
const RACE_PARTS: usize = 8;
const RACE_ROWS: usize = 1000;

/// The fewest rows of a final.
const FINAL_ROWS: usize = 2000;

/// How often rivals are fitted once more from where the best one ended, while that makes another one the best.
const VALLEYS: usize = 3;

/// Steps of a final fit.
pub(crate) const FINAL_STEPS: usize = 12;

/// Recordings and how they are cut for judging.
pub(crate) struct Case<'a> {
    pub written: &'a Rig,
    pub fit: &'a Data,
    pub check: &'a Data,
    /// The recordings of both.
    pub both: &'a Data,
    /// Recordings are judged in stretches with start states of their own: something integrates.
    pub in_parts: bool,
    /// How finals are integrated.
    pub settings: Settings,
    pub fit_intervals: Vec<(usize, Range<usize>)>,
    pub check_intervals: Vec<(usize, Range<usize>)>,
    pub seed: u64,
    /// Less than 1 where recordings are too short to be checked by others.
    pub trust: f64,
    pub progress: &'a (dyn Fn(&str, usize, usize) + Sync),
}

/// What the search found: contenders, best first; the believed rig itself is `base`.
pub(crate) struct Found {
    pub base: Candidate,
    pub finalists: Vec<Candidate>,
    /// Index into `finalists` of what is believed.
    pub chosen: Option<usize>,
    /// What was believed on the way: the chosen one's effects in the order in which they were found.
    pub probabilities: Vec<f64>,
    /// The refit of the rig alone had stopped short of what `base` is now: its refit begins again from there.
    pub stopped_short: bool,
    /// Finalists that win in stretches and have no size or lose free runs over whole recordings, and those that build on them.
    pub refuted: Vec<Candidate>,
}

/// What is tried where the race from the refitted rig explains nothing, or only with a rig that is bent out of shape.
#[derive(Clone, Copy)]
enum Attempt {
    /// From what the owner wrote: without the effect parameters were bent to make up for it, and the way back may be
    /// too long.
    AsWritten,
    /// On short stretches first.
    Short,
}

impl Case<'_> {
    /// The whole search.
    pub fn search(&self, rig: &Rig, values: &[f64]) -> Result<Option<Found>> {
        let plant = Plant::new(rig)?;
        let pace = pace(&plant, values, &self.fit.experiments);
        let dear = dearness(&plant);
        let thin = self.thinning(pace);
        let thinned;
        let data = if thin > 1 {
            thinned = self.fit.thinned(rig, &plant, thin);
            &thinned
        } else {
            self.fit
        };
        let step = RACE_STEP * dear;
        let settings = settings(&plant, values, &data.experiments, step);
        let budget = RACE_WORK / substeps(pace * thin as f64, step);
        let mut subset = Subset {
            written: self.written,
            data,
            intervals: data.select(RACE_PARTS, budget.max(race_rows(&plant))),
            settings,
        };
        let Some(mut start) = subset.first(rig, values, 15)? else {
            return Ok(None);
        };
        // The believed rig may have run along the bound, and nothing may be added to it there.
        subset.settings.max_substeps *= 2;
        let Some(mut base) = self.base(&start)? else {
            return Ok(None);
        };
        // What shorter stretches made of the rig may lie in a valley in which the refit to whole recordings does not.
        let refitted = plant.values();
        if refitted != values
            && self.leaves_something(&base)
            && let Some(again) = self.base_from(&start, &refitted)?
            && !self.leaves_something(&again)
        {
            base = again;
        }
        if !self.leaves_something(&base) {
            return Ok(Some(Found {
                base,
                finalists: Vec::new(),
                chosen: None,
                probabilities: Vec::new(),
                stopped_short: false,
                refuted: Vec::new(),
            }));
        }
        if let Some(own) = subset.elsewhere(&start)?
            && let Some(moved) = own.first(rig, values, 15)?
        {
            (subset, start) = (own, moved);
        }
        let all = terms(rig, &plant, sinew_sim::effects::Kind::ALL);
        let mut finalists = self.round(&subset, &start, &all, "one effect")?;
        let best = |all: &[Candidate]| self.best(&base, all);
        let mut chosen = self.choose(&mut finalists, best)?;
        let explained = |chosen: Option<usize>, finalists: &[Candidate]| {
            chosen.is_some_and(|index| !self.leaves_something(&finalists[index]))
        };
        let straight = |chosen: Option<usize>, finalists: &[Candidate]| {
            chosen.is_some_and(|index| !finalists[index].trial.implausible())
        };
        let mut short = Short::default();
        for attempt in [Attempt::AsWritten, Attempt::Short] {
            if explained(chosen, &finalists) && straight(chosen, &finalists) {
                break;
            }
            match attempt {
                Attempt::AsWritten => {
                    if let Some(written) = subset.as_written(rig)? {
                        finalists.extend(self.round(&subset, &written, &all, "one effect")?);
                    }
                }
                Attempt::Short => {
                    let (found, best) = self.climb(&subset, rig, &all)?;
                    finalists.extend(found);
                    short = best;
                }
            }
            finalists = crate::diagnose::search::moves::pair::once(finalists);
            chosen = self.choose(&mut finalists, best)?;
        }
        let done = explained(chosen, &finalists);
        let best_of_sizes = |all: &[Candidate]| self.best_of_sizes(&base, all);
        // A second effect in a few dozen rows is whatever the first one got wrong.
        let enough = self.fit.rows().min(self.check.rows()) >= crate::diagnose::split::SHORTEST;
        let second = !done && enough && !finalists.is_empty();
        let short = if second {
            let order = self.order(&base, &finalists);
            let leader = order.first().map(|&index| &finalists[index].trial.terms);
            self.climb_twice(&subset, &short, leader.and_then(|one| one.first()), &all)?
        } else {
            None
        };
        if let Some(short) = short {
            let pairs = self.pairs(&subset, &start, &base, &finalists, short, &all)?;
            let halves = self.halves(&subset, &start, &base, &pairs)?;
            finalists.extend(pairs);
            finalists.extend(halves);
            finalists = crate::diagnose::search::moves::pair::once(finalists);
            chosen = self.choose(&mut finalists, best_of_sizes)?;
        }
        // A pair that is not believed may be right in one half: the best that explains all, or the best. In a few dozen
        // rows one neighbour is as good as another: they would only share what is believed.
        let near_miss = || {
            let mut pairs = self.order(&base, &finalists);
            pairs.retain(|&index| finalists[index].trial.terms.len() == 2);
            let explains = |index: &usize| !self.leaves_something(&finalists[*index]);
            let best = pairs.first().copied();
            pairs.into_iter().find(explains).or(best)
        };
        if let Some(index) = chosen.or_else(near_miss).filter(|_| enough) {
            let best = &finalists[index].trial;
            let near = self.neighbours(&subset, &start, best, &finalists, &all)?;
            finalists.extend(near);
            finalists = crate::diagnose::search::moves::pair::once(finalists);
            chosen = self.choose(&mut finalists, best_of_sizes)?;
        }
        // A fit ends in the nearest valley: rivals begin where the best one ended, and so does the rig without any effect.
        for _ in 0..VALLEYS {
            let Some(index) = chosen.filter(|_| enough) else {
                break;
            };
            let begun = finalists[index].trial.terms.clone();
            let again = self.rivals_from(&finalists[index], &base, &finalists)?;
            finalists.extend(again);
            finalists = crate::diagnose::search::moves::pair::once(finalists);
            chosen = self.choose(&mut finalists, best_of_sizes)?;
            if chosen.is_some_and(|index| finalists[index].trial.terms == begun) {
                break;
            }
        }
        let best = chosen.or_else(|| self.order(&base, &finalists).first().copied());
        let alone = match best {
            Some(index) => self.alone_from(&start, &finalists[index].trial, &base)?,
            None => None,
        };
        let stopped_short = alone.is_some();
        if let Some(alone) = alone {
            chosen = if self.leaves_something(&alone) {
                self.choose(&mut finalists, |all| self.best_of_sizes(&alone, all))?
            } else {
                finalists.clear();
                None
            };
            base = alone;
        }
        let chosen = chosen.map(|chosen| self.simplest(&base, chosen, &finalists));
        let probabilities = self.probabilities(&base, &finalists, chosen);
        Ok(Some(Found {
            base,
            finalists,
            chosen,
            probabilities,
            stopped_short,
            refuted: Vec::new(),
        }))
    }

    /// The track of a second effect: as many sub-steps as that of the first, counted in what the parent takes, so
    /// fewer rows where it takes many for each.
    pub fn affordable<'a>(&self, subset: &Subset<'a>, parent: &Trial) -> Result<Subset<'a>> {
        let data = subset.data;
        let (mut rows, mut taken) = (0, 0);
        for ((index, range), start) in subset.intervals.iter().zip(&parent.point.states) {
            let experiment = &data.experiments[*index];
            let drive = experiment.drive(&parent.model.plant, range.clone())?;
            let times = &experiment.t[range.clone()];
            let plant = &parent.model.plant;
            // What was fitted to the track can be simulated there.
            if let Ok(run) = plant.simulate(&parent.point.values, start, &drive, times) {
                rows += times.len();
                taken += run.report.substeps;
            }
        }
        let budget = (RACE_WORK * rows / taken.max(1)).max(race_rows(&parent.model.plant));
        let rows: usize = subset.intervals.iter().map(|(_, rows)| rows.len()).sum();
        Ok(subset.on(if budget < rows {
            data.select(RACE_PARTS, budget)
        } else {
            subset.intervals.clone()
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

    /// One race and its final.
    pub fn round(
        &self,
        subset: &Subset,
        parent: &Trial,
        all: &[Term],
        what: &str,
    ) -> Result<Vec<Candidate>> {
        let trial = self.raced(subset, parent, all, what)?;
        self.finals(subset, &trial, what)
    }

    /// One race, its progress told.
    pub fn raced(
        &self,
        subset: &Subset,
        parent: &Trial,
        all: &[Term],
        what: &str,
    ) -> Result<Vec<Trial>> {
        subset.race(parent, all, self.doing(what))
    }

    /// A part of the search by its name, for who hears of its progress.
    pub fn doing<'s>(&'s self, what: &'s str) -> Progress<'s> {
        let callback = self.progress;
        Progress { callback, what }
    }

    /// The best of a race, fitted to everything.
    pub fn finals(&self, subset: &Subset, trial: &[Trial], what: &str) -> Result<Vec<Candidate>> {
        let count = self
            .doing(what)
            .count("fitted to everything", trial.len().min(FINALISTS));
        let finals: Vec<Option<Candidate>> = trial
            .par_iter()
            .take(FINALISTS)
            .map(|trial| {
                let candidate = self.candidate(subset, trial, FINAL_STEPS).ok().flatten();
                count.one();
                candidate
            })
            .collect();
        let finals: Vec<Candidate> = finals.into_iter().flatten().collect();
        Ok(finals)
    }
}

/// The fewest rows of a race.
fn race_rows(plant: &Plant) -> usize {
    (RACE_ROWS as f64 / dearness(plant)) as usize
}

/// How finals are integrated, and how many rows one may take: what a whole simulation may cost.
pub(crate) fn finals(plant: &Plant, values: &[f64], fit: &Data, both: &Data) -> (Settings, usize) {
    let pace = pace(plant, values, &fit.experiments);
    let dear = dearness(plant);
    let step = FINAL_STEP * dear;
    let rows = FINAL_WORK / substeps(pace, step);
    let mut settings = settings(plant, values, &both.experiments, step);
    // What ran along the bound of a race is judged too.
    settings.max_substeps *= 2;
    (settings, rows.max((FINAL_ROWS as f64 / dear) as usize))
}
