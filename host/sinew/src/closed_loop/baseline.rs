//! Baseline controllers, without a model: the firmware's own code, and how any of them is tuned.

use rayon::prelude::*;
use sinew_mpc::feedback::{Feedback, Law};
use sinew_mpc::limits::Limits;

use crate::closed_loop::reference::Reference;
use crate::closed_loop::scenario::{Controller, InputLimits, Run, Scenario};
use crate::tuning::objective::Objective;
use crate::tuning::optimise::{Budget, Found, Range, search};
use sinew_ident::error::{Error, Result};

/// A law that can be tuned: what is searched, where, and what a point of the search means.
pub trait BaselineController: Law<Gains: Send + Sync> + Send + Sync {
    /// As it stands in tables.
    const NAME: &'static str;
    /// One range a setting, the lead left out.
    fn ranges() -> Vec<Range>;
    /// Starts of the search; settings as in [`BaselineController::ranges`].
    fn starts() -> Vec<Vec<f64>>;
    /// The gains of settings `g`; half the ranges of input and output.
    fn gains(g: &[f64], ranges: (f64, f64), period_s: f64) -> Self::Gains;
    /// The gains by name, physical units.
    fn named(gains: &Self::Gains) -> Vec<(&'static str, f64)>;
}

/// Gains of one channel and how many steps ahead it looks at the reference: the preview that the
/// predictive controller has is not withheld from these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tuning<G> {
    /// Gains in physical units.
    pub gains: G,
    /// Steps ahead.
    pub lead: usize,
}

/// One controller a pair of output and input.
pub struct FeedbackController<L: Law> {
    channels: Vec<(Feedback<L, 1>, usize)>,
}

/// Samples that a command is held through before it goes to the safe one.
const GAP_LIMIT: u16 = 10;

impl<L: Law> FeedbackController<L> {
    /// A controller at rest at the command nearest to zero.
    pub fn new(tuning: &[Tuning<L::Gains>], limits: &[InputLimits], period_s: f64) -> Self {
        let channels = tuning
            .iter()
            .zip(limits)
            .map(|(tuning, (low, high, change))| {
                let limits = Limits {
                    lower: [*low as f32],
                    upper: [*high as f32],
                    rate: [inwards(*change)],
                    safe: [0.0_f64.clamp(*low, *high) as f32],
                };
                (
                    Feedback::new([tuning.gains], period_s as f32, limits, GAP_LIMIT),
                    tuning.lead,
                )
            });
        Self {
            channels: channels.collect(),
        }
    }
}

/// The largest f32 that does not exceed `value`.
fn inwards(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) > value {
        near.next_down()
    } else {
        near
    }
}

impl<L: Law> Controller for FeedbackController<L> {
    fn command(
        &mut self,
        k: usize,
        y: &[f64],
        _: &[f64],
        reference: &Reference,
    ) -> Result<Vec<f64>> {
        let channels = self.channels.iter_mut().zip(y).enumerate();
        let commands = channels.map(|(i, ((law, lead), y))| {
            let asked = reference.row(k + *lead)[i] as f32;
            f64::from(law.step(&[*y as f32], &[asked])[0])
        });
        Ok(commands.collect())
    }
}

/// Objective and training loops of a tuning: loops whose references no result is reported on.
#[derive(Clone, Copy)]
pub struct Training<'a> {
    /// The loops.
    pub scenarios: &'a [Scenario],
    /// Of every input.
    pub limits: &'a [InputLimits],
    /// Half the range of every output.
    pub output_range: &'a [f64],
    /// Half the range of every input.
    pub input_range: &'a [f64],
    /// Objective that is minimised.
    pub objective: Objective,
    /// Most steps that a controller may look ahead.
    pub longest_lead: usize,
}

