//! Recordings, and the models that are held against them.

use sinew_sim::Rig;

use crate::fit::{FreeRun, pool};
use crate::recording::Recording;
use crate::report::Tone;

/// A rig's free runs over the recordings, in their order.
#[derive(Clone, Copy, Debug)]
pub struct Model<'a> {
    /// Name in legends: `refitted`.
    pub name: &'a str,
    /// Colour in every plot.
    pub tone: Tone,
    /// One run a recording.
    pub runs: &'a [FreeRun],
}

/// Recordings and the models that were held against them.
#[derive(Clone, Debug)]
pub struct Free<'a> {
    /// The rig: inputs and sensors.
    pub rig: &'a Rig,
    /// Each recording with its role: `fit`, `check` or `test`.
    pub recordings: Vec<(&'a str, &'a Recording)>,
    /// The models, the best last.
    pub models: Vec<Model<'a>>,
}

impl<'a> Free<'a> {
    /// The role that judges: the one that chose least.
    pub(super) fn judging(&self) -> &'static str {
        let has = |role: &&str| self.recordings.iter().any(|(is, _)| is == role);
        ["test", "check"].into_iter().find(has).unwrap_or("fit")
    }

    /// Fit of the best model in per cent, of a signal over the recordings of a role; empty where
    /// there is none.
    pub fn fit_text(&self, role: &str, signal: &str) -> String {
        let best = self.models.last().map(|best| pool(&self.of(best, role)));
        let mut best = best.unwrap_or_default().into_iter();
        let found = best.find(|error| error.signal == signal);
        found.map_or_else(String::new, |error| error.fit_text())
    }

    /// Runs of a model over the recordings of a role.
    pub(super) fn of(&self, model: &Model<'a>, role: &str) -> Vec<FreeRun> {
        let all = self.recordings.iter().zip(model.runs);
        let all = all.filter(|((is, _), _)| *is == role);
        all.map(|(_, run)| run.clone()).collect()
    }
}
