//! Objectives of the tuning.

use crate::closed_loop::scenario::Score;

/// Weight of the command's change where it only keeps a controller from chattering for nothing.
pub const EFFORT: f64 = 1e-5;
/// The same where a smooth command is worth some accuracy.
const SMOOTH: f64 = 1e-2;

/// A choice of cost, summed over outputs and inputs in units of half their ranges
/// (docs/explanation/comparison.md, eq. 3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Objective {
    /// Mean square error, and 1e-5 of the mean square change of the command.
    #[default]
    Tracking,
    /// Mean square error, and 1e-2 of the mean square change of the command.
    Smooth,
    /// Square of the largest error, and 1e-5 of the mean square change of the command.
    Peak,
}

impl Objective {
    /// The cost of a run.
    pub fn cost(self, score: &Score, output_range: &[f64], input_range: &[f64]) -> f64 {
        let square = |values: &[f64], ranges: &[f64]| -> f64 {
            let parts = values.iter().zip(ranges);
            parts.map(|(v, r)| (v / r).powi(2)).sum()
        };
        let errors = match self {
            Self::Tracking | Self::Smooth => &score.rms,
            Self::Peak => &score.max,
        };
        square(errors, output_range) + self.effort() * square(&score.effort, input_range)
    }

    /// Weight of the mean square change of the command.
    pub const fn effort(self) -> f64 {
        match self {
            Self::Tracking | Self::Peak => EFFORT,
            Self::Smooth => SMOOTH,
        }
    }

    /// As it is written on a command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tracking => "tracking",
            Self::Smooth => "smooth",
            Self::Peak => "peak",
        }
    }
}
