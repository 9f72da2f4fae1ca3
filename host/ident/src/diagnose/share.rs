//! Mismatch that an explanation removes on the check recordings, and what it leaves
//! (docs/explanation/diagnosis.md, eq. 7a).

use std::ops::Range;

use crate::diagnose::candidate::Candidate;
use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::data::Data;
use crate::diagnose::residuals::Residuals;

/// Squares beside noise, of all sensors, each in its spread.
pub(crate) fn beside_noise(residuals: &Residuals, data: &Data) -> f64 {
    let excess = residuals.excess(data).into_iter().enumerate();
    excess.map(|(s, e)| (e.rms / data.spread[s]).powi(2)).sum()
}

/// The part of what `before` left beside noise on the check recordings that `after` still leaves: 0
/// is all explained.
pub(crate) fn share_left(case: &Case, after: &Candidate, before: &Candidate) -> f64 {
    let left = |candidate: &Candidate| beside_noise(&candidate.check, case.check);
    part(left(after), left(before))
}

/// The same on the recordings that they were fitted to.
pub(crate) fn share_fitted(case: &Case, after: &Candidate, before: &Candidate) -> f64 {
    let left = |candidate: &Candidate| beside_noise(&candidate.fit, case.fit);
    part(left(after), left(before))
}

/// The part that `after` is of `before`, at most all of it; nothing where there was nothing.
fn part(after: f64, before: f64) -> f64 {
    if before > 0.0 {
        (after / before).min(1.0)
    } else {
        0.0
    }
}

/// Root mean square of what a candidate leaves beside noise on the check recordings, in the noise
/// of each sensor.
pub(crate) fn above_noise(case: &Case, candidate: &Candidate) -> f64 {
    let excess = candidate.check.excess(case.check).into_iter();
    let squares: Vec<f64> = excess
        .zip(&case.check.sigma)
        .map(|(e, sigma)| (e.rms / sigma).powi(2))
        .collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// Tells whether an explanation makes some recording worse, over the intervals that are judged.
pub(crate) fn spoils_a_recording(case: &Case, after: &Candidate, before: &Candidate) -> bool {
    spoils(case.fit, &case.fit_intervals, [&after.fit, &before.fit])
        || spoils(
            case.check,
            &case.check_intervals,
            [&after.check, &before.check],
        )
}

/// The same of the recordings of one role: residuals after and before.
pub(crate) fn spoils(
    data: &Data,
    intervals: &[(usize, Range<usize>)],
    [after, before]: [&Residuals; 2],
) -> bool {
    let sensors = 0..data.spread.len();
    let least: f64 = (sensors.clone())
        .map(|s| {
            let of_noise = CONFIG.acceptance.matters_of_noise * data.noise[s] / data.spread[s];
            (of_noise + CONFIG.acceptance.matters_of_spread).powi(2)
        })
        .sum();
    let squares = |residuals: &Residuals, recording: usize| -> f64 {
        let of = |sensor: usize| {
            let parts = residuals.series[sensor].iter().zip(intervals);
            let own = parts.filter(|(_, (index, _))| *index == recording);
            let own: Vec<f64> = own.flat_map(|(part, _)| part.iter().copied()).collect();
            let squares: f64 = own.iter().map(|r| r * r).sum();
            squares / own.len().max(1) as f64 / data.spread[sensor].powi(2)
        };
        sensors.clone().map(of).sum()
    };
    (0..data.experiments.len()).any(|recording| {
        let (after, before) = (squares(after, recording), squares(before, recording));
        after > CONFIG.acceptance.spoilt.powi(2) * before && after - before > least
    })
}