impl Training<'_> {
    /// The cost over all loops.
    ///
    /// # Errors
    /// Of the first loop that failed.
    pub fn cost(&self, run: impl Fn(&Scenario) -> Result<Run> + Sync) -> Result<f64> {
        let costs = self.scenarios.par_iter().map(|scenario| {
            let score = run(scenario)?.score(self.limits);
            Ok(self
                .objective
                .cost(&score, self.output_range, self.input_range))
        });
        // Collected before they are added, so that the sum does not depend on which ended first.
        Ok(costs.collect::<Result<Vec<f64>>>()?.into_iter().sum())
    }

    fn period_s(&self) -> f64 {
        self.scenarios.first().map_or(1.0, |s| s.period_s)
    }

    /// The cost of gains; infinite where a plant diverges under them.
    pub fn cost_of<L: BaselineController>(&self, tuning: &[Tuning<L::Gains>]) -> f64 {
        let run = |scenario: &Scenario| {
            let mut controller = FeedbackController::<L>::new(tuning, self.limits, self.period_s());
            scenario.run(&mut controller)
        };
        self.cost(run).unwrap_or(f64::INFINITY)
    }
}

/// Gains before and after a search.
pub struct Tuned<G> {
    /// Those of the cheapest start.
    pub before: Vec<Tuning<G>>,
    /// The cheapest found.
    pub after: Vec<Tuning<G>>,
    /// Statistics of the search.
    pub found: Found,
}

/// Steps of preview that a search begins with: a simplex hardly moves a whole number.
const LEADS: [usize; 3] = [1, 3, 5];

/// Starts of the search of a law: each of its starts with each preview that is no longer than
/// `longest`; with none, each as it is.
fn starts<L: BaselineController>(longest: usize) -> Vec<Vec<f64>> {
    if longest == 0 {
        return L::starts();
    }
    let leads = LEADS.into_iter().filter(|lead| *lead <= longest);
    let with = |lead: usize| {
        L::starts().into_iter().map(move |mut start| {
            start.push(lead as f64);
            start
        })
    };
    leads.flat_map(with).collect()
}

/// Tunes one controller a channel; all channels share one scale of gains. Where there are more
/// outputs than inputs, the first ones have an input each and the others are only scored. `told`
/// hears of every evaluation.
///
/// # Errors
/// A rig with fewer outputs than inputs.
pub fn tune<L: BaselineController>(
    training: &Training<'_>,
    budget: Budget,
    told: &(dyn Fn() + Sync),
) -> Result<Tuned<L::Gains>> {
    let (inputs, outputs) = (training.limits.len(), training.output_range.len());
    if inputs > outputs {
        return Err(Error::failed(format!(
            "a {} needs an output for every input, and this rig has {outputs} for {inputs}",
            L::NAME
        )));
    }
    let mut ranges = L::ranges();
    let settings = ranges.len();
    let longest = training.longest_lead;
    if longest > 0 {
        ranges.push(Range::whole(0.0, longest as f64));
    }
    let starts = starts::<L>(longest);
    let of = |g: &[f64]| -> Vec<Tuning<L::Gains>> {
        let (g, lead) = g.split_at(settings);
        let lead = lead.first().copied().unwrap_or(0.0);
        let units = training.input_range.iter().zip(training.output_range);
        let tunings = units.map(|(input, output)| Tuning {
            gains: L::gains(g, (*input, *output), training.period_s()),
            lead: lead as usize,
        });
        tunings.collect()
    };
    let found = search(&ranges, &starts, budget, |g| {
        told();
        training.cost_of::<L>(&of(g))
    });
    Ok(Tuned {
        before: of(&found.start),
        after: of(&found.best),
        found,
    })
}

#[cfg(test)]
mod tests {
    use sinew_mpc::feedback::pid::PidState;
    use sinew_mpc::feedback::rise::RiseState;

    use super::*;

    fn begins_inside<L: BaselineController>() {
        let all = starts::<L>(4);
        assert_eq!(all.len(), 2 * L::starts().len());
        let leads = |lead: f64| {
            all.iter()
                .filter(|start| start.last() == Some(&lead))
                .count()
        };
        assert_eq!(leads(1.0), leads(3.0));
        // Without a preview there is no setting for one.
        assert_eq!(starts::<L>(0), L::starts());
        // Every setting strictly inside its range, so that a simplex has room on both sides.
        for start in L::starts() {
            assert_eq!(start.len(), L::ranges().len());
            for (value, range) in start.iter().zip(L::ranges()) {
                assert!(
                    range.low < *value && *value < range.high,
                    "{value} of {range:?}"
                );
            }
        }
    }

    #[test]
    fn baselines_begin_inside_their_ranges_with_short_and_long_previews() {
        begins_inside::<PidState>();
        begins_inside::<RiseState>();
    }
}
