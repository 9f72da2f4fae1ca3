//! The effects that are named, with how sure that is (docs/explanation/diagnosis.md, eq. 8 to 11).

use crate::diagnose::config::CONFIG;
use std::collections::BTreeMap;

use crate::diagnose::acceptance::{exceeds_noise, leaves_something, share_left};
use crate::diagnose::candidate::Candidate;
use crate::diagnose::case::Case;
use crate::diagnose::details::Finalist;
use crate::diagnose::evidence::apart;
use crate::diagnose::finding::{Estimate, FoundEffect, Rival};
use crate::diagnose::pool::Pool;
use crate::diagnose::residuals::Residuals;
use crate::diagnose::term::Term;
use sinew_sim::effects::Kind;

/// Why an explanation was taken out.
const REFUTED: &str = "holds what has no size, or loses free runs over whole recordings";

/// Values and intervals of the corrected model's parameters, by name.
pub(crate) type Known = BTreeMap<String, Estimate>;

/// Named effects, most important first.
pub(crate) fn effects(found: &Pool, chosen: usize, case: &Case, known: &Known) -> Vec<FoundEffect> {
    let best = &found.candidates[chosen];
    let joint_confidence = joint_confidence(found, chosen, case);
    let mut effects: Vec<FoundEffect> = best
        .trial
        .terms
        .iter()
        .filter_map(|term| Some((term, term.effect()?)))
        .flat_map(|(term, (kind, sites))| {
            let about = Alternatives::of(found, chosen, term, case, joint_confidence);
            let about = about.calibrated(case.trust);
            let each = sites.iter();
            each.map(move |place| one(kind, &place.name, about.clone(), known))
        })
        .collect();
    effects.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    effects
}

/// The confidence of the least sure of what would be named.
pub(crate) fn least_sure(found: &Pool, chosen: usize, case: &Case) -> f64 {
    let joint_confidence = joint_confidence(found, chosen, case);
    let terms = found.candidates[chosen].trial.terms.iter();
    terms
        .map(|term| Alternatives::of(found, chosen, term, case, joint_confidence).confidence)
        .fold(1.0, f64::min)
}

/// Confidence of the candidates together (eq. 9).
fn joint_confidence(found: &Pool, chosen: usize, case: &Case) -> f64 {
    let best = &found.candidates[chosen];
    let left = share_left(case, best, &found.baseline);
    let whole = if leaves_something(case, best) {
        CONFIG.calibration.part
    } else {
        1.0
    };
    let small = if exceeds_noise(case, best, &found.baseline) {
        1.0
    } else {
        CONFIG.calibration.small
    };
    case.trust * whole * small * CONFIG.calibration.most * (1.0 - left.sqrt().min(0.6))
}

fn one(kind: Kind, component: &str, about: Alternatives, known: &Known) -> FoundEffect {
    let description = kind.description();
    let parameters: BTreeMap<String, Estimate> = description
        .parameters
        .iter()
        .filter_map(|spec| {
            let name = format!("{component}.{}.{}", description.kind, spec.name);
            let estimate = known.get(&name)?;
            Some((spec.name.to_owned(), estimate.clone()))
        })
        .collect();
    let values: Vec<(f64, &str)> = description
        .parameters
        .iter()
        .filter_map(|spec| parameters.get(spec.name))
        .map(|estimate| (estimate.value, estimate.unit.as_str()))
        .collect();
    FoundEffect {
        kind: description.kind.into(),
        component: component.into(),
        equation: kind.equation(&values),
        sentence: kind.sentence(component, &values),
        confidence: about.confidence,
        rivals: about.rivals,
        indistinguishable_from: about.indistinguishable,
        parameters,
    }
}

/// One named effect among the candidates.
#[derive(Clone)]
struct Alternatives {
    confidence: f64,
    rivals: Vec<Rival>,
    indistinguishable: Vec<Rival>,
}

impl Alternatives {
    fn of(found: &Pool, chosen: usize, term: &Term, case: &Case, joint_confidence: f64) -> Self {
        let best = &found.candidates[chosen];
        let mut about = Self {
            confidence: 0.0,
            rivals: Vec::new(),
            indistinguishable: Vec::new(),
        };
        for (finalist, p) in found.candidates.iter().zip(&found.probabilities) {
            let share = p * joint_confidence;
            if finalist.trial.terms.iter().any(|its| its.says(term)) {
                about.confidence += share;
                continue;
            }
            let others: Vec<&Term> = finalist
                .trial
                .terms
                .iter()
                .filter(|other| !best.trial.terms.contains(other))
                .collect();
            let Some(other) = others.first() else {
                continue;
            };
            let apart = apart(best, finalist, case);
            let rival = Rival {
                kind: other.kind().into(),
                component: other.component(),
                confidence: share,
            };
            if others.len() == 1 && apart < CONFIG.evidence.same {
                // The same motion by another name: whoever names one has named the other.
                about.confidence += share;
                about.indistinguishable.push(Rival {
                    confidence: 0.0,
                    ..rival
                });
            } else {
                // A law that holds the named one as a special case always comes as close; it is an
                // alternative only where it is as simple or about as probable.
                let simple = finalist.parameters() <= best.parameters();
                if others.len() == 1
                    && apart < CONFIG.evidence.alike
                    && (simple || share > 0.1 * joint_confidence)
                {
                    about.indistinguishable.push(rival.clone());
                }
                about.rivals.push(rival);
            }
        }
        join(&mut about.rivals);
        join(&mut about.indistinguishable);
        about
    }

