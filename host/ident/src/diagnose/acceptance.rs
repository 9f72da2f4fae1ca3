//! What is believed, of what finals found (docs/explanation/diagnosis.md, eq. 4 and 7).

use std::collections::BTreeMap;

use sinew_sim::effects::Family;
use sinew_sim::{Rig, Settings};

use crate::diagnose::calibration::{SAME, apart};
use crate::diagnose::candidate::Term;
use crate::diagnose::data::Data;
use crate::diagnose::evidence::{Candidate, Comparison, Gain};
use crate::diagnose::model::Model;
use crate::diagnose::residuals::Residuals;
use crate::diagnose::search::{Case, FINAL_STEPS, Found};
use crate::error::Result;
use crate::fit::levenberg::Unknowns;

/// What is believed leaves no more than this part of the squares that the base leaves beside noise.
const MOST_LEFT: f64 = 0.4;

/// The same of a coordinate that nobody sees: behind a controller, a resonance follows any disturbance of
/// one frequency through the command. What was named rightly on seeds 2033 and 2034 left less than a thousandth, a sine that
/// was called a mode a fiftieth.
const MOST_LEFT_OF_MODE: f64 = 0.005;

/// What an effect removes, in units of the noise, from where on nobody asks for a second witness.
const LARGE: f64 = 1.0;

/// An effect at one component is named instead of at all that are alike where it is this part as probable.
const ENOUGH: f64 = 0.1;

/// Half-widths of a 95 % interval that some parameter of an effect is away from zero: three standard deviations.
const CERTAIN: f64 = 1.5;

