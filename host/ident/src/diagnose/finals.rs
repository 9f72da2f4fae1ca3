//! Finals: what a race found, fitted to everything (docs/explanation/diagnosis.md, "The race").

use std::ops::Range;

use super::data::{Data, Starts};
use super::evidence::Contender;
use super::judge::Remains;
use super::ladder::pieces_of;
use super::race::{Track, Tried};
use super::search::{Bench, FINAL_STEPS};
use super::suspect::Suspect;
use crate::error::Result;
use crate::fit::levenberg::Unknowns;
use crate::fit::start;

/// Explained: a cost of no more than this many times what noise alone costs.
const EXPLAINED: f64 = 1.5;

/// Pieces of a stretch, from rung to rung, where a final has lost what its race had found.
const JOINED: [usize; 4] = [8, 4, 2, 1];

impl Bench<'_> {
    /// Fits what a race found to all of the fit recordings and looks at what it leaves of both roles.
    pub fn contender(
        &self,
        track: &Track,
        tried: &Tried,
        steps: usize,
    ) -> Result<Option<Contender>> {
        let model = &tried.model.integrated(self.settings);
        let segments = self.fit.segments(&model.plant, &self.fit_stretches)?;
        let found = Starts {
            data: track.data,
            stretches: &track.stretches,
            states: &tried.point.states,
        };
        let states = (self.fit).carried(
            (&model.rig, &model.plant),
            &tried.point.values,
            &segments,
            found,
        )?;
        let from = Unknowns {
            values: tried.point.values.clone(),
            states,
        };
        let direct = self.refined(tried, from, steps)?;
        let explained = |cost: f64, samples: f64| cost < EXPLAINED * 0.5 * samples;
        let lost = explained(tried.point.cost, track.samples())
            && !direct.as_ref().is_some_and(|direct| {
                let samples = self.fit.samples(&self.fit_stretches);
                explained(direct.tried.point.cost, samples)
            });
        if !lost {
            return Ok(direct);
        }
        let joined = self.joined(tried, found, steps)?;
        let cost = |one: &Contender| one.tried.point.cost;
        Ok([direct, joined]
            .into_iter()
            .flatten()
            .min_by(|a, b| cost(a).total_cmp(&cost(b))))
    }

    /// As [`Bench::contender`], in pieces that are joined rung by rung: over a whole recording a friction that is a
    /// little off stops the device where it slid on, and no step from there leads back.
    fn joined(&self, tried: &Tried, found: Starts, steps: usize) -> Result<Option<Contender>> {
        let model = &tried.model.integrated(self.settings);
        let mut values = tried.point.values.clone();
        let mut stretches = found.stretches.to_vec();
        let mut states = found.states.to_vec();
        let mut data = found.data;
        for pieces in JOINED {
            let next = pieces_of(&self.fit_stretches, pieces);
            let mut segments = self.fit.segments(&model.plant, &next)?;
            let known = Starts {
                data,
                stretches: &stretches,
                states: &states,
            };
            let starts = (self.fit).along((&model.rig, &model.plant), &values, &segments, known)?;
            let from = Unknowns {
                values,
                states: starts,
            };
            if pieces == 1 {
                return self.refined(tried, from, steps);
            }
            let Some(point) = model.improve(self.fit, &mut segments, from, steps, 1e-4) else {
                return Ok(None);
            };
            (values, states) = (point.values, point.states);
            (stretches, data) = (next, self.fit);
        }
        Ok(None)
    }

    /// As [`Bench::contender`], from here.
    pub fn refined(
        &self,
        tried: &Tried,
        from: Unknowns,
        steps: usize,
    ) -> Result<Option<Contender>> {
        let model = &tried.model.integrated(self.settings);
        let mut segments = self.fit.segments(&model.plant, &self.fit_stretches)?;
        let Some(mut point) = model.improve(self.fit, &mut segments, from, steps, 1e-4) else {
            return Ok(None);
        };
        super::gauge::settle(model, &tried.suspects, &mut point);
        // A number that the data leave near zero may end on the wrong side of it.
        let signed: Vec<String> = (tried.suspects.iter())
            .flat_map(Suspect::not_below_zero)
            .collect();
        let signed = model.clone().signed(&signed);
        let values = signed.within(&point.values);
        let model = if values == point.values {
            model
        } else {
            &signed
        };
        if values != point.values {
            let states = point.states.clone();
            let from = Unknowns { values, states };
            let within = model.improve(self.fit, &mut segments, from, steps, 1e-4);
            let Some(within) = within else {
                return Ok(None);
            };
            point = within;
        }
        self.judged(Tried {
            model: model.clone(),
            point,
            ..tried.clone()
        })
    }

    /// What it leaves of both roles.
    fn judged(&self, tried: Tried) -> Result<Option<Contender>> {
        let (model, point) = (&tried.model, &tried.point);
        let left =
            |data, stretches, states| Remains::of(model, &point.values, data, stretches, states);
        let fit = left(self.fit, &self.fit_stretches, Some(&point.states[..]))?;
        let check = left(self.check, &self.check_stretches, None)?;
        Ok(fit.zip(check).map(|(fit, check)| Contender {
            tried,
            fit,
            check,
            all_rows: false,
        }))
    }

    /// An explanation with these parameters, its start states fitted, and what it leaves.
    pub fn with_values(&self, tried: &Tried, values: Vec<f64>) -> Result<Option<Contender>> {
        let model = &tried.model.integrated(self.settings);
        let mut segments = self.fit.segments(&model.plant, &self.fit_stretches)?;
        let states = tried.point.states.clone();
        let from = Unknowns { values, states };
        let Some(point) = model
            .held()
            .improve(self.fit, &mut segments, from, FINAL_STEPS, 1e-4)
        else {
            return Ok(None);
        };
        self.judged(Tried {
            model: model.clone(),
            point,
            ..tried.clone()
        })
    }

    /// The believed rig with the benefit of the doubt: fitted to the check recordings too, so that nothing is
    /// called missing because a parameter was not known well enough.
    pub fn base(&self, start: &Tried) -> Result<Option<Contender>> {
        self.base_from(start, &start.point.values)
    }

    /// The same, from other values of the rig's parameters.
    pub fn base_from(&self, start: &Tried, values: &[f64]) -> Result<Option<Contender>> {
        let model = &start.model.integrated(self.settings);
        let mut stretches = self.fit_stretches.clone();
        let own = self.fit.experiments.len();
        let of_check = self.check_stretches.iter();
        stretches.extend(of_check.map(|(index, rows)| (own + index, rows.clone())));
        let mut segments = self.both.segments(&model.plant, &stretches)?;
        let states = self
            .both
            .starts(&model.rig, &model.plant, &segments, values)?;
        let problem = self.both.judging(&model.plant);
        let states = start::near(&problem, &segments, values, states);
        let from = Unknowns {
            values: values.to_vec(),
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
                model: model.clone(),
                point,
                ..start.clone()
            },
            fit,
            check,
            all_rows: false,
        }))
    }
}
