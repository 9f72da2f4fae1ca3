//! The effects that are named, with how sure that is (docs/explanation/diagnosis.md, eq. 8 to 11).

use crate::diagnose::config::CONFIG;
use std::collections::BTreeMap;

use crate::diagnose::acceptance::{exceeds_noise, leaves_something, one_finding_with};
use crate::diagnose::by_signal::BySignal;
use crate::diagnose::case::Case;
use crate::diagnose::evidence::apart;
use crate::diagnose::finding::{Estimate, FoundEffect, Rival};
use crate::diagnose::pool::Pool;
use crate::diagnose::share::share_left;
use crate::diagnose::term::Term;
use crate::order;
use crate::report::significant;
use sinew_sim::effects::Kind;

/// Values and intervals of the corrected model's parameters, by name.
pub(crate) type Known = BTreeMap<String, Estimate>;

/// Named effects, most important first; `shares` has one entry a term.
pub(crate) fn effects(
    found: &Pool,
    chosen: usize,
    case: &Case,
    known: &Known,
    shares: &[f64],
) -> Vec<FoundEffect> {
    let all = Named::new(found, chosen, case);
    let terms = found.candidates[chosen].terms().iter().zip(shares);
    let mut effects: Vec<FoundEffect> = terms
        .filter_map(|(term, share)| Some((term, share, term.effect()?)))
        .flat_map(|(term, share, (kind, sites))| {
            let about = all.alternatives(term).calibrated(case.trust);
            let each = sites.iter();
            each.map(move |place| FoundEffect {
                share: *share,
                ..one(kind, &place.name, term.by(), about.clone(), known)
            })
        })
        .collect();
    order::sort_down(&mut effects, |effect| effect.confidence);
    effects
}

/// Confidence of each of the effects that would be named, as it would be printed.
pub(crate) fn sureness(found: &Pool, chosen: usize, case: &Case) -> Vec<f64> {
    let all = Named::new(found, chosen, case);
    let terms = found.candidates[chosen].terms().iter();
    let of = |term: &Term| all.alternatives(term).calibrated(case.trust).confidence;
    terms.map(of).collect()
}

/// Named candidate among the candidates of a search.
struct Named<'a> {
    found: &'a Pool,
    chosen: usize,
    case: &'a Case<'a>,
    joint_confidence: f64,
    /// Candidates that are one finding with it.
    one_finding: Vec<bool>,
}

/// Confidence of the candidates together (eq. 9). A remainder lowers it little: what is left is no
/// doubt about what was removed.
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
    let sure = CONFIG.calibration.most * (1.0 - CONFIG.calibration.remainder * left);
    case.trust * whole * small * sure
}

fn one(
    kind: Kind,
    component: &str,
    by: Option<&BySignal>,
    about: Alternatives,
    known: &Known,
) -> FoundEffect {
    let description = kind.description();
    let estimate = |key: &str| {
        let estimate = known.get(&format!("{component}.{}.{key}", description.kind))?;
        Some((key.to_owned(), estimate.clone()))
    };
    let own = description.parameters.iter();
    let slopes = own.clone().map(|spec| format!("{}.slope", spec.name));
    let slopes: BTreeMap<String, Estimate> = slopes.filter_map(|key| estimate(&key)).collect();
    let mut parameters: BTreeMap<String, Estimate> =
        own.filter_map(|spec| estimate(spec.name)).collect();
    // A strength that depends on a signal is said in the middle of the signal's range.
    let middle = by.map_or(0.0, |by| 0.5 * (by.range[0] + by.range[1]));
    let at = |name: &str, signal: f64| {
        let own = parameters.get(name)?;
        let slope = slopes.get(&format!("{name}.slope"));
        let change = slope.map_or(0.0, |slope| slope.value * signal);
        Some((own.value + change, own.unit.as_str()))
    };
    let names = description.parameters.iter().map(|spec| spec.name);
    let values: Vec<(f64, &str)> = names.clone().filter_map(|name| at(name, middle)).collect();
    let mut equation = kind.equation(&values);
    let mut sentence = kind.sentence(component, &values);
    if let Some(by) = by {
        for name in names.filter(|name| slopes.contains_key(&format!("{name}.slope"))) {
            let ends = by.range.map(|signal| (at(name, signal), signal));
            let said = ends.map(|(value, signal)| {
                let (value, unit) = value.unwrap_or_default();
                let (value, signal) = (significant(value, 3), significant(signal, 3));
                format!("{value} {unit} at {signal} {}", by.unit)
                    .trim()
                    .to_owned()
            });
            let said = said.join(", ");
            equation += &format!(", {name} by {}: {said}", by.name);
            sentence += &format!(" Its {name} depends on {}: {said}.", by.name);
        }
    }
    parameters.extend(slopes);
    FoundEffect {
        share: 0.0,
        kind: description.kind.into(),
        component: component.into(),
        equation,
        sentence,
        with: by.map(|by| by.name.clone()),
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

impl<'a> Named<'a> {
    fn new(found: &'a Pool, chosen: usize, case: &'a Case) -> Self {
        Self {
            joint_confidence: joint_confidence(found, chosen, case),
            one_finding: one_finding_with(case, &found.baseline, chosen, &found.candidates),
            found,
            chosen,
            case,
        }
    }

    fn alternatives(&self, term: &Term) -> Alternatives {
        let Self { found, case, .. } = *self;
        let best = &found.candidates[self.chosen];
        let mut about = Alternatives {
            confidence: 0.0,
            rivals: Vec::new(),
            indistinguishable: Vec::new(),
        };
        let all = found.candidates.iter().zip(&found.probabilities);
        for ((finalist, p), one_finding) in all.zip(&self.one_finding) {
            let share = p * self.joint_confidence;
            let mut its = finalist.trial.terms.iter();
            if its.any(|its| its.says(term) || its.is_effect_of(term)) {
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
            if *one_finding || others.len() == 1 && apart < CONFIG.evidence.same {
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
                    && (simple || share > 0.1 * self.joint_confidence)
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
}

impl Alternatives {
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
    order::sort_down(&mut joined, |it| it.confidence);
    *rivals = joined;
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
