//! From short stretches to long ones: over a few dozen rows the linear theory holds for strong effects too, and what
//! begins near the truth stays there as stretches are joined (docs/explanation/diagnosis.md, "Short stretches").

use std::ops::Range;

use rayon::prelude::*;
use sinew_sim::{Plant, Rig};

use super::data::Starts;
use super::evidence::Contender;
use super::model::Model;
use super::race::{HEAT, MORE_STEPS, Track, Tried, merit};
use super::search::Bench;
use super::suspect::Suspect;
use crate::error::Result;
use crate::fit::levenberg::Unknowns;

/// Pieces that a stretch of the track is cut into, from rung to rung, and the fewest rows of one.
const RUNGS: [usize; 2] = [4, 2];
const PIECE_ROWS: usize = 25;

/// How many of a race on short stretches a second effect is looked for on top of; what leaves more than this part of
/// the cost is none of them.
const PARENTS: usize = 2;
const HOPELESS: f64 = 0.9;

/// How many newcomers of the best pairs are looked for a second effect on, too.
const EXCHANGES: usize = 2;

/// They are where the best pair leaves no more than this part of what there was beside the noise.
const HOPEFUL: f64 = 0.3;

/// There is no second effect where the best pair, after one parent and after two, leaves more than these parts of what
/// the best single one leaves beside the noise: of true pairs none left more than 0.42 and 0.40.
const IN_VAIN: [f64; 2] = [0.65, 0.5];

/// What these races are called.
const ONE: &str = "one effect, short stretches";
const TWO: &str = "two effects, short stretches";

/// A race on short stretches: the believed rig there, and what it was raced with, best first.
#[derive(Default)]
pub(super) struct Short {
    parent: Option<Tried>,
    singles: Vec<Tried>,
}

