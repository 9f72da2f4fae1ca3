//! Two effects: which firsts a second one is looked for on, what is exchanged, and what does without
//! (docs/lab/0037-exchange-of-paired-effects.md).

use rayon::prelude::*;

use crate::diagnose::candidate::Term;
use crate::diagnose::data::Starts;
use crate::diagnose::evidence::Candidate;
use crate::diagnose::search::halving::{MORE_STEPS, Subset, Trial};
use crate::diagnose::search::{Case, FINAL_STEPS};
use crate::error::Result;
use crate::fit::levenberg::Unknowns;

/// How many explanations a second effect is looked for on top of.
const BEAM: usize = 2;

/// What leaves more than this part of the squares is no half of a pair.
const HOPELESS: f64 = 0.9;

/// But what leaves less than this part where it was fitted may be one, whatever it does elsewhere without the other half.
const FITTED: f64 = 0.3;

/// Nor what leaves this many times as much as another does; and this many times once a pair explains all.
const BEHIND: f64 = 8.0;
const CLOSE: f64 = 2.0;

/// How often the first of a pair is exchanged: alone, it had to explain what the second does as well.
const EXCHANGES: usize = 2;

/// How many pairs are taken apart, to see whether one effect does it after all.
const HALVED: usize = 3;

impl Case<'_> {
    /// A second effect on top of the best single ones, unless one of the pairs that were found on `short` stretches
    /// explains everything. Once something leaves no more than noise, only what came
    /// close to the best is tried as well. Then the best pair's newcomer is kept and its parent exchanged: once in
    /// any case, for something simpler may do beside it, and again as long as nothing explains all.
    pub fn pairs(
        &self,
        subset: &Subset,
        start: &Trial,
        base: &Candidate,
        singles: &[Candidate],
        short: Vec<Candidate>,
        all: &[Term],
    ) -> Result<Vec<Candidate>> {
        let left = |index: usize| self.share_left(&singles[index], base);
        let order = self.order(base, singles);
        let least = order.iter().map(|&index| left(index)).fold(1.0, f64::min);
        let leads =
            |rank: usize, trial: &Trial| matches!(&trial.terms[..], [one] if one.may_lead(rank));
        let beam = (order.into_iter().enumerate())
            .filter(|&(rank, index)| leads(rank, &singles[index].trial))
            .map(|(_, index)| index)
            .filter(|&index| {
                let fitted = self.share_fitted(&singles[index], base);
                left(index) < HOPELESS.min(BEHIND * least) || fitted < FITTED
            })
            .take(BEAM);
        if short.iter().any(|pair| !self.leaves_something(pair)) {
            return Ok(short);
        }
        let mut parents: Vec<Term> = Vec::new();
        let mut pairs = short;
        for index in beam {
            let done = pairs.iter().any(|pair| !self.leaves_something(pair));
            if done && left(index) > CLOSE * least {
                continue;
            }
            let found = Starts {
                data: self.fit,
                intervals: &self.fit_intervals,
                states: &singles[index].trial.point.states,
            };
            if let Some(parent) = on_track(subset, &singles[index].trial, found)? {
                parents.extend(parent.terms.clone());
                pairs.extend(self.seconds(subset, &parent, all)?);
            }
        }
        for exchange in 0..EXCHANGES {
            if exchange > 0 && pairs.iter().any(|pair| !self.leaves_something(pair)) {
                break;
            }
            let Some(&best) = self.order(base, &pairs).first() else {
                break;
            };
            let pair = &pairs[best].trial;
            let fresh = |term: &&Term| !parents.contains(term);
            let Some(kept) = pair.terms.iter().find(fresh).cloned() else {
                break;
            };
            parents.push(kept.clone());
            if let Some(parent) = subset.alone(start, pair, &kept, MORE_STEPS)? {
                pairs.extend(self.seconds(subset, &parent, all)?);
            }
        }
        Ok(pairs)
    }

    /// The halves of the best pairs, each from where its pair ended: where a single effect was not found because
    /// the way to it was too long, another has paved it.
    pub fn halves(
        &self,
        subset: &Subset,
        start: &Trial,
        base: &Candidate,
        pairs: &[Candidate],
    ) -> Result<Vec<Candidate>> {
        let order = self.order(base, pairs).into_iter().take(HALVED);
        let halves: Vec<(&Trial, &Term)> = order
            .map(|index| &pairs[index].trial)
            .flat_map(|pair| pair.terms.iter().map(move |term| (pair, term)))
            .collect();
        let count = self.doing("halves of pairs").count("fitted", halves.len());
        let alone = halves.into_par_iter().map(|(pair, term)| {
            let half = subset.alone(start, pair, term, MORE_STEPS)?;
            let half = half.map(|half| self.candidate(subset, &half, FINAL_STEPS));
            count.one();
            half.transpose().map(Option::flatten)
        });
        let halves: Vec<Option<Candidate>> = alone.collect::<Result<_>>()?;
        Ok(halves.into_iter().flatten().collect())
    }

    /// Every other effect on top of one.
    fn seconds(&self, subset: &Subset, parent: &Trial, all: &[Term]) -> Result<Vec<Candidate>> {
        let second = |term: &&Term| term.may_join(&parent.terms);
        let rest: Vec<Term> = all.iter().filter(second).cloned().collect();
        // Where the parent explains the whole track, what it lacks lies between the track's stretches.
        let own = match subset.elsewhere(parent)? {
            Some(own) => own,
            None => self.affordable(subset, parent)?,
        };
        if own.intervals == subset.intervals {
            return self.round(subset, parent, &rest, "two effects");
        }
        let found = Starts {
            data: subset.data,
            intervals: &subset.intervals,
            states: &parent.point.states,
        };
        match on_track(&own, parent, found)? {
            Some(parent) => self.round(&own, &parent, &rest, "two effects"),
            None => Ok(Vec::new()),
        }
    }
}

/// What was fitted elsewhere, taken to a track; `found` are its start states there.
fn on_track(subset: &Subset, trial: &Trial, found: Starts) -> Result<Option<Trial>> {
    let model = trial.model.integrated(subset.settings);
    let mut segments = subset.data.segments(&model.plant, &subset.intervals)?;
    let values = trial.point.values.clone();
    let states = (subset.data).along((&model.rig, &model.plant), &values, &segments, found)?;
    let from = Unknowns { values, states };
    let point = model.improve(subset.data, &mut segments, from, 6, 1e-4);
    Ok(point.map(|point| Trial {
        model,
        point,
        ..trial.clone()
    }))
}

/// Of those who hold the same effects, the one that was fitted to the most rows, and of those the one that was fitted best.
pub(crate) fn once(finalists: Vec<Candidate>) -> Vec<Candidate> {
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in finalists {
        let same = |known: &Candidate| {
            let (ours, theirs) = (&candidate.trial.terms, &known.trial.terms);
            ours.len() == theirs.len() && ours.iter().all(|term| theirs.contains(term))
        };
        match kept.iter_mut().find(|known| same(known)) {
            Some(known) if known.all_rows && !candidate.all_rows => {}
            Some(known) if known.trial.point.cost <= candidate.trial.point.cost => {}
            Some(known) => *known = candidate,
            None => kept.push(candidate),
        }
    }
    kept
}