    /// As sure as such statements have turned out to be; rivals in proportion. `trust` is what
    /// recordings leave of any statement.
    fn calibrated(mut self, trust: f64) -> Self {
        let factor =
            calibrated(self.confidence / trust) * trust / self.confidence.max(f64::MIN_POSITIVE);
        self.confidence *= factor;
        for rival in self.rivals.iter_mut().chain(&mut self.indistinguishable) {
            rival.confidence *= factor;
        }
        self
    }
}

/// Calibrated confidence of a statement (eq. 11a).
fn calibrated(stated: f64) -> f64 {
    if stated >= CONFIG.calibration.calibrated_above {
        return stated;
    }
    let line = CONFIG.calibration.half
        + (CONFIG.calibration.calibrated_above - CONFIG.calibration.half) * (stated - 0.5)
            / (CONFIG.calibration.calibrated_above - 0.5);
    line.max(2.0 * CONFIG.calibration.half * stated)
}

/// One entry a rival, the most probable first.
fn join(rivals: &mut Vec<Rival>) {
    let mut joined: Vec<Rival> = Vec::new();
    for rival in rivals.drain(..) {
        match joined
            .iter_mut()
            .find(|known| known.kind == rival.kind && known.component == rival.component)
        {
            Some(known) => known.confidence += rival.confidence,
            None => joined.push(rival),
        }
    }
    joined.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    *rivals = joined;
}

/// Every explanation that was fitted to everything, the best first.
pub(crate) fn finalists(found: &Pool, chosen: Option<usize>) -> Vec<Finalist> {
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
        probability,
        lost: lost.into(),
    };
    let mut order: Vec<usize> = (0..found.candidates.len()).collect();
    order.sort_by(|&a, &b| found.probabilities[b].total_cmp(&found.probabilities[a]));
    let size = |index: usize| found.candidates[index].trial.terms.len();
    let refuted = found.refuted.iter();
    let refuted = refuted.map(|candidate| of(candidate, 0.0, REFUTED));
    order
        .into_iter()
        .map(|index| {
            let lost = match chosen {
                Some(chosen) if chosen == index => "",
                Some(chosen) if size(chosen) < size(index) => {
                    "gains nothing that matters over fewer effects"
                }
                Some(_) => "explains the recordings less well",
                None => "does not hold on the check recordings, or leaves too much to be a name",
            };
            of(&found.candidates[index], found.probabilities[index], lost)
        })
        .chain(refuted)
        .collect()
}

fn name(candidate: &Candidate) -> String {
    let terms = candidate.trial.terms.iter();
    let parts: Vec<String> = terms
        .map(|term| format!("{} at {}", term.kind(), term.component()))
        .collect();
    parts.join(" + ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubtful_statements_are_worth_less_than_they_say_and_sure_ones_what_they_say() {
        assert_eq!(calibrated(0.99), 0.99);
        assert_eq!(
            calibrated(CONFIG.calibration.calibrated_above),
            CONFIG.calibration.calibrated_above
        );
        assert!((calibrated(0.5) - CONFIG.calibration.half).abs() < 1e-12);
        let mut before = 0.0;
        for percent in 1..=99 {
            let stated = f64::from(percent) / 100.0;
            assert!(calibrated(stated) > before && calibrated(stated) <= stated);
            before = calibrated(stated);
        }
    }

    #[test]
    fn rivals_keep_their_proportion_and_doubt_about_recordings_is_taken_once() {
        let of = |confidence: f64, rival: f64| Alternatives {
            confidence,
            rivals: vec![Rival {
                kind: "backlash".into(),
                component: "table".into(),
                confidence: rival,
            }],
            indistinguishable: Vec::new(),
        };
        let sure = of(0.9, 0.05).calibrated(1.0);
        assert_eq!((sure.confidence, sure.rivals[0].confidence), (0.9, 0.05));
        let unsure = of(0.6, 0.3).calibrated(1.0);
        assert!((unsure.confidence - calibrated(0.6)).abs() < 1e-12);
        assert!((unsure.rivals[0].confidence - 0.5 * unsure.confidence).abs() < 1e-12);
        let short = of(0.7 * 0.9, 0.0).calibrated(0.7);
        assert!((short.confidence - 0.7 * 0.9).abs() < 1e-12);
    }
}
