//! One controller and its loops, judged.

use serde::Serialize;

use crate::closed_loop::control_problem::ControlProblem;
use crate::closed_loop::model_loop::BoardRuns;
use crate::closed_loop::scenario::{Distance, Run, Score};
use crate::closed_loop::setup::{DeviceRun, same_bits};
use crate::closed_loop::transient::Transient;
use crate::pipeline::summary::{Spread, instructions};
use crate::project::image::Sizes;
use sinew_ident::error::{Error, Result};

/// One loop, judged (docs/explanation/comparison.md, eq. 2 and 4).
#[derive(Clone, Debug, Serialize)]
pub struct Judged {
    /// Errors and effort.
    #[serde(flatten)]
    pub score: Score,
    /// The length of the error; null where the outputs have several units, or there is one.
    pub distance: Option<Distance>,
    /// Overshoot and settling of each output; null where its reference never rests after a move.
    pub transient: Vec<Option<Transient>>,
    /// Seconds in which at least one command is at a limit or moves as fast as it may.
    pub at_limits_s: f64,
}

impl Judged {
    fn of(run: &Run, task: &ControlProblem) -> Self {
        let outputs = 0..task.outputs.len();
        let judged = task.judged_s.map(|[from, to]| run.between(from, to));
        let judged = judged.as_ref().unwrap_or(run);
        Self {
            score: Score {
                // Limits hold from the first command to the last.
                outside_limits: run.score(&task.limits).outside_limits,
                ..judged.score(&task.limits)
            },
            distance: task.one_unit.then(|| judged.distance()),
            transient: outputs
                .map(|i| judged.transient(i, task.period_s, task.preview()))
                .collect(),
            at_limits_s: judged.at_limits_s(&task.limits, task.period_s),
        }
    }
}

/// One controller and its loops.
#[derive(Clone, Debug, Serialize)]
pub struct ControllerResult {
    /// `PID`, `RISE`, or what its model's folder is called.
    pub name: String,
    /// Each of its loops.
    pub loops: Vec<Judged>,
    /// Instructions of a control step over all loops; null where the board does not count them.
    pub instructions_per_step: Option<Spread>,
    /// The image on the board by its sections; null on the host.
    pub image: Option<Sizes>,
    /// Weights and biases; null without a model.
    pub parameters: Option<usize>,
    /// Every command of the board had the bits of the host's; null where the host is the board.
    pub host_equals_device: Option<bool>,
    /// Its first loop, for plots.
    #[serde(skip)]
    pub first: Run,
}

impl ControllerResult {
    /// A controller on this computer.
    ///
    /// # Errors
    /// No loop.
    pub fn new(name: impl Into<String>, runs: Vec<Run>, task: &ControlProblem) -> Result<Self> {
        let loops = runs.iter().map(|run| Judged::of(run, task)).collect();
        let first = runs.into_iter().next();
        Ok(Self {
            name: name.into(),
            loops,
            instructions_per_step: None,
            image: None,
            parameters: None,
            host_equals_device: None,
            first: first.ok_or_else(|| Error::failed("no loop was run"))?,
        })
    }

    /// A predictive controller: its loops on this computer, and on the board where that is another.
    ///
    /// # Errors
    /// No loop, or other bits on the board.
    pub fn mpc(
        name: String,
        loops: Vec<DeviceRun>,
        board: Option<&BoardRuns>,
        task: &ControlProblem,
    ) -> Result<Self> {
        let image = board.and_then(|board| board.image);
        let board = board.map(|board| &board.runs);
        let equal = board.map(|board| {
            let pairs = board.iter().zip(&loops);
            let mut same = pairs.map(|(a, b)| same_bits(&a.answers, &b.answers));
            board.len() == loops.len() && same.all(|same| same)
        });
        if equal == Some(false) {
            return Err(Error::failed(format!(
                "{name}: the board and this computer give different commands"
            )));
        }
        let answers = board.map(|board| board.iter().flat_map(|run| run.answers.clone()));
        let counted = answers.map(|all| instructions(&all.collect::<Vec<_>>()));
        let runs = loops.into_iter().map(|run| run.run).collect();
        Ok(Self {
            instructions_per_step: counted,
            host_equals_device: equal,
            image,
            ..Self::new(name, runs, task)?
        })
    }

    /// Median and largest over the loops of what `of` takes from each.
    pub fn over(&self, of: impl Fn(&Judged) -> f64) -> (f64, f64) {
        let mut values: Vec<f64> = self.loops.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        let at = |i: usize| values.get(i).copied().unwrap_or(f64::NAN);
        let last = values.len().saturating_sub(1);
        (at(last / 2), at(last))
    }

    /// Median and largest over the loops of the root mean square error of output `i`.
    pub fn rms(&self, i: usize) -> (f64, f64) {
        self.over(|of| of.score.rms[i])
    }

    /// Overshoot and settling of output `i`, the worst over the loops.
    pub fn transient(&self, i: usize) -> Option<Transient> {
        let all = self.loops.iter().filter_map(|of| of.transient[i]);
        all.reduce(Transient::worse)
    }
}