impl Case<'_> {
    /// Whether an explanation leaves something that noise does not explain and that matters.
    pub fn leaves_something(&self, candidate: &Candidate) -> bool {
        stands_out(&candidate.fit, self.fit) || stands_out(&candidate.check, self.check)
    }

    /// Whether the search ended with the believed rig, which leaves nothing that noise does not explain.
    pub fn nothing_in(&self, found: &Found) -> bool {
        found.chosen.is_none() && !self.leaves_something(&found.base)
    }

    /// Whether the rig as it came leaves nothing but noise.
    ///
    /// # Errors
    /// A rig that cannot be compiled.
    pub fn explains_as_written(&self, rig: &Rig) -> Result<bool> {
        let model = Model::new(rig, rig, &[], Settings::default())?;
        let values = model.plant.values();
        for (data, intervals) in [
            (self.fit, &self.fit_intervals),
            (self.check, &self.check_intervals),
        ] {
            match Residuals::of(&model, &values, data, intervals, None)? {
                Some(residuals) if !stands_out(&residuals, data) => {}
                _ => return Ok(false),
            }
        }
        Ok(true)
    }

    /// Whether the whole of the check recordings, from the start states that explain each best, is left to no more than the part
    /// of what is believed.
    ///
    /// # Errors
    /// A rig that cannot be compiled.
    pub fn runs_through(&self, before: &Rig, after: &Rig) -> Result<bool> {
        let left = |rig: &Rig| -> Result<Option<f64>> {
            let model = Model::new(rig, rig, &[], Settings::default())?;
            let (values, whole) = (model.plant.values(), self.check.cut(1));
            let residuals = Residuals::of(&model, &values, self.check, &whole, None)?;
            Ok(residuals.map(|residuals| beside_noise(&residuals, self.check)))
        };
        let both = left(before)?.zip(left(after)?);
        Ok(both.is_some_and(|(before, after)| after < MOST_LEFT * before))
    }

    /// The part of what `before` left beside noise on the check recordings that `after` still leaves: 0 is all explained.
    pub fn share_left(&self, after: &Candidate, before: &Candidate) -> f64 {
        let left = |candidate: &Candidate| beside_noise(&candidate.check, self.check);
        share(left(after), left(before))
    }

    /// The same on the recordings that they were fitted to.
    pub fn share_fitted(&self, after: &Candidate, before: &Candidate) -> f64 {
        let left = |candidate: &Candidate| beside_noise(&candidate.fit, self.fit);
        share(left(after), left(before))
    }

    /// A gain that counts: sure under resampling, and large enough to matter.
    pub fn believable(&self, gain: Gain, after: &Candidate, before: &Candidate) -> bool {
        let matters = (0..self.check.noise.len()).any(|sensor| {
            let removed = before.check.rms(sensor).powi(2) - after.check.rms(sensor).powi(2);
            removed.max(0.0).sqrt()
                > 0.1 * self.check.noise[sensor] + 1e-3 * self.check.spread[sensor]
        });
        gain.low > 0.0 && matters
    }

    /// Whether every effect has parameters that make sense here.
    fn plausible(&self, candidate: &Candidate) -> bool {
        let (model, values) = (&candidate.trial.model, &candidate.trial.point.values);
        let longest = self
            .fit
            .experiments
            .iter()
            .map(|e| e.t[e.rows() - 1] - e.t[0])
            .fold(0.0, f64::max);
        let mut all = candidate.trial.terms.iter();
        all.all(|term| term.plausible(&model.plant, values, longest))
    }

    /// Parameters of the right sign, and most of what the base left explained: a disturbance can be followed a
    /// little by many an effect, and none of them is its name.
    fn holds(&self, candidate: &Candidate, base: &Candidate) -> bool {
        let most = if candidate.has_mode() {
            MOST_LEFT_OF_MODE
        } else {
            MOST_LEFT
        };
        self.plausible(candidate)
            && self.share_left(candidate, base) < most
            && !self.within_a_step(candidate, base)
            && !self.follows_anything(candidate)
    }

    /// A dozen numbers at components that are alike follow what another mechanism does: they bend the rig out of shape, and
    /// still leave something.
    fn follows_anything(&self, candidate: &Candidate) -> bool {
        let mut terms = candidate.trial.terms.iter();
        terms.any(Term::is_group)
            && candidate.trial.implausible()
            && self.leaves_something(candidate)
    }

    /// A sensor that is bent by less than half a step of its own scale is as straight as that scale.
    fn within_a_step(&self, candidate: &Candidate, base: &Candidate) -> bool {
        let mut terms = candidate.trial.terms.iter();
        terms.any(|term| term.family() == Some(Family::Sensor))
            && (0..self.check.step.len()).all(|sensor| {
                let squares = base.check.rms(sensor).powi(2) - candidate.check.rms(sensor).powi(2);
                squares.max(0.0).sqrt() < 0.5 * self.check.step[sensor]
            })
    }

    /// Whether what an explanation removes from some sensor exceeds the noise.
    pub fn large(&self, candidate: &Candidate, base: &Candidate) -> bool {
        (0..self.check.noise.len()).any(|sensor| {
            let squares = base.check.rms(sensor).powi(2) - candidate.check.rms(sensor).powi(2);
            squares.max(0.0).sqrt() > LARGE * self.check.sigma[sensor]
        })
    }

    /// Whether a small gain holds the other way round too: fitted to the check recordings alone, judged by the
    /// fit recordings, against a rig that was fitted to both. Large gains need no second witness.
    fn holds_both_ways(&self, candidate: &Candidate, base: &Candidate) -> Result<bool> {
        let sensors = 0..self.check.noise.len();
        if self.large(candidate, base) {
            return Ok(true);
        }
        let (model, values) = (&candidate.trial.model, &candidate.trial.point.values);
        let mut segments = self.check.segments(&model.plant, &self.check_intervals)?;
        let states = (self.check).starts(&model.rig, &model.plant, &segments, values)?;
        let from = Unknowns {
            values: values.clone(),
            states,
        };
        let Some(point) = model.improve(self.check, &mut segments, from, FINAL_STEPS, 1e-4) else {
            return Ok(false);
        };
        let swapped = Residuals::of(model, &point.values, self.fit, &self.fit_intervals, None)?;
        Ok(swapped.is_some_and(|swapped| {
            let gains = sensors.map(|s| (base.fit.rms(s) / swapped.rms(s)).ln());
            gains.sum::<f64>() > 0.0
        }))
    }

    /// Indices of finalists by evidence, best first.
    pub fn order(&self, base: &Candidate, finalists: &[Candidate]) -> Vec<usize> {
        let evidence = self.comparison(base, finalists).evidence();
        let mut order: Vec<usize> = (0..finalists.len()).collect();
        order.sort_by(|&a, &b| evidence[b + 1].total_cmp(&evidence[a + 1]));
        order
    }

    /// The base is number 0, finalists follow.
    pub fn comparison(&self, base: &Candidate, finalists: &[Candidate]) -> Comparison {
        let all: Vec<Candidate> = std::iter::once(base).chain(finalists).cloned().collect();
        Comparison::new(&all, &self.check.spread, self.seed)
    }

    /// The best finalist that is believable against the base.
    pub fn best(&self, base: &Candidate, finalists: &[Candidate]) -> Option<usize> {
        let comparison = self.comparison(base, finalists);
        self.order(base, finalists).into_iter().find(|&index| {
            self.believable(comparison.gain(index + 1, 0), &finalists[index], base)
                && self.holds(&finalists[index], base)
                && self
                    .holds_both_ways(&finalists[index], base)
                    .unwrap_or(false)
        })
    }

    /// As [`Bench::best`], but two effects only where they are believable against the best single one. A mode of no size
    /// beside it follows a little of the noise.
    pub fn best_of_sizes(&self, base: &Candidate, finalists: &[Candidate]) -> Option<usize> {
        let comparison = self.comparison(base, finalists);
        let order = self.order(base, finalists);
        let plausible: Vec<usize> = order
            .into_iter()
            .filter(|&index| {
                self.holds(&finalists[index], base)
                    && self.believable(comparison.gain(index + 1, 0), &finalists[index], base)
            })
            .collect();
        let size = |index: usize| finalists[index].trial.terms.len();
        let single = plausible.iter().copied().find(|&index| size(index) == 1);
        let single = single.filter(|&index| {
            self.holds_both_ways(&finalists[index], base)
                .unwrap_or(false)
        });
        let mut pairs = plausible.iter().copied().filter(|&index| size(index) == 2);
        let Some(single) = single else {
            return pairs.next();
        };
        let over = |pair: usize| {
            let (pair_of, single_of) = (&finalists[pair], &finalists[single]);
            self.believable(comparison.gain(pair + 1, single + 1), pair_of, single_of)
                && self.share_left(pair_of, single_of) < MOST_LEFT
                && self.holds_both_ways(pair_of, single_of).unwrap_or(false)
                && (!pair_of.has_mode() || self.has_size(pair_of).unwrap_or(false))
        };
        pairs.next().filter(|&pair| over(pair)).or(Some(single))
    }

    /// Whether each effect is known to be there, by one at least of the parameters that can be zero; where their intervals
    /// are not known it is taken to be, but for a mode: one of which nobody knows how heavy it is, is a damper or a spring that the
    /// rig has. What two that are alike have together may be known and no part of it: two winches
    /// that wind the same joint. Each of them is there where it is known once the others are as found.
    pub fn has_size(&self, candidate: &Candidate) -> Result<bool> {
        let (model, point) = (&candidate.trial.model, &candidate.trial.point);
        let segments = self.fit.segments(&model.plant, &self.fit_intervals)?;
        let widths = |model: &Model| model.half_widths(self.fit, &segments, point);
        let certain = |term: &Term, widths: &BTreeMap<String, f64>, sizes: &[String]| {
            let away = |name: &String| {
                let slot = model.plant.slot(name)?;
                Some(point.values[slot].abs() / widths.get(name)?)
            };
            let farthest = sizes.iter().filter_map(away).reduce(f64::max);
            let unknown = term.family() != Some(Family::Mode);
            farthest.map_or(unknown, |farthest| farthest >= CERTAIN)
        };
        let alone = widths(model);
        let there = |term: &Term| {
            let all = term.sizes();
            let beside = |sizes: &Vec<String>| {
                let mut others = all.iter().filter(|other| *other != sizes).flatten();
                let held = model.holding(|name| others.clone().any(|other| other == name));
                others.next().is_some() && certain(term, &widths(&held), sizes)
            };
            all.iter().all(|sizes| certain(term, &alone, sizes)) || all.iter().all(beside)
        };
        Ok(candidate.trial.terms.iter().all(there))
    }

    /// What is named of the chosen one and its like: of the same motion by two names the simpler, and at one component what need
    /// not be at all that are alike.
    pub fn simplest(&self, base: &Candidate, chosen: usize, finalists: &[Candidate]) -> usize {
        let chosen = self.at_body(chosen, finalists);
        self.at_one(base, chosen, finalists)
    }

    /// Of what is the same motion by two names, the simpler: an effect at a body rather than in a spring that
    /// holds it (contract of the vocabulary).
    fn at_body(&self, chosen: usize, finalists: &[Candidate]) -> usize {
        let best = &finalists[chosen];
        let simpler = |other: &Candidate| {
            let differ = only(best, other).zip(only(other, best));
            differ.is_some_and(|(mine, its)| {
                mine.kind() == its.kind() && !mine.at_body() && its.at_body()
            }) && apart(best, other, self) < SAME
        };
        let other = (0..finalists.len()).find(|&index| simpler(&finalists[index]));
        other.unwrap_or(chosen)
    }

    /// An effect at one component rather than at all that are alike, where it is about as probable.
    fn at_one(&self, base: &Candidate, chosen: usize, finalists: &[Candidate]) -> usize {
        let best = &finalists[chosen];
        let one_of_them = |other: &Candidate| {
            let differ = only(best, other).zip(only(other, best));
            differ.is_some_and(|(mine, its)| mine.says(its)) && self.plausible(other)
        };
        let ones = (0..finalists.len()).filter(|&index| one_of_them(&finalists[index]));
        let ones: Vec<usize> = ones.collect();
        if ones.is_empty() {
            return chosen;
        }
        let probable = self.probabilities(base, finalists, Some(chosen));
        let best = ones
            .into_iter()
            .max_by(|&a, &b| probable[a].total_cmp(&probable[b]));
        best.filter(|&one| probable[one] > ENOUGH * probable[chosen])
            .unwrap_or(chosen)
    }

    /// Shares of the evidence among what is possible here: of the right signs, and of no more effects than
    /// were found to matter.
    pub fn probabilities(
        &self,
        base: &Candidate,
        finalists: &[Candidate],
        chosen: Option<usize>,
    ) -> Vec<f64> {
        let most = chosen.map_or(2, |index| finalists[index].trial.terms.len());
        let possible = |candidate: &Candidate| {
            self.plausible(candidate) && candidate.trial.terms.len() <= most
        };
        let able: Vec<usize> = (0..finalists.len())
            .filter(|&index| possible(&finalists[index]))
            .collect();
        let rivals: Vec<Candidate> = able.iter().map(|&index| finalists[index].clone()).collect();
        let shares = self.comparison(base, &rivals).probabilities().split_off(1);
        let mut all = vec![0.0; finalists.len()];
        for (index, share) in able.into_iter().zip(shares) {
            all[index] = share;
        }
        all
    }
}

