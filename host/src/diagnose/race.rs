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

/// Steps from each start, and from the best of them.
const FIRST_STEPS: usize = 3;
const MORE_STEPS: usize = 6;

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
                let one = self.run(parent, &run, suspect).ok().flatten();
                told();
                one
            })
            .collect();
        tried.sort_by(|a, b| merit(a).total_cmp(&merit(b)));
        Ok(tried)
    }

    fn run(&self, parent: &Tried, run: &Run, suspect: &Suspect) -> Result<Option<Tried>> {
        let mut ahead: Vec<Tried> = Vec::new();
        for start in self.starts(parent, run, suspect)? {
            if let Some(tried) = self.begin(parent, suspect, &start)? {
                ahead.push(tried);
            }
        }
        ahead.sort_by(|a, b| a.point.cost.total_cmp(&b.point.cost));
        let Some(best) = ahead.into_iter().next() else {
            return Ok(None);
        };
        let segments = self.data.segments(&best.model.plant, &self.stretches)?;
        let further = best.model.improve(
            self.data,
            &segments,
            Unknowns {
                values: best.point.values.clone(),
                states: best.point.states.clone(),
            },
            MORE_STEPS,
            1e-3,
        );
        Ok(Some(match further {
            Some(point) if point.cost < best.point.cost => Tried { point, ..best },
            _ => best,
        }))
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
        for (state, known) in states.iter_mut().zip(&parent.point.states) {
            let common = known.len().min(state.len());
            state[..common].copy_from_slice(&known[..common]);
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
