//! The search for what is missing: races, finals, pairs (docs/diagnosis.md).

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use sinew_sim::{Plant, Rig, Settings};

use super::data::Data;
use super::evidence::Contender;
use super::race::{Track, Tried};
use super::suspect::{Suspect, suspects};
use crate::error::Result;
use crate::fit::levenberg::Unknowns;
use crate::fit::pace::{pace, settings, substeps};

/// How many of a race are fitted to everything.
const FINALISTS: usize = 4;

/// How many explanations a second effect is looked for on top of.
const BEAM: usize = 2;

/// What leaves more than this part of the squares is no half of a pair.
const HOPELESS: f64 = 0.9;

/// Nor what leaves this many times as much as another does; and this many times once a pair explains all.
const BEHIND: f64 = 8.0;
const CLOSE: f64 = 2.0;

/// How often the first of a pair is exchanged: alone, it had to explain what the second does as well.
const EXCHANGES: usize = 2;

/// How many pairs are taken apart, to see whether one effect does it after all.
const HALVED: usize = 3;

/// Sub-steps of the integrator that one simulation of a race takes, about; and one of a final.
const RACE_WORK: usize = 2500;
const FINAL_WORK: usize = 8000;

/// Longest sub-step of a race, in units of one over the fastest rate: three times a simulation's. An undamped
/// mode is off by a ten-thousandth of its phase then, alike in all who race.
const RACE_STEP: f64 = 0.3;

/// The same of a final, and of everything that is judged.
const FINAL_STEP: f64 = 0.2;

/// Thinned recordings are still at least this dense, in steps per unit of the fastest rate.
const THIN_RATE: f64 = 0.1;

/// Stretches that a race is cut into.
const RACE_PARTS: usize = 8;

/// Steps of a final fit.
pub(super) const FINAL_STEPS: usize = 12;

