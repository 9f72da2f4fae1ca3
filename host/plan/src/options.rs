//! Settings of a plan.

use sinew_ident::error::{Error, Result};
use sinew_ident::recording::Recording;
use sinew_ident::report::exact;

use crate::goal::Goal;

/// Most rows of a plan.
const MOST_ROWS: f64 = 1e5;

/// Settings of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Samples a second.
    pub rate_hz: f64,
    /// Duration, s; without it that of the last goal or of the path.
    pub seconds: Option<f64>,
    /// Weight of effort and of change beside squared misses.
    pub effort: f64,
    /// Seed of the samples.
    pub seed: u64,
    /// Simulations at most, in plain ones ([`crate::Count::equivalent`]).
    pub simulations: usize,
    /// Coarse commands that are tried before any gradient.
    pub samples: usize,
    /// Knots of each input.
    pub knots: usize,
    /// Largest miss of a goal that counts as reached, as a part of the distance to go.
    pub tolerance: f64,
    /// Most sub-steps in one sample interval, as [`sinew_sim::SimulationSettings::max_substeps`].
    pub max_substeps: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            rate_hz: 120.0,
            seconds: None,
            effort: 1e-3,
            seed: 1,
            simulations: 300,
            samples: 40,
            knots: 24,
            tolerance: 0.01,
            max_substeps: 1 << 12,
        }
    }
}

impl Options {
    /// Times of the rows: as far as asked, else to the last goal.
    ///
    /// # Errors
    /// `Arguments` for a number out of its range, and for a goal beyond the end.
    pub(crate) fn times(&self, goals: &[Goal], path: Option<&Recording>) -> Result<Vec<f64>> {
        let positive = |flag: &str, value: f64, example: &str| {
            if value.is_finite() && value > 0.0 {
                return Ok(());
            }
            Err(Error::must_be(flag, "more than 0", exact(value))
                .help(format!("for example {example}")))
        };
        positive("--rate", self.rate_hz, "--rate 120")?;
        positive("--seconds", self.seconds.unwrap_or(1.0), "--seconds 2")?;
        positive("--effort", self.effort, "--effort 0.001")?;
        positive("--tolerance", self.tolerance, "--tolerance 0.01")?;
        let end = |path: &Recording| path.t()[path.len() - 1];
        let goal = goals.iter().map(|goal| goal.time_s).fold(0.0, f64::max);
        let path = path.map_or(0.0, end);
        let seconds = self.seconds.unwrap_or(goal.max(path));
        if let Some(late) = goals.iter().find(|goal| goal.time_s > seconds) {
            let expectation = format!("a time up to the horizon, {} s", exact(seconds));
            return Err(Error::must_be("--goal", expectation, format!("`{late}`"))
                .help("give the plan more time with --seconds, or the goal an earlier time"));
        }
        let rows = (seconds * self.rate_hz).round();
        if !(2.0..=MOST_ROWS).contains(&rows) {
            let [least, most] = [2.0, MOST_ROWS].map(|rows| exact(rows / self.rate_hz));
            let expectation = format!("{least} to {most} s at {} Hz", exact(self.rate_hz));
            return Err(Error::must_be("the horizon", expectation, exact(seconds))
                .help("set it with --seconds, or the rows a second with --rate"));
        }
        Ok((0..=rows as usize)
            .map(|row| row as f64 / self.rate_hz)
            .collect())
    }
}
