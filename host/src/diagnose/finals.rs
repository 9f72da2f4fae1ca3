//! Finals: what a race found, fitted to everything (docs/diagnosis.md, "The race").

use std::ops::Range;

use rayon::prelude::*;

use super::data::Data;
use super::evidence::Contender;
use super::judge::Remains;
use super::race::{LOST, Tried};
use super::search::{Bench, FINAL_STEPS};
use crate::error::Result;
use crate::fit::levenberg::{Stop, Unknowns};

/// Steps after which finalists are compared, and what is too small a part of the cost to go on for.
const FIRST_STEPS: usize = 4;
const RELATIVE: f64 = 1e-4;

impl Bench<'_> {
    /// Fits what a race found to all of the fit recordings and looks at what each leaves of both roles. Who is far
    /// behind after a few steps is left as it is: it is a rival with no share in the evidence.
    pub fn finals(&self, tried: &[Tried]) -> Vec<Contender> {
        let begun: Vec<Tried> = tried
            .par_iter()
            .filter_map(|tried| self.on_everything(tried, FIRST_STEPS).ok().flatten())
            .collect();
        let costs = begun.iter().map(|tried| tried.point.cost);
        let best = costs.fold(f64::INFINITY, f64::min);
        begun
            .into_par_iter()
            .filter_map(|tried| {
                let close = tried.point.cost < LOST * best;
                let fitted = if close && tried.point.stop == Stop::IterationLimit {
                    self.go_on(tried, FINAL_STEPS - FIRST_STEPS)
                } else {
                    Ok(tried)
                };
                fitted.and_then(|tried| self.weighed(tried)).ok().flatten()
            })
            .collect()
    }

    /// As [`Bench::finals`] for one that nothing is held against.
    pub fn contender(&self, tried: &Tried, steps: usize) -> Result<Option<Contender>> {
        match self.on_everything(tried, steps)? {
            Some(tried) => self.weighed(tried),
            None => Ok(None),
        }
    }

    /// Fitted to all of the fit recordings, from start states that they show.
    fn on_everything(&self, tried: &Tried, steps: usize) -> Result<Option<Tried>> {
        let model = tried.model.integrated(self.settings);
        let mut segments = self.fit.segments(&model.plant, &self.fit_stretches)?;
        let values = tried.point.values.clone();
        let states = (self.fit).starts(&model.rig, &model.plant, &segments, &values)?;
        let from = Unknowns { values, states };
        let point = model.improve(self.fit, &mut segments, from, steps, RELATIVE);
        Ok(point.map(|point| Tried {
            model,
            point,
            ..tried.clone()
        }))
    }

    /// More steps of the same fit.
    fn go_on(&self, tried: Tried, steps: usize) -> Result<Tried> {
        let mut segments = (self.fit).segments(&tried.model.plant, &self.fit_stretches)?;
        let from = Unknowns {
            values: tried.point.values.clone(),
            states: tried.point.states.clone(),
        };
        let point = (tried.model).improve(self.fit, &mut segments, from, steps, RELATIVE);
        Ok(match point {
            Some(point) if point.cost < tried.point.cost => Tried { point, ..tried },
            _ => tried,
        })
    }

    /// What a fitted rig leaves of both roles.
    fn weighed(&self, mut tried: Tried) -> Result<Option<Contender>> {
        let model = &tried.model;
        super::gauge::settle(model, &tried.suspects, &mut tried.point);
        let point = &tried.point;
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
        Ok(fit
            .zip(check)
            .map(|(fit, check)| Contender { tried, fit, check }))
    }

    /// The believed rig with the benefit of the doubt: fitted to the check recordings too, so that nothing is
    /// called missing because a parameter was not known well enough.
    pub fn base(&self, start: &Tried) -> Result<Option<Contender>> {
        let model = &start.model.integrated(self.settings);
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
        let Some(point) = model.improve(self.both, &mut segments, from, FINAL_STEPS, RELATIVE)
        else {
            return Ok(None);
        };
        let left = |data: &Data, stretches: &[(usize, Range<usize>)]| {
            Remains::of(model, &point.values, data, stretches, None)
        };
        let fit = left(self.fit, &self.fit_stretches)?;
        let check = left(self.check, &self.check_stretches)?;
        Ok(fit.zip(check).map(|(fit, check)| Contender {
            tried: Tried {
                model: model.clone(),
                point,
                ..start.clone()
            },
            fit,
            check,
        }))
    }
}
