//! Candidates that were fitted to everything, as a report lists them.

use crate::diagnose::acceptance::refusal;
use crate::diagnose::candidate::Candidate;
use crate::diagnose::case::Case;
use crate::diagnose::details::Finalist;
use crate::diagnose::pool::Pool;
use crate::diagnose::residuals::Residuals;
use crate::diagnose::share::share_left;
use crate::order;

/// Every explanation that was fitted to everything, the best first, and the reason for which it is
/// not what is believed.
pub(crate) fn finalists(found: &Pool, chosen: Option<usize>, case: &Case) -> Vec<Finalist> {
    let gain = |after: &Residuals, before: &Residuals| {
        let sensors = before.series.len();
        let logs = (0..sensors).map(|s| (after.rms(s) / before.rms(s)).ln());
        (logs.sum::<f64>() / sensors.max(1) as f64).exp()
    };
    let base = &found.baseline;
    let of = |candidate: &Candidate, probability: f64, lost: &str| Finalist {
        name: name(candidate),
        parameters: candidate.parameters(),
        fit_error: gain(&candidate.fit, &base.fit),
        check_error: gain(&candidate.check, &base.check),
        remainder: share_left(case, candidate, base),
        probability,
        lost: lost.into(),
    };
    let mut order: Vec<usize> = (0..found.candidates.len()).collect();
    order::sort_down(&mut order, |&index| found.probabilities[index]);
    let size = |index: usize| found.candidates[index].trial.terms.len();
    let refuted = found.refuted.iter();
    let refuted = refuted.map(|(candidate, why)| of(candidate, 0.0, why));
    let lost = |index: usize| {
        let refused = || refusal(case, &found.candidates[index], base);
        match chosen {
            Some(chosen) if chosen == index => "",
            Some(chosen) if size(chosen) < size(index) => {
                refused().unwrap_or("gains nothing that matters over fewer effects")
            }
            Some(_) => refused().unwrap_or("explains the recordings less well"),
            None if found.unsure == Some(index) => "has too small a share of the evidence",
            None => refused().unwrap_or("is not surely better on the check recordings"),
        }
    };
    order
        .into_iter()
        .map(|index| {
            let candidate = &found.candidates[index];
            of(candidate, found.probabilities[index], lost(index))
        })
        .chain(refuted)
        .collect()
}

fn name(candidate: &Candidate) -> String {
    let terms = candidate.trial.terms.iter();
    let parts: Vec<String> = terms
        .map(|term| {
            let by = term.by().map(|by| format!(" by {}", by.name));
            let by = by.unwrap_or_default();
            format!("{} at {}{by}", term.kind(), term.component())
        })
        .collect();
    parts.join(" + ")
}
