//! The race: every suspect refitted inside the simulator, on part of the data, a few steps from several starts.

use rayon::prelude::*;
use sinew_sim::{Plant, Rig, Settings};

use super::begin::{Begun, promising};
use super::data::Data;
use super::model::{Model, Point};
use super::screen::Screen;
use super::suspect::Suspect;
use super::told::Told;
use crate::error::Result;
use crate::fit::levenberg::{Stop, Unknowns};
use crate::scales::Run;

/// A rig with some suspects in it, as far as it was fitted.
#[derive(Clone)]
pub(super) struct Tried {
    /// What was added to the believed rig; empty for that rig itself.
    pub suspects: Vec<Suspect>,
    pub model: Model,
    pub point: Point,
}

/// A parameter of the rig this many times as large or as small as its owner wrote has changed its meaning.
const BENT: f64 = 5.0;

/// Whether a parameter is that far from what its owner wrote.
pub(super) fn bent(value: f64, written: f64) -> bool {
    written != 0.0 && !(1.0 / BENT..=BENT).contains(&(value / written))
}

impl Tried {
    /// Some parameter of the rig itself is far from what its owner wrote.
    pub fn bent(&self) -> bool {
        let mut believed = self.model.believed();
        believed.any(|(slot, written)| bent(self.point.values[slot], written))
    }
}

/// Steps of those that are refitted, and of the best of them further.
const FIRST_STEPS: usize = 6;
pub(super) const MORE_STEPS: usize = 8;

/// How many of them go further.
pub(super) const HEAT: usize = 8;

/// How many are refitted before asking whether the mismatch is explained already.
const AT_ONCE: usize = 8;

/// Explained: no more than this part of the noise, and of what there was, is left beside the noise.
const EXPLAINED: f64 = 0.1;

/// Part of the data that is small enough to try everything on, cut into stretches.
pub(super) struct Track<'a> {
    pub written: &'a Rig,
    pub data: &'a Data,
    pub stretches: Vec<(usize, std::ops::Range<usize>)>,
    /// How trials are integrated: coarsely, and not at all where they would be too dear.
    pub settings: Settings,
}

impl<'a> Track<'a> {
    /// Other stretches of the same recordings.
    pub fn on(&self, stretches: Vec<(usize, std::ops::Range<usize>)>) -> Track<'a> {
        Track {
            written: self.written,
            data: self.data,
            stretches,
            settings: self.settings,
        }
    }
}

