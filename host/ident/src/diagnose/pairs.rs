//! Two effects: which firsts a second one is looked for on, what is exchanged, and what does without
//! (docs/lab/0037-exchange-of-paired-effects.md).

use rayon::prelude::*;

use super::data::Starts;
use super::evidence::Contender;
use super::race::{MORE_STEPS, Track, Tried};
use super::search::{Bench, FINAL_STEPS};
use super::suspect::Suspect;
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

impl Bench<'_> {
    /// A second effect on top of the best single ones, unless one of the pairs that were found on `short` stretches
    /// explains everything. Once something leaves no more than noise, only what came
    /// close to the best is tried as well. Then the best pair's newcomer is kept and its parent exchanged: once in
    /// any case, for something simpler may do beside it, and again as long as nothing explains all.
    pub fn pairs(
        &self,
        track: &Track,
        start: &Tried,
        base: &Contender,
        singles: &[Contender],
        short: Vec<Contender>,
        all: &[Suspect],
    ) -> Result<Vec<Contender>> {
        let left = |index: usize| self.share_left(&singles[index], base);
        let order = self.order(base, singles);
        let least = order.iter().map(|&index| left(index)).fold(1.0, f64::min);
        let leads =
            |rank: usize, tried: &Tried| matches!(&tried.suspects[..], [one] if one.may_lead(rank));
        let beam = (order.into_iter().enumerate())
            .filter(|&(rank, index)| leads(rank, &singles[index].tried))
            .map(|(_, index)| index)
            .filter(|&index| {
                let fitted = self.share_fitted(&singles[index], base);
                left(index) < HOPELESS.min(BEHIND * least) || fitted < FITTED
            })
            .take(BEAM);
        if short.iter().any(|pair| !self.leaves_something(pair)) {
            return Ok(short);
        }
        let mut parents: Vec<Suspect> = Vec::new();
        let mut pairs = short;
        for index in beam {
            let done = pairs.iter().any(|pair| !self.leaves_something(pair));
            if done && left(index) > CLOSE * least {
                continue;
            }
            let found = Starts {
                data: self.fit,
                stretches: &self.fit_stretches,
                states: &singles[index].tried.point.states,
            };
            if let Some(parent) = on_track(track, &singles[index].tried, found)? {
                parents.extend(parent.suspects.clone());
                pairs.extend(self.seconds(track, &parent, all)?);
            }
        }
        for exchange in 0..EXCHANGES {
            if exchange > 0 && pairs.iter().any(|pair| !self.leaves_something(pair)) {
                break;
            }
            let Some(&best) = self.order(base, &pairs).first() else {
                break;
            };
            let pair = &pairs[best].tried;
            let fresh = |suspect: &&Suspect| !parents.contains(suspect);
            let Some(kept) = pair.suspects.iter().find(fresh).cloned() else {
                break;
            };
            parents.push(kept.clone());
            if let Some(parent) = track.alone(start, pair, &kept, MORE_STEPS)? {
                pairs.extend(self.seconds(track, &parent, all)?);
            }
        }
        Ok(pairs)
    }

    /// The halves of the best pairs, each from where its pair ended: where a single effect was not found because
    /// the way to it was too long, another has paved it.
    pub fn halves(
        &self,
        track: &Track,
        start: &Tried,
        base: &Contender,
        pairs: &[Contender],
    ) -> Result<Vec<Contender>> {
        let order = self.order(base, pairs).into_iter().take(HALVED);
        let halves: Vec<(&Tried, &Suspect)> = order
            .map(|index| &pairs[index].tried)
            .flat_map(|pair| pair.suspects.iter().map(move |suspect| (pair, suspect)))
            .collect();
        let leg = self.doing("halves of pairs").leg("fitted", halves.len());
        let alone = halves.into_par_iter().map(|(pair, suspect)| {
            let half = track.alone(start, pair, suspect, MORE_STEPS)?;
            let half = half.map(|half| self.contender(track, &half, FINAL_STEPS));
            leg.one();
            half.transpose().map(Option::flatten)
        });
        let halves: Vec<Option<Contender>> = alone.collect::<Result<_>>()?;
        Ok(halves.into_iter().flatten().collect())
    }

    /// Every other effect on top of one.
    fn seconds(&self, track: &Track, parent: &Tried, all: &[Suspect]) -> Result<Vec<Contender>> {
        let second = |suspect: &&Suspect| suspect.may_join(&parent.suspects);
        let rest: Vec<Suspect> = all.iter().filter(second).cloned().collect();
        // Where the parent explains the whole track, what it lacks lies between the track's stretches.
        let own = match track.elsewhere(parent)? {
            Some(own) => own,
            None => self.affordable(track, parent)?,
        };
        if own.stretches == track.stretches {
            return self.round(track, parent, &rest, "two effects");
        }
        let found = Starts {
            data: track.data,
            stretches: &track.stretches,
            states: &parent.point.states,
        };
        match on_track(&own, parent, found)? {
            Some(parent) => self.round(&own, &parent, &rest, "two effects"),
            None => Ok(Vec::new()),
        }
    }
}

/// What was fitted elsewhere, taken to a track; `found` are its start states there.
fn on_track(track: &Track, tried: &Tried, found: Starts) -> Result<Option<Tried>> {
    let model = tried.model.integrated(track.settings);
    let mut segments = track.data.segments(&model.plant, &track.stretches)?;
    let values = tried.point.values.clone();
    let states = (track.data).along((&model.rig, &model.plant), &values, &segments, found)?;
    let from = Unknowns { values, states };
    let point = model.improve(track.data, &mut segments, from, 6, 1e-4);
    Ok(point.map(|point| Tried {
        model,
        point,
        ..tried.clone()
    }))
}

/// Of those who hold the same effects, the one that was fitted to the most rows, and of those the one that was fitted best.
pub(super) fn once(finalists: Vec<Contender>) -> Vec<Contender> {
    let mut kept: Vec<Contender> = Vec::new();
    for contender in finalists {
        let same = |known: &Contender| {
            let (ours, theirs) = (&contender.tried.suspects, &known.tried.suspects);
            ours.len() == theirs.len() && ours.iter().all(|suspect| theirs.contains(suspect))
        };
        match kept.iter_mut().find(|known| same(known)) {
            Some(known) if known.all_rows && !contender.all_rows => {}
            Some(known) if known.tried.point.cost <= contender.tried.point.cost => {}
            Some(known) => *known = contender,
            None => kept.push(contender),
        }
    }
    kept
}
