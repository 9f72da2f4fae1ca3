//! The race: every suspect refitted inside the simulator, on part of the data, a few steps from several starts.

use rayon::prelude::*;
use sinew_sim::{Plant, Rig, Settings};

use crate::diagnose::candidate::Term;
use crate::diagnose::data::Data;
use crate::diagnose::model::{Model, Point};
use crate::diagnose::progress::Progress;
use crate::diagnose::search::screen::Screen;
use crate::diagnose::search::start::{Start, promising};
use crate::error::Result;
use crate::fit::levenberg::{Stop, Unknowns};
use crate::scales::Run;

/// A rig with some suspects in it, as far as it was fitted.
#[derive(Clone)]
pub(crate) struct Trial {
    /// What was added to the believed rig; empty for that rig itself.
    pub terms: Vec<Term>,
    pub model: Model,
    pub point: Point,
}

/// A parameter of the rig this many times as large or as small as its owner wrote has changed its meaning.
const BENT: f64 = 5.0;

/// Whether a parameter is that far from what its owner wrote.
pub(crate) fn implausible(value: f64, written: f64) -> bool {
    written != 0.0 && !(1.0 / BENT..=BENT).contains(&(value / written))
}

impl Trial {
    /// Some parameter of the rig itself is far from what its owner wrote.
    pub fn implausible(&self) -> bool {
        let mut own = self.model.own();
        own.any(|(slot, written)| implausible(self.point.values[slot], written))
    }
}

/// Steps of those that are refitted, and of the best of them further.
const FIRST_STEPS: usize = 6;
pub(crate) const MORE_STEPS: usize = 8;

/// How many of them go further.
pub(crate) const HEAT: usize = 8;

/// How many are refitted before asking whether the mismatch is explained already.
const AT_ONCE: usize = 8;

/// Explained: no more than this part of the noise, and of what there was, is left beside the noise.
const EXPLAINED: f64 = 0.1;

/// Part of the data that is small enough to try everything on, cut into stretches.
pub(crate) struct Subset<'a> {
    pub written: &'a Rig,
    pub data: &'a Data,
    pub intervals: Vec<(usize, std::ops::Range<usize>)>,
    /// How trials are integrated: coarsely, and not at all where they would be too dear.
    pub settings: Settings,
}

impl<'a> Subset<'a> {
    /// Other stretches of the same recordings.
    pub fn on(&self, intervals: Vec<(usize, std::ops::Range<usize>)>) -> Subset<'a> {
        Subset {
            written: self.written,
            data: self.data,
            intervals,
            settings: self.settings,
        }
    }
}