impl Bench<'_> {
    /// A race of one effect on pieces of the track, its best taken rung by rung to all of it and fitted to everything;
    /// and the race as it ended on the pieces.
    pub fn climb(
        &self,
        track: &Track,
        rig: &Rig,
        all: &[Suspect],
    ) -> Result<(Vec<Contender>, Short)> {
        let written = Plant::new(self.written)?;
        let model = Model::new(rig, self.written, &[], track.settings)?;
        let values = model.inherit(&written, &written.values());
        let below = track.pieces(RUNGS[0]);
        let Some(parent) = below.first(rig, &values, 15)? else {
            return Ok((Vec::new(), Short::default()));
        };
        let singles = self.raced(&below, &parent, all, ONE)?;
        let finals = self.up(track, below, singles.clone(), ONE)?;
        let parent = Some(parent);
        Ok((finals, Short { parent, singles }))
    }

    /// Two effects on pieces of the track: on top of what was best there alone, then on top of the newcomers of the best
    /// pairs, for what was best alone had to explain what the other does as well. `None` where no second effect does
    /// anything that is worth looking for; what is best on longer stretches, the `leader`, has its turn before.
    pub fn climb_twice(
        &self,
        track: &Track,
        short: &Short,
        leader: Option<&Suspect>,
        all: &[Suspect],
    ) -> Result<Option<Vec<Contender>>> {
        let below = track.pieces(RUNGS[0]);
        let Some(bare) = &short.parent else {
            return Ok(Some(Vec::new()));
        };
        let noise = 0.5 * below.samples();
        let beside = |tried: &Tried| tried.point.cost - noise;
        let mut parents: Vec<Tried> = (short.singles.iter().enumerate())
            .filter(|(rank, tried)| matches!(&tried.suspects[..], [one] if one.may_lead(*rank)))
            .map(|(_, tried)| tried)
            .filter(|tried| tried.point.cost < HOPELESS * bare.point.cost)
            .take(PARENTS)
            .cloned()
            .collect();
        let mut pairs: Vec<Tried> = Vec::new();
        let mut raced = 0;
        while raced < parents.len() {
            let parent = &parents[raced];
            raced += 1;
            let second = |suspect: &&Suspect| suspect.may_join(&parent.suspects);
            let rest: Vec<Suspect> = all.iter().filter(second).cloned().collect();
            pairs.extend(self.raced(&below, parent, &rest, TWO)?);
            pairs.sort_by(|a, b| merit(a).total_cmp(&merit(b)));
            let least = |all: &[Tried]| all.iter().map(beside).fold(f64::INFINITY, f64::min);
            let (single, pair) = (least(&parents), least(&pairs));
            let in_vain = IN_VAIN.get(raced - 1).map(|part| part * single);
            let led =
                raced >= PARENTS || (leader.iter()).all(|one| parents[0].suspects[0] == **one);
            if led && single > noise && in_vain.is_some_and(|most| pair > most) {
                return Ok(None);
            }
            let hopeful = pairs
                .first()
                .is_some_and(|best| beside(best) < HOPEFUL * beside(bare));
            if hopeful && raced == parents.len() && raced < PARENTS + EXCHANGES {
                let known = |suspect: &Suspect| parents.iter().any(|p| p.suspects[0] == *suspect);
                let newcomers = pairs.iter().filter_map(|pair| {
                    let fresh = pair.suspects.iter().find(|suspect| !known(suspect));
                    fresh.map(|fresh| (pair, fresh))
                });
                // A softening spring without the load that it carries falls over: then the next one.
                for (pair, fresh) in newcomers {
                    let single = |tried: &&Tried| tried.suspects[0] == *fresh;
                    let alone = match short.singles.iter().find(single) {
                        Some(alone) => Some(alone.clone()),
                        None => below.alone(bare, pair, fresh, MORE_STEPS)?,
                    };
                    if let Some(alone) = alone {
                        parents.push(alone);
                        break;
                    }
                }
            }
        }
        let mut kept: Vec<Tried> = Vec::new();
        for pair in pairs {
            let same = |other: &Tried| pair.suspects.iter().all(|s| other.suspects.contains(s));
            if kept.len() < HEAT && !kept.iter().any(same) {
                kept.push(pair);
            }
        }
        self.up(track, below, kept, TWO).map(Some)
    }

    /// From rung to rung, and the finals.
    fn up<'a>(
        &self,
        track: &Track<'a>,
        mut below: Track<'a>,
        mut tried: Vec<Tried>,
        what: &str,
    ) -> Result<Vec<Contender>> {
        for pieces in RUNGS[1..].iter().copied().chain([1]) {
            let above = track.pieces(pieces);
            let leg = self.doing(what).leg("joined", tried.len());
            tried = tried
                .into_par_iter()
                .filter_map(|tried| {
                    let taken = above.taken(&below, tried).ok().flatten();
                    leg.one();
                    taken
                })
                .collect();
            below = above;
        }
        tried.sort_by(|a, b| merit(a).total_cmp(&merit(b)));
        self.finals(track, &tried, what)
    }
}

impl<'a> Track<'a> {
    /// The same rows, each stretch in that many pieces.
    fn pieces(&self, pieces: usize) -> Track<'a> {
        self.on(pieces_of(&self.stretches, pieces))
    }

    /// What was fitted to the track `below`, a few steps further on this one. Stretches that begin where one of its
    /// did begin with the state that was found there.
    pub fn taken(&self, below: &Track, tried: Tried) -> Result<Option<Tried>> {
        let model = &tried.model;
        let values = tried.point.values.clone();
        let segments = self.data.segments(&model.plant, &self.stretches)?;
        let found = Starts {
            data: below.data,
            stretches: &below.stretches,
            states: &tried.point.states,
        };
        let states = (self.data).carried((&model.rig, &model.plant), &values, &segments, found)?;
        let from = Unknowns { values, states };
        Ok(self.improved(tried.suspects.clone(), model.clone(), from, MORE_STEPS))
    }
}

/// Each stretch in that many pieces, or as many as it has rows for.
pub(super) fn pieces_of(
    stretches: &[(usize, Range<usize>)],
    pieces: usize,
) -> Vec<(usize, Range<usize>)> {
    let cut = |(index, rows): &(usize, Range<usize>)| {
        let (index, rows) = (*index, rows.clone());
        let count = pieces.min(rows.len() / PIECE_ROWS).max(1);
        (0..count).map(move |k| {
            let at = |k: usize| rows.start + k * rows.len() / count;
            (index, at(k)..at(k + 1))
        })
    };
    stretches.iter().flat_map(cut).collect()
}
