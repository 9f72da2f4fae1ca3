//! Finals: what a race found, fitted to everything (docs/explanation/diagnosis.md, "The race").

use std::ops::Range;

use crate::diagnose::candidate::Term;
use crate::diagnose::data::{Data, Starts};
use crate::diagnose::evidence::Candidate;
use crate::diagnose::residuals::Residuals;
use crate::diagnose::search::halving::{Subset, Trial};
use crate::diagnose::search::moves::short_horizon::pieces_of;
use crate::diagnose::search::{Case, FINAL_STEPS};
use crate::error::Result;
use crate::fit::levenberg::Unknowns;
use crate::fit::start;

/// Explained: a cost of no more than this many times what noise alone costs.
const EXPLAINED: f64 = 1.5;

/// Pieces of a stretch, from rung to rung, where a final has lost what its race had found.
const JOINED: [usize; 4] = [8, 4, 2, 1];

impl Case<'_> {
    /// Fits what a race found to all of the fit recordings and looks at what it leaves of both roles.
    pub fn candidate(
        &self,
        subset: &Subset,
        trial: &Trial,
        steps: usize,
    ) -> Result<Option<Candidate>> {
        let model = &trial.model.integrated(self.settings);
        let segments = self.fit.segments(&model.plant, &self.fit_intervals)?;
        let found = Starts {
            data: subset.data,
            intervals: &subset.intervals,
            states: &trial.point.states,
        };
        let states = (self.fit).carried(
            (&model.rig, &model.plant),
            &trial.point.values,
            &segments,
            found,
        )?;
        let from = Unknowns {
            values: trial.point.values.clone(),
            states,
        };
        let direct = self.refined(trial, from, steps)?;
        let explained = |cost: f64, samples: f64| cost < EXPLAINED * 0.5 * samples;
        let lost = explained(trial.point.cost, subset.samples())
            && !direct.as_ref().is_some_and(|direct| {
                let samples = self.fit.samples(&self.fit_intervals);
                explained(direct.trial.point.cost, samples)
            });
        if !lost {
            return Ok(direct);
        }
        let joined = self.joined(trial, found, steps)?;
        let cost = |one: &Candidate| one.trial.point.cost;
        Ok([direct, joined]
            .into_iter()
            .flatten()
            .min_by(|a, b| cost(a).total_cmp(&cost(b))))
    }

    /// As [`Bench::contender`], in pieces that are joined rung by rung: over a whole recording a friction that is a
    /// little off stops the device where it slid on, and no step from there leads back.
    fn joined(&self, trial: &Trial, found: Starts, steps: usize) -> Result<Option<Candidate>> {
        let model = &trial.model.integrated(self.settings);
        let mut values = trial.point.values.clone();
        let mut intervals = found.intervals.to_vec();
        let mut states = found.states.to_vec();
        let mut data = found.data;
        for pieces in JOINED {
            let next = pieces_of(&self.fit_intervals, pieces);
            let mut segments = self.fit.segments(&model.plant, &next)?;
            let known = Starts {
                data,
                intervals: &intervals,
                states: &states,
            };
            let starts = (self.fit).along((&model.rig, &model.plant), &values, &segments, known)?;
            let from = Unknowns {
                values,
                states: starts,
            };
            if pieces == 1 {
                return self.refined(trial, from, steps);
            }
            let Some(point) = model.improve(self.fit, &mut segments, from, steps, 1e-4) else {
                return Ok(None);
            };
            (values, states) = (point.values, point.states);
            (intervals, data) = (next, self.fit);
        }
        Ok(None)
    }

    /// As [`Bench::contender`], from here.
    pub fn refined(
        &self,
        trial: &Trial,
        from: Unknowns,
        steps: usize,
    ) -> Result<Option<Candidate>> {
        let model = &trial.model.integrated(self.settings);
        let mut segments = self.fit.segments(&model.plant, &self.fit_intervals)?;
        let Some(mut point) = model.improve(self.fit, &mut segments, from, steps, 1e-4) else {
            return Ok(None);
        };
        crate::diagnose::canonical::settle(model, &trial.terms, &mut point);
        // A number that the data leave near zero may end on the wrong side of it.
        let signed: Vec<String> = (trial.terms.iter())
            .flat_map(Term::not_below_zero)
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
        self.judged(Trial {
            model: model.clone(),
            point,
            ..trial.clone()
        })
    }

    /// What it leaves of both roles.
    fn judged(&self, trial: Trial) -> Result<Option<Candidate>> {
        let (model, point) = (&trial.model, &trial.point);
        let left =
            |data, intervals, states| Residuals::of(model, &point.values, data, intervals, states);
        let fit = left(self.fit, &self.fit_intervals, Some(&point.states[..]))?;
        let check = left(self.check, &self.check_intervals, None)?;
        Ok(fit.zip(check).map(|(fit, check)| Candidate {
            trial,
            fit,
            check,
            all_rows: false,
        }))
    }

    /// An explanation with these parameters, its start states fitted, and what it leaves.
    pub fn with_values(&self, trial: &Trial, values: Vec<f64>) -> Result<Option<Candidate>> {
        let model = &trial.model.integrated(self.settings);
        let mut segments = self.fit.segments(&model.plant, &self.fit_intervals)?;
        let states = trial.point.states.clone();
        let from = Unknowns { values, states };
        let Some(point) = model
            .held()
            .improve(self.fit, &mut segments, from, FINAL_STEPS, 1e-4)
        else {
            return Ok(None);
        };
        self.judged(Trial {
            model: model.clone(),
            point,
            ..trial.clone()
        })
    }

    /// The believed rig with the benefit of the doubt: fitted to the check recordings too, so that nothing is
    /// called missing because a parameter was not known well enough.
    pub fn base(&self, start: &Trial) -> Result<Option<Candidate>> {
        self.base_from(start, &start.point.values)
    }

    /// The same, from other values of the rig's parameters.
    pub fn base_from(&self, start: &Trial, values: &[f64]) -> Result<Option<Candidate>> {
        let model = &start.model.integrated(self.settings);
        let mut intervals = self.fit_intervals.clone();
        let own = self.fit.experiments.len();
        let of_check = self.check_intervals.iter();
        intervals.extend(of_check.map(|(index, rows)| (own + index, rows.clone())));
        let mut segments = self.both.segments(&model.plant, &intervals)?;
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
        let left = |data: &Data, intervals: &[(usize, Range<usize>)]| {
            Residuals::of(model, &point.values, data, intervals, None)
        };
        let fit = left(self.fit, &self.fit_intervals)?;
        let check = left(self.check, &self.check_intervals)?;
        Ok(fit.zip(check).map(|(fit, check)| Candidate {
            trial: Trial {
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