impl Subset<'_> {
    /// A rig fitted to the track, from values that are known to be near.
    ///
    /// # Errors
    /// A rig that cannot be compiled.
    pub fn first(&self, rig: &Rig, values: &[f64], steps: usize) -> Result<Option<Trial>> {
        let model = Model::new(rig, self.written, &[], self.settings)?;
        let mut segments = self.data.segments(&model.plant, &self.intervals)?;
        let states = self.data.starts(rig, &model.plant, &segments, values)?;
        let from = Unknowns {
            values: values.to_vec(),
            states,
        };
        let from = model.begun(self.data, &mut segments, from);
        let point = model.improve(self.data, &mut segments, from, steps, 1e-5);
        Ok(point.map(|point| Trial {
            terms: Vec::new(),
            model,
            point,
        }))
    }

    /// The rig with what its owner wrote, only start states fitted. `None` where it cannot be simulated.
    ///
    /// # Errors
    /// A rig that cannot be compiled.
    pub fn as_written(&self, rig: &Rig) -> Result<Option<Trial>> {
        let model = Model::new(rig, self.written, &[], self.settings)?;
        let written = Plant::new(self.written)?;
        let values = model.inherit(&written, &written.values());
        let mut segments = self.data.segments(&model.plant, &self.intervals)?;
        let states = self.data.starts(rig, &model.plant, &segments, &values)?;
        let from = model.begun(self.data, &mut segments, Unknowns { values, states });
        let point = model.improve(self.data, &mut segments, from, 0, 1e-3);
        Ok(point.map(|point| Trial {
            terms: Vec::new(),
            model,
            point,
        }))
    }

    /// Every suspect on top of `parent`, best first; what cannot be simulated is left out.
    pub fn race(&self, parent: &Trial, terms: &[Term], progress: Progress) -> Result<Vec<Trial>> {
        let run = self.run(parent)?;
        let Some(screen) = Screen::new(self, parent)? else {
            return Ok(Vec::new());
        };
        let count = progress.count("looked at", terms.len());
        let looked: Vec<Vec<Start>> = terms
            .par_iter()
            .map(|term| {
                let look = self.look(parent, &run, &screen, term);
                count.one();
                look.unwrap_or_default()
            })
            .collect();
        let mut first = promising(looked);
        let rest = first.split_off(AT_ONCE.min(first.len()));
        let mut trial = self.refitted(first, progress);
        if !self.explained(parent, &trial) {
            trial.extend(self.refitted(rest, progress));
        }
        self.thin_out(parent, &mut trial);
        let count = progress.count("fitted further", trial.len());
        let mut further: Vec<Trial> = trial
            .into_par_iter()
            .map(|trial| {
                let further = self.further(trial);
                count.one();
                further
            })
            .collect();
        if !self.explained(parent, &further) {
            let count = progress.count("fitted afresh", further.len());
            further = further
                .into_par_iter()
                .map(|trial| {
                    let afresh = self.afresh(trial);
                    count.one();
                    afresh
                })
                .collect();
        }
        let kin = self.kin(parent, &further, terms)?;
        let again = self.refitted(kin, progress).into_par_iter();
        let again: Vec<Trial> = again.map(|trial| self.further(trial)).collect();
        further.extend(again);
        let mut kept: Vec<Trial> = Vec::new();
        further.sort_by(|a, b| merit(a).total_cmp(&merit(b)));
        for trial in further {
            if !kept.iter().any(|kept| kept.terms == trial.terms) {
                kept.push(trial);
            }
        }
        self.thin_out(parent, &mut kept);
        Ok(kept)
    }

    /// The better end of each suspect's starts after a few steps.
    fn refitted(&self, begun: Vec<Vec<Start>>, progress: Progress) -> Vec<Trial> {
        let count = progress.count("fitted", begun.len());
        begun
            .into_par_iter()
            .filter_map(|starts| {
                let ends = (self.as_one(starts).into_iter())
                    .filter_map(|b| self.improved(b.terms, b.model, b.from, FIRST_STEPS));
                let best = ends.min_by(|a, b| a.point.cost.total_cmp(&b.point.cost));
                count.one();
                best
            })
            .collect()
    }

    /// What is suspected of components that are alike as one, a few steps from each start, and the best end of them: a dozen
    /// numbers that nobody knows yet would each follow what the others miss (docs/lab/0066-tied-start-of-identical-components.md).
    /// Other starts as they are.
    pub fn as_one(&self, starts: Vec<Start>) -> Vec<Start> {
        let newest = starts.first().and_then(|begun| begun.terms.last());
        let alike = newest.map(Term::alike).unwrap_or_default();
        if alike.is_empty() {
            return starts;
        }
        let ends = starts.into_iter().filter_map(|begun| {
            let model = begun.model.clone().tied(&alike);
            let mut segments = self.data.segments(&model.plant, &self.intervals).ok()?;
            let from = begun.from.clone();
            let point = model.improve(self.data, &mut segments, from, FIRST_STEPS, 1e-3)?;
            let from = Unknowns {
                values: point.values,
                states: point.states,
            };
            Some((point.cost, Start { from, ..begun }))
        });
        let best = ends.min_by(|(a, _), (b, _)| a.total_cmp(b));
        best.map(|(_, begun)| begun).into_iter().collect()
    }

    /// Whether the best of them leaves noise and little else: then those that are far behind are spared.
    fn explained(&self, parent: &Trial, trial: &[Trial]) -> bool {
        let noise = 0.5 * self.samples();
        let left = trial
            .iter()
            .map(|trial| trial.point.cost - noise)
            .fold(f64::INFINITY, f64::min);
        left < EXPLAINED * noise && left < EXPLAINED * (parent.point.cost - noise)
    }

    /// The best first, the hopeless left out.
    fn thin_out(&self, parent: &Trial, trial: &mut Vec<Trial>) {
        trial.sort_by(|a, b| merit(a).total_cmp(&merit(b)));
        trial.truncate(HEAT);
        if self.explained(parent, trial) {
            let best = trial[0].point.cost;
            trial.retain(|trial| trial.point.cost <= 0.5 * (parent.point.cost + best));
        }
    }

    /// Valid samples of all sensors.
    pub fn samples(&self) -> f64 {
        self.data.samples(&self.intervals)
    }

    /// A fitted rig run over the stretches that it was fitted to, for the sizes of things.
    pub fn run<'a>(&self, trial: &'a Trial) -> Result<Run<'a>> {
        let (model, point) = (&trial.model, &trial.point);
        let inputs = self.data.experiments.iter().map(|e| e.inputs.as_slice());
        let inputs: Vec<&[Vec<f64>]> = inputs.collect();
        let mut run = Run::new(&model.rig, &model.plant, &point.values, &inputs);
        for ((index, rows), start) in self.intervals.iter().zip(&point.states) {
            let experiment = &self.data.experiments[*index];
            let drive = experiment.drive(&model.plant, rows.clone())?;
            run.take(start, &drive, &experiment.t[rows.clone()])?;
        }
        Ok(run)
    }

    pub fn improved(
        &self,
        terms: Vec<Term>,
        model: Model,
        from: Unknowns,
        steps: usize,
    ) -> Option<Trial> {
        let mut segments = self.data.segments(&model.plant, &self.intervals).ok()?;
        let point = model.improve(self.data, &mut segments, from, steps, 1e-3)?;
        Some(Trial {
            terms,
            model,
            point,
        })
    }

    /// More steps from where it stands.
    fn further(&self, trial: Trial) -> Trial {
        if trial.point.stop == Stop::Converged {
            return trial;
        }
        let Ok(mut segments) = self.data.segments(&trial.model.plant, &self.intervals) else {
            return trial;
        };
        let from = Unknowns {
            values: trial.point.values.clone(),
            states: trial.point.states.clone(),
        };
        match trial
            .model
            .improve(self.data, &mut segments, from, MORE_STEPS, 1e-3)
        {
            Some(point) if point.cost < trial.point.cost => Trial { point, ..trial },
            _ => trial,
        }
    }

    /// From what the rig says of itself instead: without the effect its parameters were bent to make up for it,
    /// and the way back may be longer than the way from the beginning.
    fn afresh(&self, trial: Trial) -> Trial {
        let model = &trial.model;
        let mut values = trial.point.values.clone();
        for (slot, written) in model.own() {
            values[slot] = written;
        }
        let from = self.data.segments(&model.plant, &self.intervals);
        let from = from.and_then(|mut segments| {
            let states = (self.data).starts(&model.rig, &model.plant, &segments, &values)?;
            Ok(model.begun(self.data, &mut segments, Unknowns { values, states }))
        });
        let again = from.ok().and_then(|from| {
            let steps = FIRST_STEPS + MORE_STEPS;
            self.improved(trial.terms.clone(), model.clone(), from, steps)
        });
        match again {
            Some(again) if again.point.cost < trial.point.cost => again,
            _ => trial,
        }
    }

    /// One of a pair without the other, some steps on from where the pair ended; `base` is the rig without either.
    pub fn alone(
        &self,
        base: &Trial,
        pair: &Trial,
        kept: &Term,
        steps: usize,
    ) -> Result<Option<Trial>> {
        if kept.effect().is_none() {
            return Ok(None);
        }
        let plant = &pair.model.plant;
        let names = kept.parameters();
        let found = names.iter().map(|name| {
            let slot = plant.slot(name);
            slot.map_or(0.0, |slot| pair.point.values[slot])
        });
        // A force of the wrong sign is no effect that a rig can hold.
        let Ok(rig) = kept.apply(&base.model.rig, &found.collect::<Vec<_>>()) else {
            return Ok(None);
        };
        let terms = vec![kept.clone()];
        let model = Model::new(&rig, self.written, &terms, self.settings)?;
        let values = model.inherit(plant, &pair.point.values);
        let segments = self.data.segments(&model.plant, &self.intervals)?;
        let states = (self.data).starts(&rig, &model.plant, &segments, &values)?;
        let from = Unknowns { values, states };
        Ok(self.improved(terms, model, from, steps))
    }
}

/// What a parameter has to gain, in units of the noise squared: half the logarithm of some thousand samples.
const FINE: f64 = 3.5;

/// Cost with a fine for every parameter: what the race is decided by.
pub(crate) fn merit(trial: &Trial) -> f64 {
    trial.point.cost + FINE * trial.model.slots.len() as f64
}