impl Track<'_> {
    /// A rig fitted to the track, from values that are known to be near.
    ///
    /// # Errors
    /// A rig that cannot be compiled.
    pub fn first(&self, rig: &Rig, values: &[f64], steps: usize) -> Result<Option<Tried>> {
        let model = Model::new(rig, self.written, &[], self.settings)?;
        let mut segments = self.data.segments(&model.plant, &self.stretches)?;
        let states = self.data.starts(rig, &model.plant, &segments, values)?;
        let from = Unknowns {
            values: values.to_vec(),
            states,
        };
        let from = model.begun(self.data, &mut segments, from);
        let point = model.improve(self.data, &mut segments, from, steps, 1e-5);
        Ok(point.map(|point| Tried {
            suspects: Vec::new(),
            model,
            point,
        }))
    }

    /// The rig with what its owner wrote, only start states fitted. `None` where it cannot be simulated.
    ///
    /// # Errors
    /// A rig that cannot be compiled.
    pub fn as_written(&self, rig: &Rig) -> Result<Option<Tried>> {
        let model = Model::new(rig, self.written, &[], self.settings)?;
        let written = Plant::new(self.written)?;
        let values = model.inherit(&written, &written.values());
        let mut segments = self.data.segments(&model.plant, &self.stretches)?;
        let states = self.data.starts(rig, &model.plant, &segments, &values)?;
        let from = model.begun(self.data, &mut segments, Unknowns { values, states });
        let point = model.improve(self.data, &mut segments, from, 0, 1e-3);
        Ok(point.map(|point| Tried {
            suspects: Vec::new(),
            model,
            point,
        }))
    }

    /// Every suspect on top of `parent`, best first; what cannot be simulated is left out.
    pub fn race(&self, parent: &Tried, suspects: &[Suspect], told: Told) -> Result<Vec<Tried>> {
        let run = self.run(parent)?;
        let Some(screen) = Screen::new(self, parent)? else {
            return Ok(Vec::new());
        };
        let leg = told.leg("looked at", suspects.len());
        let looked: Vec<Vec<Begun>> = suspects
            .par_iter()
            .map(|suspect| {
                let look = self.look(parent, &run, &screen, suspect);
                leg.one();
                look.unwrap_or_default()
            })
            .collect();
        let mut first = promising(looked);
        let rest = first.split_off(AT_ONCE.min(first.len()));
        let mut tried = self.refitted(first, told);
        if !self.explained(parent, &tried) {
            tried.extend(self.refitted(rest, told));
        }
        self.thin_out(parent, &mut tried);
        let leg = told.leg("fitted further", tried.len());
        let mut further: Vec<Tried> = tried
            .into_par_iter()
            .map(|tried| {
                let further = self.further(tried);
                leg.one();
                further
            })
            .collect();
        if !self.explained(parent, &further) {
            let leg = told.leg("fitted afresh", further.len());
            further = further
                .into_par_iter()
                .map(|tried| {
                    let afresh = self.afresh(tried);
                    leg.one();
                    afresh
                })
                .collect();
        }
        let kin = self.kin(parent, &further, suspects)?;
        let again = self.refitted(kin, told).into_par_iter();
        let again: Vec<Tried> = again.map(|tried| self.further(tried)).collect();
        further.extend(again);
        let mut kept: Vec<Tried> = Vec::new();
        further.sort_by(|a, b| merit(a).total_cmp(&merit(b)));
        for tried in further {
            if !kept.iter().any(|kept| kept.suspects == tried.suspects) {
                kept.push(tried);
            }
        }
        self.thin_out(parent, &mut kept);
        Ok(kept)
    }

    /// The better end of each suspect's starts after a few steps.
    fn refitted(&self, begun: Vec<Vec<Begun>>, told: Told) -> Vec<Tried> {
        let leg = told.leg("fitted", begun.len());
        begun
            .into_par_iter()
            .filter_map(|starts| {
                let ends = (self.as_one(starts).into_iter())
                    .filter_map(|b| self.improved(b.suspects, b.model, b.from, FIRST_STEPS));
                let best = ends.min_by(|a, b| a.point.cost.total_cmp(&b.point.cost));
                leg.one();
                best
            })
            .collect()
    }

    /// What is suspected of components that are alike as one, a few steps from each start, and the best end of them: a dozen
    /// numbers that nobody knows yet would each follow what the others miss (docs/lab/0066-tied-start-of-identical-components.md).
    /// Other starts as they are.
    pub fn as_one(&self, starts: Vec<Begun>) -> Vec<Begun> {
        let newest = starts.first().and_then(|begun| begun.suspects.last());
        let alike = newest.map(Suspect::alike).unwrap_or_default();
        if alike.is_empty() {
            return starts;
        }
        let ends = starts.into_iter().filter_map(|begun| {
            let model = begun.model.clone().tied(&alike);
            let mut segments = self.data.segments(&model.plant, &self.stretches).ok()?;
            let from = begun.from.clone();
            let point = model.improve(self.data, &mut segments, from, FIRST_STEPS, 1e-3)?;
            let from = Unknowns {
                values: point.values,
                states: point.states,
            };
            Some((point.cost, Begun { from, ..begun }))
        });
        let best = ends.min_by(|(a, _), (b, _)| a.total_cmp(b));
        best.map(|(_, begun)| begun).into_iter().collect()
    }

    /// Whether the best of them leaves noise and little else: then those that are far behind are spared.
    fn explained(&self, parent: &Tried, tried: &[Tried]) -> bool {
        let noise = 0.5 * self.samples();
        let left = tried
            .iter()
            .map(|tried| tried.point.cost - noise)
            .fold(f64::INFINITY, f64::min);
        left < EXPLAINED * noise && left < EXPLAINED * (parent.point.cost - noise)
    }

    /// The best first, the hopeless left out.
    fn thin_out(&self, parent: &Tried, tried: &mut Vec<Tried>) {
        tried.sort_by(|a, b| merit(a).total_cmp(&merit(b)));
        tried.truncate(HEAT);
        if self.explained(parent, tried) {
            let best = tried[0].point.cost;
            tried.retain(|tried| tried.point.cost <= 0.5 * (parent.point.cost + best));
        }
    }

    /// Valid samples of all sensors.
    pub fn samples(&self) -> f64 {
        self.data.samples(&self.stretches)
    }

    /// A fitted rig run over the stretches that it was fitted to, for the sizes of things.
    pub fn run<'a>(&self, tried: &'a Tried) -> Result<Run<'a>> {
        let (model, point) = (&tried.model, &tried.point);
        let inputs = self.data.experiments.iter().map(|e| e.inputs.as_slice());
        let inputs: Vec<&[Vec<f64>]> = inputs.collect();
        let mut run = Run::new(&model.rig, &model.plant, &point.values, &inputs);
        for ((index, rows), start) in self.stretches.iter().zip(&point.states) {
            let experiment = &self.data.experiments[*index];
            let drive = experiment.drive(&model.plant, rows.clone())?;
            run.take(start, &drive, &experiment.t[rows.clone()])?;
        }
        Ok(run)
    }

    pub fn improved(
        &self,
        suspects: Vec<Suspect>,
        model: Model,
        from: Unknowns,
        steps: usize,
    ) -> Option<Tried> {
        let mut segments = self.data.segments(&model.plant, &self.stretches).ok()?;
        let point = model.improve(self.data, &mut segments, from, steps, 1e-3)?;
        Some(Tried {
            suspects,
            model,
            point,
        })
    }

    /// More steps from where it stands.
    fn further(&self, tried: Tried) -> Tried {
        if tried.point.stop == Stop::Converged {
            return tried;
        }
        let Ok(mut segments) = self.data.segments(&tried.model.plant, &self.stretches) else {
            return tried;
        };
        let from = Unknowns {
            values: tried.point.values.clone(),
            states: tried.point.states.clone(),
        };
        match tried
            .model
            .improve(self.data, &mut segments, from, MORE_STEPS, 1e-3)
        {
            Some(point) if point.cost < tried.point.cost => Tried { point, ..tried },
            _ => tried,
        }
    }

    /// From what the rig says of itself instead: without the effect its parameters were bent to make up for it,
    /// and the way back may be longer than the way from the beginning.
    fn afresh(&self, tried: Tried) -> Tried {
        let model = &tried.model;
        let mut values = tried.point.values.clone();
        for (slot, written) in model.believed() {
            values[slot] = written;
        }
        let from = self.data.segments(&model.plant, &self.stretches);
        let from = from.and_then(|mut segments| {
            let states = (self.data).starts(&model.rig, &model.plant, &segments, &values)?;
            Ok(model.begun(self.data, &mut segments, Unknowns { values, states }))
        });
        let again = from.ok().and_then(|from| {
            let steps = FIRST_STEPS + MORE_STEPS;
            self.improved(tried.suspects.clone(), model.clone(), from, steps)
        });
        match again {
            Some(again) if again.point.cost < tried.point.cost => again,
            _ => tried,
        }
    }

    /// One of a pair without the other, some steps on from where the pair ended; `base` is the rig without either.
    pub fn alone(
        &self,
        base: &Tried,
        pair: &Tried,
        kept: &Suspect,
        steps: usize,
    ) -> Result<Option<Tried>> {
        if kept.places().is_none() {
            return Ok(None);
        }
        let plant = &pair.model.plant;
        let names = kept.parameters();
        let found = names.iter().map(|name| {
            let slot = plant.slot(name);
            slot.map_or(0.0, |slot| pair.point.values[slot])
        });
        // A force of the wrong sign is no effect that a rig can hold.
        let Ok((rig, trial)) = kept.apply(&base.model.rig, &found.collect::<Vec<_>>()) else {
            return Ok(None);
        };
        let model = Model::new(&rig, self.written, &trial, self.settings)?;
        let values = model.inherit(plant, &pair.point.values);
        let segments = self.data.segments(&model.plant, &self.stretches)?;
        let states = (self.data).starts(&rig, &model.plant, &segments, &values)?;
        let from = Unknowns { values, states };
        Ok(self.improved(vec![kept.clone()], model, from, steps))
    }
}

/// What a parameter has to gain, in units of the noise squared: half the logarithm of some thousand samples.
const FINE: f64 = 3.5;

/// Cost with a fine for every parameter: what the race is decided by.
pub(super) fn merit(tried: &Tried) -> f64 {
    tried.point.cost + FINE * tried.model.slots.len() as f64
}
