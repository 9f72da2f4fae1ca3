//! The search for what is missing: races, finals, pairs (docs/diagnosis.md).

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use sinew_sim::Rig;
use sinew_sim::effects::Family;

use super::data::Data;
use super::evidence::{Contender, Court, Gain};
use super::judge::Remains;
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

/// What is believed leaves no more than this part of the squares that the base leaves beside noise.
const MOST_LEFT: f64 = 0.4;

/// What an effect removes, in units of the noise, from where on nobody asks for a second witness.
const LARGE: f64 = 1.0;

/// Thinned recordings are still at least this dense, in steps per unit of the fastest rate.
const THIN_RATE: f64 = 0.1;

/// Stretches that a race is cut into.
const RACE_PARTS: usize = 8;

/// Steps of a final fit.
const FINAL_STEPS: usize = 7;

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
    /// Fits what a race found to all of the fit recordings and looks at what it leaves of both roles.
    pub fn contender(&self, tried: &Tried, steps: usize) -> Result<Option<Contender>> {
        let model = &tried.model;
        let mut segments = self.fit.segments(&model.plant, &self.fit_stretches)?;
        let states = self
            .fit
            .starts(&model.rig, &model.plant, &segments, &tried.point.values)?;
        let from = Unknowns {
            values: tried.point.values.clone(),
            states,
        };
        let Some(mut point) = model.improve(self.fit, &mut segments, from, steps, 1e-4) else {
            return Ok(None);
        };
        super::gauge::settle(model, &tried.suspects, &mut point);
        let fit = Remains::of(
            model,
            &point.values,
            self.fit,
            &self.fit_stretches,
            Some(&point.states),
        )?;
        let check = Remains::of(
            model,
            &point.values,
            self.check,
            &self.check_stretches,
            None,
        )?;
        Ok(match (fit, check) {
            (Some(fit), Some(check)) => Some(Contender {
                tried: Tried {
                    point,
                    ..tried.clone()
                },
                fit,
                check,
            }),
            _ => None,
        })
    }

    /// The believed rig with the benefit of the doubt: fitted to the check recordings too, so that nothing is
    /// called missing because a parameter was not known well enough.
    fn base(&self, start: &Tried) -> Result<Option<Contender>> {
        let model = &start.model;
        let mut stretches = self.fit_stretches.clone();
        let own = self.fit.experiments.len();
        let of_check = self.check_stretches.iter();
        stretches.extend(of_check.map(|(index, rows)| (own + index, rows.clone())));
        let mut segments = self.both.segments(&model.plant, &stretches)?;
        let values = &start.point.values;
        let states = self
            .both
            .starts(&model.rig, &model.plant, &segments, values)?;
        let from = Unknowns {
            values: values.clone(),
            states,
        };
        let Some(point) = model.improve(self.both, &mut segments, from, FINAL_STEPS, 1e-4) else {
            return Ok(None);
        };
        let left = |data: &Data, stretches: &[(usize, Range<usize>)]| {
            Remains::of(model, &point.values, data, stretches, None)
        };
        let fit = left(self.fit, &self.fit_stretches)?;
        let check = left(self.check, &self.check_stretches)?;
        Ok(fit.zip(check).map(|(fit, check)| Contender {
            tried: Tried {
                point,
                ..start.clone()
            },
            fit,
            check,
        }))
    }

    /// Whether an explanation leaves something that noise does not explain and that matters.
    pub fn leaves_something(&self, contender: &Contender) -> bool {
        stands_out(&contender.fit, self.fit) || stands_out(&contender.check, self.check)
    }

    /// Whether the stretches of the fit recordings are these recordings whole.
    pub fn sees_whole_recordings(&self) -> bool {
        self.fit_stretches == self.fit.cut(1)
    }

    /// Whether the rig as it came leaves nothing but noise.
    ///
    /// # Errors
    /// A rig that cannot be compiled.
    pub fn explains_as_written(&self, rig: &Rig) -> Result<bool> {
        let model = super::model::Model::new(rig, rig, &[])?;
        let values = model.plant.values();
        for (data, stretches) in [
            (self.fit, &self.fit_stretches),
            (self.check, &self.check_stretches),
        ] {
            match Remains::of(&model, &values, data, stretches, None)? {
                Some(remains) if !stands_out(&remains, data) => {}
                _ => return Ok(false),
            }
        }
        Ok(true)
    }

    /// The part of what `before` left beside noise that `after` still leaves: 0 is all explained.
    pub fn share_left(&self, after: &Contender, before: &Contender) -> f64 {
        let sum = |contender: &Contender| -> f64 {
            let of = |remains: &Remains, data: &Data| -> f64 {
                remains
                    .excess(data)
                    .iter()
                    .enumerate()
                    .map(|(s, e)| (e.rms / data.spread[s]).powi(2))
                    .sum()
            };
            of(&contender.check, self.check)
        };
        let before = sum(before);
        if before > 0.0 {
            (sum(after) / before).min(1.0)
        } else {
            0.0
        }
    }

    /// A gain that counts: sure under resampling, and large enough to matter.
    pub fn believable(&self, gain: Gain, after: &Contender, before: &Contender) -> bool {
        let matters = (0..self.check.noise.len()).any(|sensor| {
            let removed = before.check.rms(sensor).powi(2) - after.check.rms(sensor).powi(2);
            removed.max(0.0).sqrt()
                > 0.1 * self.check.noise[sensor] + 1e-3 * self.check.spread[sensor]
        });
        gain.low > 0.0 && matters
    }

    /// Whether every effect has parameters that make sense here.
    fn sane(&self, contender: &Contender) -> bool {
        let (model, values) = (&contender.tried.model, &contender.tried.point.values);
        let longest = self
            .fit
            .experiments
            .iter()
            .map(|e| e.t[e.rows() - 1] - e.t[0])
            .fold(0.0, f64::max);
        let mut all = contender.tried.suspects.iter();
        all.all(|suspect| suspect.sane(&model.plant, values, longest))
    }

    /// Whether a small gain holds the other way round too: fitted to the check recordings alone, judged by the
    /// fit recordings, against a rig that was fitted to both. Large gains need no second witness.
    fn holds_both_ways(&self, contender: &Contender, base: &Contender) -> Result<bool> {
        let sensors = 0..self.check.noise.len();
        let removed = |sensor: usize| {
            let squares = base.check.rms(sensor).powi(2) - contender.check.rms(sensor).powi(2);
            squares.max(0.0).sqrt() / self.check.sigma[sensor]
        };
        if sensors.clone().map(removed).fold(0.0, f64::max) > LARGE {
            return Ok(true);
        }
        let (model, values) = (&contender.tried.model, &contender.tried.point.values);
        let mut segments = self.check.segments(&model.plant, &self.check_stretches)?;
        let states = (self.check).starts(&model.rig, &model.plant, &segments, values)?;
        let from = Unknowns {
            values: values.clone(),
            states,
        };
        let Some(point) = model.improve(self.check, &mut segments, from, FINAL_STEPS, 1e-4) else {
            return Ok(false);
        };
        let swapped = Remains::of(model, &point.values, self.fit, &self.fit_stretches, None)?;
        Ok(swapped.is_some_and(|swapped| {
            let gains = sensors.map(|s| (base.fit.rms(s) / swapped.rms(s)).ln());
            gains.sum::<f64>() > 0.0
        }))
    }

    /// Parameters of the right sign, and most of what the base left explained: a disturbance can be followed a
    /// little by many an effect, and none of them is its name.
    fn holds(&self, contender: &Contender, base: &Contender) -> bool {
        self.sane(contender)
            && self.share_left(contender, base) < MOST_LEFT
            && !self.within_a_step(contender, base)
    }

    /// A sensor that is bent by less than half a step of its own scale is as straight as that scale.
    fn within_a_step(&self, contender: &Contender, base: &Contender) -> bool {
        let mut suspects = contender.tried.suspects.iter();
        suspects.any(|suspect| suspect.family() == Some(Family::Sensor))
            && (0..self.check.step.len()).all(|sensor| {
                let squares = base.check.rms(sensor).powi(2) - contender.check.rms(sensor).powi(2);
                squares.max(0.0).sqrt() < 0.5 * self.check.step[sensor]
            })
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
        if !done && !finalists.is_empty() {
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

    /// Indices of finalists by evidence, best first.
    fn order(&self, base: &Contender, finalists: &[Contender]) -> Vec<usize> {
        let evidence = self.court(base, finalists).evidence();
        let mut order: Vec<usize> = (0..finalists.len()).collect();
        order.sort_by(|&a, &b| evidence[b + 1].total_cmp(&evidence[a + 1]));
        order
    }

    /// The base is number 0, finalists follow.
    pub fn court(&self, base: &Contender, finalists: &[Contender]) -> Court {
        let all: Vec<Contender> = std::iter::once(base).chain(finalists).cloned().collect();
        Court::new(&all, &self.check.spread, self.seed)
    }

    /// The best finalist that is believable against the base.
    fn best(&self, base: &Contender, finalists: &[Contender]) -> Option<usize> {
        let court = self.court(base, finalists);
        self.order(base, finalists).into_iter().find(|&index| {
            self.believable(court.gain(index + 1, 0), &finalists[index], base)
                && self.holds(&finalists[index], base)
                && self
                    .holds_both_ways(&finalists[index], base)
                    .unwrap_or(false)
        })
    }

    /// As [`Bench::best`], but two effects only where they are believable against the best single one.
    fn best_of_sizes(&self, base: &Contender, finalists: &[Contender]) -> Option<usize> {
        let court = self.court(base, finalists);
        let order = self.order(base, finalists);
        let sane: Vec<usize> = order
            .into_iter()
            .filter(|&index| {
                self.holds(&finalists[index], base)
                    && self.believable(court.gain(index + 1, 0), &finalists[index], base)
            })
            .collect();
        let size = |index: usize| finalists[index].tried.suspects.len();
        let single = sane.iter().copied().find(|&index| size(index) == 1);
        let single = single.filter(|&index| {
            self.holds_both_ways(&finalists[index], base)
                .unwrap_or(false)
        });
        let mut pairs = sane.iter().copied().filter(|&index| size(index) == 2);
        let Some(single) = single else {
            return pairs.next();
        };
        let over = |pair: usize| {
            let (pair_of, single_of) = (&finalists[pair], &finalists[single]);
            self.believable(court.gain(pair + 1, single + 1), pair_of, single_of)
                && self.share_left(pair_of, single_of) < MOST_LEFT
                && self.holds_both_ways(pair_of, single_of).unwrap_or(false)
        };
        pairs.next().filter(|&pair| over(pair)).or(Some(single))
    }

    /// Shares of the evidence among what is possible here: of the right signs, and of no more effects than
    /// were found to matter.
    fn probabilities(
        &self,
        base: &Contender,
        finalists: &[Contender],
        chosen: Option<usize>,
    ) -> Vec<f64> {
        let most = chosen.map_or(2, |index| finalists[index].tried.suspects.len());
        let possible =
            |contender: &Contender| self.sane(contender) && contender.tried.suspects.len() <= most;
        let able: Vec<usize> = (0..finalists.len())
            .filter(|&index| possible(&finalists[index]))
            .collect();
        let rivals: Vec<Contender> = able.iter().map(|&index| finalists[index].clone()).collect();
        let shares = self.court(base, &rivals).probabilities().split_off(1);
        let mut all = vec![0.0; finalists.len()];
        for (index, share) in able.into_iter().zip(shares) {
            all[index] = share;
        }
        all
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

/// Whether residuals hold something that noise does not explain and that matters.
fn stands_out(remains: &Remains, data: &Data) -> bool {
    let mut sensors = remains.excess(data).into_iter().enumerate();
    sensors.any(|(sensor, e)| {
        let matters = 0.1 * data.noise[sensor] + 1e-3 * data.spread[sensor];
        e.significance > 5.0 && e.rms > matters
    })
}
