//! The race: every suspect refitted inside the simulator, on part of the data, a few steps from several starts.

use rayon::prelude::*;
use sinew_sim::Rig;

use super::data::Data;
use super::model::{Model, Point};
use super::scales::Run;
use super::suspect::Suspect;
use crate::error::Result;
use crate::fit::levenberg::Unknowns;

/// A rig with some suspects in it, as far as it was fitted.
#[derive(Clone)]
pub(super) struct Tried {
    /// What was added to the believed rig; empty for that rig itself.
    pub suspects: Vec<Suspect>,
    pub model: Model,
    pub point: Point,
}

/// Steps from each start, and of the best of them further.
const FIRST_STEPS: usize = 2;
const MORE_STEPS: usize = 6;

/// How many of a race go further.
const HEAT: usize = 12;

/// Part of the data that is small enough to try everything on, cut into stretches.
pub(super) struct Track<'a> {
    pub written: &'a Rig,
    pub data: &'a Data,
    pub stretches: Vec<(usize, std::ops::Range<usize>)>,
}

impl Track<'_> {
    /// A rig fitted to the track, from values that are known to be near.
    ///
    /// # Errors
    /// A rig that cannot be compiled.
    pub fn first(&self, rig: &Rig, values: &[f64], steps: usize) -> Result<Option<Tried>> {
        let model = Model::new(rig, self.written, &[])?;
        let segments = self.data.segments(&model.plant, &self.stretches)?;
        let states = self.data.starts(rig, &model.plant, &segments, values)?;
        let from = Unknowns {
            values: values.to_vec(),
            states,
        };
        let point = model.improve(self.data, &segments, from, steps, 1e-5);
        Ok(point.map(|point| Tried {
            suspects: Vec::new(),
            model,
            point,
        }))
    }

    /// Every suspect on top of `parent`, best first; what cannot be simulated is left out. `told` hears of
    /// each one that is done.
    pub fn race(
        &self,
        parent: &Tried,
        suspects: &[Suspect],
        told: &(dyn Fn() + Sync),
    ) -> Result<Vec<Tried>> {
        let run = Run::new(parent, self.data, &self.stretches)?;
        let mut tried: Vec<Tried> = suspects
            .par_iter()
            .filter_map(|suspect| {
                let one = self.heat(parent, &run, suspect).ok().flatten();
                told();
                one
            })
            .collect();
        tried.sort_by(|a, b| merit(a).total_cmp(&merit(b)));
        tried.truncate(HEAT);
        let mut further: Vec<Tried> = tried
            .into_par_iter()
            .map(|tried| self.further(tried))
            .collect();
        further.sort_by(|a, b| merit(a).total_cmp(&merit(b)));
        Ok(further)
    }

    /// The best of a suspect's starts after a few steps.
    fn heat(&self, parent: &Tried, run: &Run, suspect: &Suspect) -> Result<Option<Tried>> {
        let mut best: Option<Tried> = None;
        for start in self.starts(parent, run, suspect)? {
            if let Some(tried) = self.begin(parent, suspect, &start)?
                && best
                    .as_ref()
                    .is_none_or(|best| tried.point.cost < best.point.cost)
            {
                best = Some(tried);
            }
        }
        Ok(best)
    }

    /// More steps from where it stands.
    fn further(&self, tried: Tried) -> Tried {
        let Ok(segments) = self.data.segments(&tried.model.plant, &self.stretches) else {
            return tried;
        };
        let from = Unknowns {
            values: tried.point.values.clone(),
            states: tried.point.states.clone(),
        };
        let steps = MORE_STEPS;
        match tried.model.improve(self.data, &segments, from, steps, 1e-3) {
            Some(point) if point.cost < tried.point.cost => Tried { point, ..tried },
            _ => tried,
        }
    }

    /// A few steps from one start.
    fn begin(&self, parent: &Tried, suspect: &Suspect, start: &[f64]) -> Result<Option<Tried>> {
        let (rig, new) = suspect.apply(&parent.model.rig, start)?;
        let mut trial: Vec<_> = parent
            .suspects
            .iter()
            .flat_map(|suspect| suspect.trial())
            .collect();
        trial.extend(new);
        let model = Model::new(&rig, self.written, &trial)?;
        let values = model.inherit(&parent.model.plant, &parent.point.values);
        let segments = self.data.segments(&model.plant, &self.stretches)?;
        let mut states = self.data.starts(&rig, &model.plant, &segments, &values)?;
        let known = parent.model.plant.state_names();
        for (index, name) in model.plant.state_names().iter().enumerate() {
            if let Some(at) = known.iter().position(|known| known == name) {
                for (state, known) in states.iter_mut().zip(&parent.point.states) {
                    state[index] = known[at];
                }
            }
        }
        let from = Unknowns { values, states };
        let point = model.improve(self.data, &segments, from, FIRST_STEPS, 1e-3);
        let mut suspects = parent.suspects.clone();
        suspects.push(suspect.clone());
        Ok(point.map(|point| Tried {
            suspects,
            model,
            point,
        }))
    }

    /// Where a suspect starts from: nowhere in particular for a number, scale-free places for an effect.
    fn starts(&self, parent: &Tried, run: &Run, suspect: &Suspect) -> Result<Vec<Vec<f64>>> {
        match suspect {
            Suspect::Number { .. } => Ok(vec![Vec::new()]),
            Suspect::Effect { kind, component } => {
                let site = parent.model.rig.site(*kind, component)?;
                Ok(kind.starts(&run.at(parent, site)))
            }
        }
    }
}

/// Cost with a fine for every parameter: what the race is decided by.
fn merit(tried: &Tried) -> f64 {
    tried.point.cost + tried.model.slots.len() as f64
}
