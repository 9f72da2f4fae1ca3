//! Shooting segments of each stage, short ones first (docs/explanation/identification.md, eq. 9).

use super::experiment::Views;
use super::levenberg::{DecisionVariables, Prior, total_cost};
use super::segment::{Problem, Segment};
use super::start;
use crate::error::{Error, Result};

/// Continuation in the length of the horizon: lengths of the shooting intervals of each stage.
#[derive(Clone, Copy)]
pub(crate) struct Continuation {
    /// Stretches of a stage are this part of a recording; the last stage takes it whole.
    parts: &'static [usize],
    /// No stretch is shorter than this where it can be helped: a start state of its own needs rows
    /// to show.
    shortest: usize,
}

/// Stretches over which noise does little.
pub(crate) const USUAL: Continuation = Continuation {
    parts: &[64, 8, 1],
    shortest: 25,
};

/// Stretches within which a device does not swing. Noise weighs more, but values that are wrong by
/// orders are found: over a few swings every one of them is missed alike.
pub(crate) const FINE: Continuation = Continuation {
    parts: &[512, 64, 8, 1],
    shortest: 8,
};

/// Cuts every recording into stretches of `horizon` rows; the last takes what would be too short
/// alone.
fn cut(problem: &Problem, horizon: impl Fn(usize) -> usize) -> Result<Vec<Segment>> {
    let mut segments = Vec::new();
    for (index, experiment) in problem.experiments.iter().enumerate() {
        let rows = experiment.rows();
        let horizon = horizon(rows).clamp(1, rows);
        let count = (rows / horizon).max(1);
        for k in 0..count {
            let end = if k + 1 == count {
                rows
            } else {
                (k + 1) * horizon
            };
            segments.push(problem.segment(index, k * horizon..end)?);
        }
    }
    Ok(segments)
}

impl Continuation {
    /// Rows of a stretch of stage `stage` (from 0) in a recording of `rows`.
    fn horizon(&self, stage: usize, rows: usize) -> usize {
        let Self { parts, shortest } = self;
        if stage + 1 >= parts.len() {
            return rows;
        }
        // Multiples of one another, so that what a stage found for its starts serves the next.
        (rows / parts[0]).max(*shortest) * (parts[0] / parts[stage])
    }
}

/// The shortest stretches, shortened further until the rig as written can be simulated over them.
pub(super) fn first_stretches(
    problem: &Problem,
    views: &Views,
    written: &[f64],
    continuation: &Continuation,
) -> Result<(Vec<Segment>, DecisionVariables)> {
    let mut divisor = 1;
    loop {
        let segments = cut(problem, |rows| continuation.horizon(0, rows) / divisor)?;
        let states = start::states(problem, views, &segments, written)?;
        if problem.cost(&segments, written, &states).is_finite() {
            return Ok((
                segments,
                DecisionVariables {
                    values: written.to_vec(),
                    states,
                },
            ));
        }
        divisor *= 2;
        if divisor > continuation.shortest {
            return Err(beyond_simulation(
                segments
                    .iter()
                    .map(|segment| segment.rows.len())
                    .max()
                    .unwrap_or(0),
            ));
        }
    }
}

/// Every recording as one stretch, its start fitted to the rig as written.
pub(super) fn whole_recordings(
    problem: &Problem,
    views: &Views,
    written: &[f64],
) -> Result<(Vec<Segment>, DecisionVariables)> {
    let segments = cut(problem, |rows| rows)?;
    let states = start::states(problem, views, &segments, written)?;
    let unknowns = DecisionVariables {
        values: written.to_vec(),
        states: start::settle(problem, &segments, written, states),
    };
    if problem
        .cost(&segments, written, &unknowns.states)
        .is_finite()
    {
        return Ok((segments, unknowns));
    }
    let rows = segments.iter().map(|segment| segment.rows.len()).max();
    Err(beyond_simulation(rows.unwrap_or(0)))
}

/// Segments of the next level, at most `most` seconds long, with what is known of their initial
/// states. Where they cannot be simulated they are halved, and the level stays: each call gives
/// longer segments than the one before. `None` where `most` permits none.
pub(super) fn next_stretches(
    problem: &Problem,
    belief: &Prior,
    views: &Views,
    (segments, level, most): (&[Segment], usize, f64),
    continuation: &Continuation,
    unknowns: &DecisionVariables,
) -> Result<Option<(Vec<Segment>, DecisionVariables, usize)>> {
    let longest = |segments: &[Segment]| {
        segments
            .iter()
            .map(|segment| segment.rows.len())
            .max()
            .unwrap_or(0)
    };
    let lasts = |segment: &Segment| {
        let t = &problem.experiments[segment.experiment].t;
        t[segment.rows.end - 1] - t[segment.rows.start]
    };
    let mut too_long = false;
    for halvings in 0..6 {
        let longer = cut(problem, |rows| {
            continuation.horizon(level + 1, rows).min(rows) >> halvings
        })?;
        if longest(&longer) <= longest(segments) {
            break;
        }
        if longer.iter().map(lasts).fold(0.0, f64::max) > most {
            too_long = true;
            continue;
        }
        let mut states = start::states(problem, views, &longer, &unknowns.values)?;
        let deviations = problem.deviations(segments, &unknowns.states);
        for (segment, state) in longer.iter().zip(&mut states) {
            let known = segments.iter().position(|old| {
                old.experiment == segment.experiment && old.rows.start == segment.rows.start
            });
            if let Some(known) = known {
                state.clone_from(&unknowns.states[known]);
            }
            state[problem.plant.state_len()..].clone_from_slice(&deviations[segment.experiment]);
        }
        let candidate = DecisionVariables {
            values: unknowns.values.clone(),
            states,
        };
        if total_cost(problem, belief, &longer, &candidate).is_finite() {
            let level = if halvings == 0 { level + 1 } else { level };
            return Ok(Some((longer, candidate, level)));
        }
    }
    if too_long {
        return Ok(None);
    }
    Err(beyond_simulation(2 * longest(segments)))
}

/// Error of a rig that leaves all bounds over so many rows.
pub(super) fn beyond_simulation(rows: usize) -> Error {
    Error::failed(format!(
        "the rig cannot be simulated over {rows} rows of the recordings: it leaves all bounds"
    ))
    .help(
        "check the signs and sizes of stiffness, damping and gain; `sinew simulate` shows the run",
    )
}
