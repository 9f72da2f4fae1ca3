//! The recordings of one diagnosis: their roles, how they are cut and how candidates are integrated
//! over them.

use crate::diagnose::config::CONFIG;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use sinew_sim::effects::Kind;
use sinew_sim::{Plant, Rig, SimulationSettings};

use crate::diagnose::data::Data;
use crate::diagnose::progress::Progress;
use crate::diagnose::time_budget::TimeBudget;
use crate::fit::pace::{pace, settings, step_cost, substeps};
use crate::fit::{Fit, FreeRun, free_runs, pool};
use crate::recording::Recording;

/// Recordings and how they are cut for judging.
pub(crate) struct Case<'a> {
    pub written: &'a Rig,
    pub fit: &'a Data,
    pub check: &'a Data,
    /// The recordings of both.
    pub both: &'a Data,
    /// Recordings are judged in intervals with start states of their own: something integrates.
    pub in_parts: bool,
    /// Integration of full refits.
    pub settings: SimulationSettings,
    pub fit_intervals: Vec<(usize, Range<usize>)>,
    pub check_intervals: Vec<(usize, Range<usize>)>,
    /// Vocabulary of the search.
    pub effects: &'a [Kind],
    /// Moves that the search leaves out.
    pub without_moves: &'a [String],
    pub seed: u64,
    /// Less than 1 where recordings are too short to be checked by others.
    pub trust: f64,
    pub progress: &'a (dyn Fn(&str, usize, usize) + Sync),
    /// Time that the search may take.
    pub time: TimeBudget,
    /// Moves that it had no time for.
    pub untried: Untried,
}

/// Names of moves that a search had no time for, wholly or in part.
#[derive(Debug, Default)]
pub(crate) struct Untried(Mutex<Vec<&'static str>>);

impl Untried {
    /// Notes a move, once.
    pub fn note(&self, name: &'static str) {
        let mut names = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if !names.contains(&name) {
            names.push(name);
        }
    }

    /// All of them, in the order in which they were noted.
    pub fn names(&self) -> Vec<&'static str> {
        let names = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        names.clone()
    }
}

impl Case<'_> {
    /// The same case over other data of the same recordings.
    pub fn over<'o>(&'o self, fit: &'o Data, check: &'o Data) -> Case<'o> {
        Case {
            written: self.written,
            fit,
            check,
            both: self.both,
            in_parts: self.in_parts,
            settings: self.settings,
            fit_intervals: self.fit_intervals.clone(),
            check_intervals: self.check_intervals.clone(),
            effects: self.effects,
            without_moves: self.without_moves,
            seed: self.seed,
            trust: self.trust,
            progress: self.progress,
            time: self.time.clone(),
            untried: Untried::default(),
        }
    }

    /// Tells whether there are enough rows to tell two effects apart: a second effect in a few
    /// dozen rows is whatever the first one got wrong.
    pub fn has_rows_for_two(&self) -> bool {
        self.fit.rows().min(self.check.rows()) >= CONFIG.split.shortest
    }

    /// Progress of a part of the search.
    pub fn progress_of<'s>(&'s self, what: &'s str) -> Progress<'s> {
        Progress {
            callback: self.progress,
            what,
            time: &self.time,
        }
    }
}

/// Integration of full refits, and the rows that one may take: what a whole simulation may
/// cost.
pub(crate) fn refit_settings(
    plant: &Plant,
    values: &[f64],
    fit: &Data,
    both: &Data,
) -> (SimulationSettings, usize) {
    let pace = pace(plant, values, &fit.experiments);
    let cost = step_cost(plant);
    let step = CONFIG.refit.step * cost;
    let rows = CONFIG.refit.work / substeps(pace, step);
    let mut settings = settings(plant, values, &both.experiments, step);
    // What ran along the bound of a screening is judged too.
    settings.max_substeps *= CONFIG.model.more_substeps;
    (
        settings,
        rows.max((CONFIG.refit.rows as f64 / cost) as usize),
    )
}

/// Tells whether the refitted rig runs away from some recording: its free run ends farther from it
/// than what was measured ever moved. What holds the device there, a controller above all, does not
/// hold the simulation, and its error says nothing of the effects that are missing.
pub(crate) fn runs_away(refitted: &Fit, check: &[Recording]) -> bool {
    let away = |run: &FreeRun| {
        let mut sensors = pool(std::slice::from_ref(run)).into_iter();
        sensors.any(|s| s.spread > 0.0 && (s.rms.is_nan() || s.rms > CONFIG.split.away * s.spread))
    };
    // What cannot be simulated to its end may be in pieces.
    let of_check = free_runs(&refitted.rig, check);
    refitted.runs.iter().any(away) || of_check.map_or(true, |runs| runs.iter().any(away))
}

/// Some body is held in place by nothing: it integrates what pushes it, and a whole recording's
/// error is mostly drift.
pub(crate) fn integrates(rig: &Rig) -> bool {
    use sinew_sim::effects::Motion;
    use sinew_sim::rig::End;
    let mut held = vec![false; rig.bodies.len()];
    for gravity in &rig.gravities {
        held[gravity.body] |= rig.bodies[gravity.body].motion == Motion::Hinge;
    }
    for tendon in &rig.tendons {
        for (body, _) in &tendon.path {
            held[*body] = true;
        }
    }
    for _ in 0..=rig.bodies.len() {
        for spring in &rig.springs {
            let is = |end: End, held: &[bool]| match end {
                End::Ground => true,
                End::Body(body) => held[body],
            };
            if is(spring.from, &held) || is(spring.to, &held) {
                for end in [spring.from, spring.to] {
                    if let End::Body(body) = end {
                        held[body] = true;
                    }
                }
            }
        }
    }
    held.contains(&false)
}