/// The one suspect of `a` that `b` has not, if it is one.
pub(crate) fn only<'a>(a: &'a Candidate, b: &Candidate) -> Option<&'a Term> {
    let mut of_a = (a.trial.terms.iter()).filter(|s| !b.trial.terms.contains(s));
    of_a.next().filter(|_| of_a.next().is_none())
}

/// Whether residuals hold something that noise does not explain and that matters.
pub(crate) fn stands_out(residuals: &Residuals, data: &Data) -> bool {
    let mut sensors = residuals.excess(data).into_iter().enumerate();
    sensors.any(|(sensor, e)| {
        let matters = 0.1 * data.noise[sensor] + 1e-3 * data.spread[sensor];
        e.significance > 5.0 && e.rms > matters
    })
}

/// Squares beside noise, of all sensors, each in its spread.
fn beside_noise(residuals: &Residuals, data: &Data) -> f64 {
    let excess = residuals.excess(data).into_iter().enumerate();
    excess.map(|(s, e)| (e.rms / data.spread[s]).powi(2)).sum()
}

/// The part that `after` is of `before`, at most all of it; nothing where there was nothing.
fn share(after: f64, before: f64) -> f64 {
    if before > 0.0 {
        (after / before).min(1.0)
    } else {
        0.0
    }
}
