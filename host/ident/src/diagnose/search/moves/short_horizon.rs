//! From short stretches to long ones: over a few dozen rows the linear theory holds for strong effects too, and what
//! begins near the truth stays there as stretches are joined (docs/explanation/diagnosis.md, "Moves").

use rayon::prelude::*;
use sinew_sim::{Plant, Rig};

use crate::diagnose::candidate::{Candidate, Trial, merit};
use crate::diagnose::case::Case;
use crate::diagnose::data::Starts;
use crate::diagnose::model::Model;
use crate::diagnose::pool::{Pool, Proposal, Selection, ShortHorizon};
use crate::diagnose::search::context::{Context, Move};
use crate::diagnose::search::halving::{HEAT, MORE_STEPS};
use crate::diagnose::search::refit::{refit_best, screened};
use crate::diagnose::search::subset::{Subset, cut_subset};
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::fit::levenberg::Unknowns;

/// Screens every term over short intervals and follows the best to longer ones.
pub(crate) struct ShortIntervals;

impl Move for ShortIntervals {
    fn name(&self) -> &'static str {
        "short horizon"
    }

    fn applies(&self, context: &Context, pool: &Pool) -> bool {
        !pool.is_explained_plainly(context.case)
    }

    fn propose(&self, context: &Context, _pool: &Pool) -> Result<Option<Proposal>> {
        let Context {
            case,
            subset,
            rig,
            terms,
            ..
        } = context;
        let (candidates, short) = on_short_intervals(case, subset, rig, terms)?;
        Ok(Some(Proposal {
            candidates,
            short: Some(short),
            undivided: false,
        }))
    }

    fn selection(&self) -> Selection {
        Selection::Best
    }
}

/// Pieces that a stretch of the track is cut into, from rung to rung, and the fewest rows of one.
const RUNGS: [usize; 2] = [4, 2];

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

/// A race of one effect on pieces of the track, its best taken rung by rung to all of it and fitted to everything;
/// and the race as it ended on the pieces.
pub(crate) fn on_short_intervals(
    case: &Case,
    subset: &Subset,
    rig: &Rig,
    all: &[Term],
) -> Result<(Vec<Candidate>, ShortHorizon)> {
    let written = Plant::new(case.written)?;
    let model = Model::new(rig, case.written, &[], subset.settings)?;
    let values = model.inherit(&written, &written.values());
    let below = cut_subset(subset, RUNGS[0]);
    let Some(parent) = below.first(rig, &values, 15)? else {
        return Ok((Vec::new(), ShortHorizon::default()));
    };
    let singles = screened(case, &below, &parent, all, ONE)?;
    let finals = lengthened(case, subset, below, singles.clone(), ONE)?;
    let parent = Some(parent);
    Ok((finals, ShortHorizon { parent, singles }))
}

/// Two effects on pieces of the track: on top of what was best there alone, then on top of the newcomers of the best
/// pairs, for what was best alone had to explain what the other does as well. `None` where no second effect does
/// anything that is worth looking for; what is best on longer stretches, the `leader`, has its turn before.
pub(crate) fn pairs_on_short_intervals(
    case: &Case,
    subset: &Subset,
    short: &ShortHorizon,
    leader: Option<&Term>,
    all: &[Term],
) -> Result<Option<Vec<Candidate>>> {
    let below = cut_subset(subset, RUNGS[0]);
    let Some(bare) = &short.parent else {
        return Ok(Some(Vec::new()));
    };
    let noise = 0.5 * below.samples();
    let beside = |trial: &Trial| trial.point.cost - noise;
    let mut parents: Vec<Trial> = (short.singles.iter().enumerate())
        .filter(|(rank, trial)| matches!(&trial.terms[..], [one] if one.may_lead(*rank)))
        .map(|(_, trial)| trial)
        .filter(|trial| trial.point.cost < HOPELESS * bare.point.cost)
        .take(PARENTS)
        .cloned()
        .collect();
    let mut pairs: Vec<Trial> = Vec::new();
    let mut raced = 0;
    while raced < parents.len() {
        let parent = &parents[raced];
        raced += 1;
        let second = |term: &&Term| term.may_join(&parent.terms);
        let rest: Vec<Term> = all.iter().filter(second).cloned().collect();
        pairs.extend(screened(case, &below, parent, &rest, TWO)?);
        pairs.sort_by(|a, b| merit(a).total_cmp(&merit(b)));
        let least = |all: &[Trial]| all.iter().map(beside).fold(f64::INFINITY, f64::min);
        let (single, pair) = (least(&parents), least(&pairs));
        let in_vain = IN_VAIN.get(raced - 1).map(|part| part * single);
        let led = raced >= PARENTS || (leader.iter()).all(|one| parents[0].terms[0] == **one);
        if led && single > noise && in_vain.is_some_and(|most| pair > most) {
            return Ok(None);
        }
        let hopeful = pairs
            .first()
            .is_some_and(|best| beside(best) < HOPEFUL * beside(bare));
        if hopeful && raced == parents.len() && raced < PARENTS + EXCHANGES {
            let known = |term: &Term| parents.iter().any(|p| p.terms[0] == *term);
            let newcomers = pairs.iter().filter_map(|pair| {
                let fresh = pair.terms.iter().find(|term| !known(term));
                fresh.map(|fresh| (pair, fresh))
            });
            // A softening spring without the load that it carries falls over: then the next one.
            for (pair, fresh) in newcomers {
                let single = |trial: &&Trial| trial.terms[0] == *fresh;
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
    let mut kept: Vec<Trial> = Vec::new();
    for pair in pairs {
        let same = |other: &Trial| pair.terms.iter().all(|s| other.terms.contains(s));
        if kept.len() < HEAT && !kept.iter().any(same) {
            kept.push(pair);
        }
    }
    lengthened(case, subset, below, kept, TWO).map(Some)
}

/// From rung to rung, and the finals.
fn lengthened<'a>(
    case: &Case,
    subset: &Subset<'a>,
    mut below: Subset<'a>,
    mut trial: Vec<Trial>,
    what: &str,
) -> Result<Vec<Candidate>> {
    for pieces in RUNGS[1..].iter().copied().chain([1]) {
        let above = cut_subset(subset, pieces);
        let count = case.progress_of(what).count("joined", trial.len());
        trial = trial
            .into_par_iter()
            .filter_map(|trial| {
                let taken = lengthened_to(&above, &below, trial).ok().flatten();
                count.one();
                taken
            })
            .collect();
        below = above;
    }
    trial.sort_by(|a, b| merit(a).total_cmp(&merit(b)));
    refit_best(case, subset, &trial, what)
}

/// What was fitted to the track `below`, a few steps further on this one. Stretches that begin where one of its
/// did begin with the state that was found there.
pub(crate) fn lengthened_to(
    subset: &Subset,
    below: &Subset,
    trial: Trial,
) -> Result<Option<Trial>> {
    let model = &trial.model;
    let values = trial.point.values.clone();
    let segments = subset.data.segments(&model.plant, &subset.intervals)?;
    let found = Starts {
        data: below.data,
        intervals: &below.intervals,
        states: &trial.point.states,
    };
    let states = (subset.data).carried((&model.rig, &model.plant), &values, &segments, found)?;
    let from = Unknowns { values, states };
    Ok(subset.improved(trial.terms.clone(), model.clone(), from, MORE_STEPS))
}
