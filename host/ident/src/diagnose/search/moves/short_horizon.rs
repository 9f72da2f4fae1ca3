//! From short intervals to long ones: over a few dozen rows the linear theory holds for strong
//! effects too, and what begins near the truth stays there as stretches are joined
//! (docs/explanation/diagnosis.md, "Moves").

use crate::diagnose::config::CONFIG;
use sinew_sim::{Plant, Rig};

use crate::diagnose::candidate::{Candidate, Trial, merit};
use crate::diagnose::case::Case;
use crate::diagnose::data::Starts;
use crate::diagnose::model::Model;
use crate::diagnose::pool::{Pool, Proposal, Selection, ShortHorizon};
use crate::diagnose::search::context::{Context, Move};
use crate::diagnose::search::refit::{refit_best, screened};
use crate::diagnose::search::subset::{Subset, cut_subset};
use crate::diagnose::term::Term;
use crate::error::Result;
use crate::fit::levenberg::DecisionVariables;
use crate::order;
use crate::parallel;

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

/// Names of these screenings.
const ONE: &str = "one effect, short stretches";
const TWO: &str = "two effects, short stretches";

/// A screening of one effect on pieces of the subset, its best taken step by step to all of it and
/// fitted to everything; and the screening as it ended on the pieces.
pub(crate) fn on_short_intervals(
    case: &Case,
    subset: &Subset,
    rig: &Rig,
    all: &[Term],
) -> Result<(Vec<Candidate>, ShortHorizon)> {
    let written = Plant::new(case.written)?;
    let model = Model::new(rig, case.written, &[], subset.settings)?;
    let values = model.inherit(&written, &written.values());
    let below = cut_subset(subset, CONFIG.short_horizon.pieces[0]);
    let Some(parent) = below.first(rig, &values, CONFIG.short_horizon.baseline_steps)? else {
        return Ok((Vec::new(), ShortHorizon::default()));
    };
    let singles = screened(case, &below, &parent, all, ONE)?;
    let refits = lengthened(case, subset, below, singles.clone(), ONE)?;
    let parent = Some(parent);
    Ok((refits, ShortHorizon { parent, singles }))
}

/// Two effects on pieces of the subset: on top of what was best there alone, then on top of the
/// newcomers of the best pairs, for what was best alone had to explain what the other does as well.
/// `None` where no second effect does anything that is worth looking for; what is best on longer
/// intervals, the `leader`, has its turn before.
pub(crate) fn pairs_on_short_intervals(
    case: &Case,
    subset: &Subset,
    short: &ShortHorizon,
    leader: Option<&Term>,
    all: &[Term],
) -> Result<Option<Vec<Candidate>>> {
    let below = cut_subset(subset, CONFIG.short_horizon.pieces[0]);
    let Some(bare) = &short.parent else {
        return Ok(Some(Vec::new()));
    };
    let noise = 0.5 * below.samples();
    let beside = |trial: &Trial| trial.point.cost - noise;
    let mut parents: Vec<Trial> = (short.singles.iter().enumerate())
        .filter(|(rank, trial)| matches!(&trial.terms[..], [one] if one.may_lead(*rank)))
        .map(|(_, trial)| trial)
        .filter(|trial| trial.point.cost < CONFIG.short_horizon.hopeless * bare.point.cost)
        .take(CONFIG.short_horizon.parents)
        .cloned()
        .collect();
    let mut pairs: Vec<Trial> = Vec::new();
    let mut tried = 0;
    while tried < parents.len() && !case.time.is_spent() {
        let parent = &parents[tried];
        tried += 1;
        let second = |term: &&Term| term.may_join(&parent.terms);
        let rest: Vec<Term> = all.iter().filter(second).cloned().collect();
        pairs.extend(screened(case, &below, parent, &rest, TWO)?);
        order::sort_up(&mut pairs, merit);
        let least = |all: &[Trial]| all.iter().map(beside).fold(f64::INFINITY, f64::min);
        let (single, pair) = (least(&parents), least(&pairs));
        let in_vain = CONFIG
            .short_horizon
            .in_vain
            .get(tried - 1)
            .map(|part| part * single);
        let led = tried >= CONFIG.short_horizon.parents
            || (leader.iter()).all(|one| parents[0].terms[0] == **one);
        if led && single > noise && in_vain.is_some_and(|most| pair > most) {
            return Ok(None);
        }
        let hopeful = pairs
            .first()
            .is_some_and(|best| beside(best) < CONFIG.short_horizon.hopeful * beside(bare));
        if hopeful
            && tried == parents.len()
            && tried < CONFIG.short_horizon.parents + CONFIG.short_horizon.exchanges
        {
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
                    None => below.alone(bare, pair, fresh, CONFIG.screening.more_steps)?,
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
        if kept.len() < CONFIG.screening.kept && !kept.iter().any(same) {
            kept.push(pair);
        }
    }
    lengthened(case, subset, below, kept, TWO).map(Some)
}

/// From short to long, and the full refits.
fn lengthened<'a>(
    case: &Case,
    subset: &Subset<'a>,
    mut below: Subset<'a>,
    mut trial: Vec<Trial>,
    what: &str,
) -> Result<Vec<Candidate>> {
    for pieces in CONFIG.short_horizon.pieces[1..].iter().copied().chain([1]) {
        let above = cut_subset(subset, pieces);
        let count = case.progress_of(what).count("joined", trial.len());
        let taken = parallel::map_owned(trial, |trial| {
            let taken = lengthened_to(&above, &below, trial).ok().flatten();
            count.one();
            taken
        });
        trial = taken.into_iter().flatten().collect();
        below = above;
    }
    order::sort_up(&mut trial, merit);
    refit_best(case, subset, &trial, what)
}

/// A trial of the subset `below`, a few steps further on this one. Intervals that begin
/// where one of its did begin with the state that was found there.
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
    let from = DecisionVariables { values, states };
    Ok(subset.improved(
        trial.terms.clone(),
        model.clone(),
        from,
        CONFIG.screening.more_steps,
    ))
}
