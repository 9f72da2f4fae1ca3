//! Features of a loop that a person may judge by; less is better of each
//! (docs/explanation/preferences.md).

use sinew_ident::report::{quantity, significant};

use crate::closed_loop::control_problem::ControlProblem;
use crate::closed_loop::scenario::Run;

/// Steps for which a reference that does not change is a rest.
const REST: usize = 20;

/// A feature: its name in tables, and its key in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Feature {
    /// Key in the file of answers.
    pub key: &'static str,
    /// Name for people.
    pub name: &'static str,
    unit: Unit,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Unit {
    /// That of the error: the outputs' own, or a share of their ranges where they have several.
    Error,
    /// A share of the range of the inputs.
    Share,
    Seconds,
    /// Of the move.
    Move,
    /// A share of the range per cubed second.
    Jerk,
}

impl Feature {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 7] = [
        Self::of("rms", "RMS error", Unit::Error),
        Self::of("largest", "largest error", Unit::Error),
        Self::of("at_rest", "error at rest", Unit::Error),
        Self::of("overshoot", "overshoot", Unit::Move),
        Self::of("settling_s", "settling", Unit::Seconds),
        Self::of("command_change", "command change in a step", Unit::Share),
        Self::of("jerk", "jerk", Unit::Jerk),
    ];

    const fn of(key: &'static str, name: &'static str, unit: Unit) -> Self {
        Self { key, name, unit }
    }
}

/// Values of [`Feature::ALL`] of one loop.
#[derive(Clone, Debug, PartialEq)]
pub struct Features(pub Vec<f64>);

impl Features {
    /// Judges a loop. Errors are lengths where the outputs share a unit, and shares of the
    /// workspaces where they do not.
    pub fn of(run: &Run, task: &ControlProblem) -> Self {
        let outputs = task.outputs.len();
        let scale = |i: usize| {
            if outputs == 1 || task.one_unit {
                1.0
            } else {
                1.0 / task.output_range[i]
            }
        };
        let errors: Vec<f64> = (run.y.iter().zip(&run.reference))
            .map(|(y, w)| {
                let parts = (0..outputs).map(|i| (scale(i) * (y[i] - w[i])).powi(2));
                parts.sum::<f64>().sqrt()
            })
            .collect();
        let transients = (0..outputs).map(|i| run.transient(i, task.period_s, task.preview()));
        let transient = transients.flatten().reduce(|a, b| a.worse(b));
        let whole = run.t.len() as f64 * task.period_s;
        let changes = run.u.windows(2).map(|u| {
            let of = |c: usize| ((u[1][c] - u[0][c]) / task.input_range[c]).powi(2);
            (0..task.input_range.len()).map(of).sum::<f64>()
        });
        let jerks = run.y.windows(4).map(|y| {
            let third = |i: usize| y[3][i] - 3.0 * y[2][i] + 3.0 * y[1][i] - y[0][i];
            let of = |i: usize| (third(i) / task.output_range[i] / task.period_s.powi(3)).powi(2);
            (0..outputs).map(of).sum::<f64>()
        });
        Self(vec![
            root_mean(errors.iter().map(|e| e * e)),
            errors.iter().copied().fold(0.0, f64::max),
            root_mean(resting(run, &errors).map(|e| e * e)),
            transient.map_or(0.0, |t| t.overshoot),
            // A loop that does not settle takes as long as it runs.
            transient.map_or(0.0, |t| t.settling_s.unwrap_or(whole)),
            root_mean(changes),
            root_mean(jerks),
        ])
    }

    /// A value as text, in the unit of the outputs.
    pub fn text(&self, index: usize, task: &ControlProblem, unit: &str) -> String {
        let value = self.0[index];
        let percent = |digits| format!("{} %", significant(100.0 * value, digits));
        match Feature::ALL[index].unit {
            Unit::Error if task.outputs.len() == 1 || task.one_unit => quantity(value, unit),
            Unit::Error | Unit::Share => percent(3),
            Unit::Move => format!("{:.1} %", 100.0 * value),
            Unit::Seconds => format!("{} s", significant(value, 3)),
            Unit::Jerk => format!("{} 1/s³", significant(value, 3)),
        }
    }
}

/// Errors at steps before which the reference has rested for a while.
fn resting<'a>(run: &'a Run, errors: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    let mut rested = 0;
    (0..errors.len()).filter_map(move |k| {
        let rests = k > 0 && run.reference[k] == run.reference[k - 1];
        rested = if rests { rested + 1 } else { 0 };
        (rested >= REST).then_some(errors[k])
    })
}

fn root_mean(squares: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = squares.fold((0.0, 0_usize), |(sum, n), s| (sum + s, n + 1));
    (sum / count.max(1) as f64).sqrt()
}
