//! Part of the data that is small enough to try every term on.

use crate::diagnose::config::CONFIG;
use std::ops::Range;

use sinew_sim::{Plant, Rig, SimulationSettings};

use crate::diagnose::candidate::Trial;
use crate::diagnose::case::Case;
use crate::diagnose::data::Data;
use crate::diagnose::model::Model;
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::fit::levenberg::DecisionVariables;
use crate::fit::local;
use crate::fit::pace::{pace, settings, step_cost, substeps};
use crate::scales::Run;

/// Part of the data that is small enough to try everything on, cut into intervals.
pub(crate) struct Subset<'a> {
    pub written: &'a Rig,
    pub data: &'a Data,
    pub intervals: Vec<(usize, std::ops::Range<usize>)>,
    /// Integration of trials: coarsely, and not at all where a step would cost too much.
    pub settings: SimulationSettings,
}

impl<'a> Subset<'a> {
    /// Recordings of the fit with every few rows, where the plant hardly moves between them and
    /// there are more rows than screening takes.
    pub fn thinned(case: &Case, rig: &Rig, plant: &Plant, values: &[f64]) -> Option<Data> {
        let thin = thinning(case.fit, pace(plant, values, &case.fit.experiments));
        (thin > 1).then(|| case.fit.thinned(rig, plant, thin))
    }

    /// Intervals spread over the recordings, of about as many sub-steps as screening may take;
    /// `data` are those of [`Subset::thinned`] or all.
    pub fn new(case: &Case<'a>, data: &'a Data, plant: &Plant, values: &[f64]) -> Self {
        let pace = pace(plant, values, &case.fit.experiments);
        let thin = thinning(case.fit, pace);
        let step = CONFIG.screening.step * step_cost(plant);
        let budget = CONFIG.screening.work / substeps(pace * thin as f64, step);
        Self {
            written: case.written,
            data,
            intervals: data.select(
                CONFIG.screening.intervals,
                budget.max(screening_rows(plant)),
            ),
            settings: settings(plant, values, &data.experiments, step),
        }
    }

    /// Other intervals of the same recordings.
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
    /// A rig fitted to the subset, from values that are known to be near.
    ///
    /// # Errors
    /// A rig that cannot be compiled.
    pub fn first(&self, rig: &Rig, values: &[f64], steps: usize) -> Result<Option<Trial>> {
        let model = Model::new(rig, self.written, &[], self.settings)?;
        let mut segments = self.data.segments(&model.plant, &self.intervals)?;
        let states = self.data.starts(rig, &model.plant, &segments, values)?;
        let from = DecisionVariables {
            values: values.to_vec(),
            states,
        };
        let from = model.begun(self.data, &mut segments, from);
        let point = model.improve(
            self.data,
            &mut segments,
            from,
            steps,
            CONFIG.screening.baseline_tolerance,
        );
        Ok(point.map(|point| Trial {
            terms: Vec::new(),
            model,
            point,
        }))
    }

    /// The rig with what its owner wrote, only start states fitted. `None` where it cannot be
    /// simulated.
    ///
    /// # Errors
    /// A rig that cannot be compiled.
    pub fn as_written(&self, rig: &Rig) -> Result<Option<Trial>> {
        let model = Model::new(rig, self.written, &[], self.settings)?;
        let written = Plant::new(self.written)?;
        let values = model.inherit(&written, &written.values());
        let mut segments = self.data.segments(&model.plant, &self.intervals)?;
        let states = self.data.starts(rig, &model.plant, &segments, &values)?;
        let from = model.begun(
            self.data,
            &mut segments,
            DecisionVariables { values, states },
        );
        let point = model.improve(
            self.data,
            &mut segments,
            from,
            0,
            CONFIG.screening.tolerance,
        );
        Ok(point.map(|point| Trial {
            terms: Vec::new(),
            model,
            point,
        }))
    }

    /// Valid samples of all sensors.
    pub fn samples(&self) -> f64 {
        self.data.samples(&self.intervals)
    }

    /// A fitted rig run over the intervals that it was fitted to, for the sizes of things.
    pub fn run<'a>(&self, trial: &'a Trial) -> Result<Run<'a>> {
        let (model, point) = (&trial.model, &trial.point);
        let inputs = self.data.experiments.iter().map(|e| e.inputs.as_slice());
        let inputs: Vec<&[Vec<f64>]> = inputs.collect();
        let mut run = Run::new(&model.rig, &model.plant, &point.values, &inputs);
        for ((index, rows), start) in self.intervals.iter().zip(&point.states) {
            let experiment = &self.data.experiments[*index];
            let drive = experiment.drive(&model.plant, rows.clone())?;
            let values = local::values(&model.plant, &point.values, start);
            let start = &start[..model.plant.state_len()];
            run.take((&values, start), &drive, &experiment.t[rows.clone()])?;
        }
        Ok(run)
    }

    pub fn improved(
        &self,
        terms: Vec<Term>,
        model: Model,
        from: DecisionVariables,
        steps: usize,
    ) -> Option<Trial> {
        let mut segments = self.data.segments(&model.plant, &self.intervals).ok()?;
        let point = model.improve(
            self.data,
            &mut segments,
            from,
            steps,
            CONFIG.screening.tolerance,
        )?;
        Some(Trial {
            terms,
            model,
            point,
        })
    }

    /// One of a pair without the other, some steps on from where the pair ended; `base` is the rig
    /// without either.
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
        let from = DecisionVariables { values, states };
        Ok(self.improved(terms, model, from, steps))
    }
}

/// The fewest rows of a screening.
pub(crate) fn screening_rows(plant: &Plant) -> usize {
    (CONFIG.screening.rows as f64 / step_cost(plant)) as usize
}

/// The same rows, each interval in that many pieces.
pub(crate) fn cut_subset<'a>(subset: &Subset<'a>, pieces: usize) -> Subset<'a> {
    subset.on(pieces_of(&subset.intervals, pieces))
}

/// Each interval in that many pieces, or as many as it has rows for.
pub(crate) fn pieces_of(
    intervals: &[(usize, Range<usize>)],
    pieces: usize,
) -> Vec<(usize, Range<usize>)> {
    let cut = |(index, rows): &(usize, Range<usize>)| {
        let (index, rows) = (*index, rows.clone());
        let count = pieces.min(rows.len() / CONFIG.screening.piece_rows).max(1);
        (0..count).map(move |k| {
            let at = |k: usize| rows.start + k * rows.len() / count;
            (index, at(k)..at(k + 1))
        })
    };
    intervals.iter().flat_map(cut).collect()
}

/// Number of rows that one may stand for in screening: the plant hardly moves between them.
fn thinning(data: &Data, pace: f64) -> usize {
    let most = if pace > 0.0 {
        (CONFIG.screening.density / pace) as usize
    } else {
        1
    };
    (data.rows() / CONFIG.screening.work).min(most).max(1)
}