/// Recordings and how they are cut for judging.
pub(super) struct Bench<'a> {
    pub written: &'a Rig,
    pub fit: &'a Data,
    pub check: &'a Data,
    /// The recordings of both.
    pub both: &'a Data,
    /// Recordings are judged in stretches with start states of their own: something integrates.
    pub in_parts: bool,
    /// How finals are integrated.
    pub settings: Settings,
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
    /// The whole search.
    pub fn search(&self, rig: &Rig, values: &[f64]) -> Result<Option<Found>> {
        let plant = Plant::new(rig)?;
        let pace = pace(&plant, values, &self.fit.experiments);
        let thin = self.thinning(pace);
        let thinned;
        let data = if thin > 1 {
            thinned = self.fit.thinned(rig, &plant, thin);
            &thinned
        } else {
            self.fit
        };
        let settings = settings(&plant, values, &data.experiments, RACE_STEP);
        let budget = RACE_WORK / substeps(pace * thin as f64, RACE_STEP);
        let mut track = Track {
            written: self.written,
            data,
            stretches: data.select(RACE_PARTS, budget.max(1000)),
            settings,
        };
        let Some(start) = track.first(rig, values, 15)? else {
            return Ok(None);
        };
        // The believed rig may have run along the bound, and nothing may be added to it there.
        track.settings.max_substeps *= 2;
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
            let pairs = self.pairs(&track, &start, &base, &finalists, &all)?;
            let halves = self.halves(&track, &start, &base, &pairs)?;
            finalists.extend(pairs);
            finalists.extend(halves);
            finalists = once(finalists);
            chosen = self.best_of_sizes(&base, &finalists);
        }
        let chosen = chosen.map(|chosen| self.simplest(chosen, &finalists));
        let probabilities = self.probabilities(&base, &finalists, chosen);
        Ok(Some(Found {
            base,
            finalists,
            chosen,
            probabilities,
        }))
    }

    /// A second effect on top of the best single ones. Once something leaves no more than noise, only what came
    /// close to the best is tried as well. Then the best pair's newcomer is kept and its parent exchanged: once in
    /// any case, for something simpler may do beside it, and again as long as nothing explains all.
    fn pairs(
        &self,
        track: &Track,
        start: &Tried,
        base: &Contender,
        singles: &[Contender],
        all: &[Suspect],
    ) -> Result<Vec<Contender>> {
        let left = |index: usize| self.share_left(&singles[index], base);
        let order = self.order(base, singles);
        let least = order.iter().map(|&index| left(index)).fold(1.0, f64::min);
        let effects = |tried: &Tried| matches!(tried.suspects[..], [Suspect::Effect { .. }]);
        let beam = order
            .into_iter()
            .filter(|&index| left(index) < HOPELESS.min(BEHIND * least))
            .filter(|&index| effects(&singles[index].tried))
            .take(BEAM);
        let mut pairs: Vec<Contender> = Vec::new();
        let mut parents: Vec<Suspect> = Vec::new();
        for index in beam {
            let done = pairs.iter().any(|pair| !self.leaves_something(pair));
            if done && left(index) > CLOSE * least {
                continue;
            }
            if let Some(parent) = self.on_track(track, &singles[index].tried)? {
                parents.extend(parent.suspects.clone());
                pairs.extend(self.seconds(track, &parent, all)?);
            }
        }
        for exchange in 0..EXCHANGES {
            if exchange > 0 && pairs.iter().any(|pair| !self.leaves_something(pair)) {
                break;
            }
            let Some(&best) = self.order(base, &pairs).first() else {
                break;
            };
            let pair = &pairs[best].tried;
            let fresh = |suspect: &&Suspect| !parents.contains(suspect);
            let Some(kept) = pair.suspects.iter().find(fresh).cloned() else {
                break;
            };
            parents.push(kept.clone());
            if let Some(parent) = track.alone(start, pair, &kept)? {
                pairs.extend(self.seconds(track, &parent, all)?);
            }
        }
        Ok(pairs)
    }

    /// The halves of the best pairs, each from where its pair ended: where a single effect was not found because
    /// the way to it was too long, another has paved it.
    fn halves(
        &self,
        track: &Track,
        start: &Tried,
        base: &Contender,
        pairs: &[Contender],
    ) -> Result<Vec<Contender>> {
        let mut halves = Vec::new();
        for index in self.order(base, pairs).into_iter().take(HALVED) {
            let pair = &pairs[index].tried;
            for suspect in &pair.suspects {
                if let Some(half) = track.alone(start, pair, suspect)? {
                    halves.extend(self.contender(&half, FINAL_STEPS)?);
                }
            }
        }
        Ok(halves)
    }

    /// Every other effect on top of one.
    fn seconds(&self, track: &Track, parent: &Tried, all: &[Suspect]) -> Result<Vec<Contender>> {
        let second = |suspect: &&Suspect| {
            !parent.suspects.contains(suspect) && matches!(suspect, Suspect::Effect { .. })
        };
        let rest: Vec<Suspect> = all.iter().filter(second).cloned().collect();
        self.round(track, parent, &rest, "two effects")
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
        let model = tried.model.integrated(track.settings);
        let mut segments = track.data.segments(&model.plant, &track.stretches)?;
        let values = &tried.point.values;
        let states = (track.data).starts(&model.rig, &model.plant, &segments, values)?;
        let from = Unknowns {
            values: values.clone(),
            states,
        };
        let point = model.improve(track.data, &mut segments, from, 6, 1e-4);
        Ok(point.map(|point| Tried {
            model,
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

/// Of those who hold the same effects, the one that was fitted best.
fn once(finalists: Vec<Contender>) -> Vec<Contender> {
    let mut kept: Vec<Contender> = Vec::new();
    for contender in finalists {
        let same = |known: &Contender| {
            let (ours, theirs) = (&contender.tried.suspects, &known.tried.suspects);
            ours.len() == theirs.len() && ours.iter().all(|suspect| theirs.contains(suspect))
        };
        match kept.iter_mut().find(|known| same(known)) {
            Some(known) if known.tried.point.cost <= contender.tried.point.cost => {}
            Some(known) => *known = contender,
            None => kept.push(contender),
        }
    }
    kept
}

/// How finals are integrated, and how many rows one may take: what a whole simulation may cost.
pub(super) fn finals(plant: &Plant, values: &[f64], fit: &Data, both: &Data) -> (Settings, usize) {
    let pace = pace(plant, values, &fit.experiments);
    let rows = FINAL_WORK / substeps(pace, FINAL_STEP);
    let mut settings = settings(plant, values, &both.experiments, FINAL_STEP);
    // What ran along the bound of a race is judged too.
    settings.max_substeps *= 2;
    (settings, rows.max(2000))
}
