//! The effects that are named, with how sure that is (docs/explanation/diagnosis.md, eq. 8 to 11).

use std::collections::BTreeMap;

use sinew_sim::effects::Kind;

use super::details::Finalist;
use super::evidence::Contender;
use super::finding::{Estimate, FoundEffect, Rival};
use super::judge::Remains;
use super::search::{Bench, Found};
use super::suspect::Suspect;

/// Predictions that differ by less than this part of the noise are the same.
pub(super) const SAME: f64 = 0.02;

/// Predictions that differ by less than this part of the noise cannot be told apart by these recordings.
pub(super) const ALIKE: f64 = 0.25;

/// Doubt that remains however well everything fits: nobody has tried what is not in the vocabulary.
const MOST: f64 = 0.99;

/// The same where something is left: what is named is not all, and may be the nearest name of something else.
const PART: f64 = 0.9;

/// The same of what removes less than the noise: there every effect looks a little like every other. Of 24 such answers of
/// seed 2030, 19 were right.
const SMALL: f64 = 0.85;

/// Where statements are as often right as they say. Below, of seeds 2029 to 2031, 15 of 25 around 0.75 were right, 5 of 25
/// around 0.58, and 2 of 40 around 0.4 (docs/lab/0058): a line down to `LEAST` at half (eq. 11a).
const HONEST: f64 = 0.86;

/// What a half is worth.
const LEAST: f64 = 0.1;

/// Why an explanation was taken out.
const REFUTED: &str = "holds what has no size, or loses free runs over whole recordings";

/// Values and intervals of the mended rig's parameters, by name.
pub(super) type Known = BTreeMap<String, Estimate>;

/// What is named, most important first.
pub(super) fn effects(
    found: &Found,
    chosen: usize,
    bench: &Bench,
    known: &Known,
) -> Vec<FoundEffect> {
    let best = &found.finalists[chosen];
    let surety = surety(found, chosen, bench);
    let mut effects: Vec<FoundEffect> = best
        .tried
        .suspects
        .iter()
        .filter_map(|suspect| Some((suspect, suspect.places()?)))
        .flat_map(|(suspect, (kind, components))| {
            let about = Rivalry::of(found, chosen, suspect, bench, surety);
            let about = about.honest(bench.trust);
            let each = components.into_iter();
            each.map(move |component| one(kind, component, about.clone(), known))
        })
        .collect();
    effects.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    effects
}

/// The confidence of the least sure of what would be named.
pub(super) fn least_sure(found: &Found, chosen: usize, bench: &Bench) -> f64 {
    let surety = surety(found, chosen, bench);
    let suspects = found.finalists[chosen].tried.suspects.iter();
    suspects
        .map(|suspect| Rivalry::of(found, chosen, suspect, bench, surety).confidence)
        .fold(1.0, f64::min)
}

/// How sure the finalists are together (eq. 9).
fn surety(found: &Found, chosen: usize, bench: &Bench) -> f64 {
    let best = &found.finalists[chosen];
    let left = bench.share_left(best, &found.base);
    let whole = if bench.leaves_something(best) {
        PART
    } else {
        1.0
    };
    let small = if bench.large(best, &found.base) {
        1.0
    } else {
        SMALL
    };
    bench.trust * whole * small * MOST * (1.0 - left.sqrt().min(0.6))
}

fn one(kind: Kind, component: &str, about: Rivalry, known: &Known) -> FoundEffect {
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

/// How one named effect stands among the finalists.
#[derive(Clone)]
struct Rivalry {
    confidence: f64,
    rivals: Vec<Rival>,
    indistinguishable: Vec<Rival>,
}

impl Rivalry {
    fn of(found: &Found, chosen: usize, suspect: &Suspect, bench: &Bench, surety: f64) -> Self {
        let best = &found.finalists[chosen];
        let mut about = Self {
            confidence: 0.0,
            rivals: Vec::new(),
            indistinguishable: Vec::new(),
        };
        for (finalist, p) in found.finalists.iter().zip(&found.probabilities) {
            let share = p * surety;
            if finalist.tried.suspects.iter().any(|its| its.says(suspect)) {
                about.confidence += share;
                continue;
            }
            let others: Vec<&Suspect> = finalist
                .tried
                .suspects
                .iter()
                .filter(|other| !best.tried.suspects.contains(other))
                .collect();
            let Some(other) = others.first() else {
                continue;
            };
            let apart = apart(best, finalist, bench);
            let rival = Rival {
                kind: other.kind().into(),
                component: other.component().into(),
                confidence: share,
            };
            if others.len() == 1 && apart < SAME {
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
                if others.len() == 1 && apart < ALIKE && (simple || share > 0.1 * surety) {
                    about.indistinguishable.push(rival.clone());
                }
                about.rivals.push(rival);
            }
        }
        join(&mut about.rivals);
        join(&mut about.indistinguishable);
        about
    }

    /// As sure as such statements have turned out to be; rivals in proportion. `trust` is what recordings leave of any statement.
    fn honest(mut self, trust: f64) -> Self {
        let factor =
            honest(self.confidence / trust) * trust / self.confidence.max(f64::MIN_POSITIVE);
        self.confidence *= factor;
        for rival in self.rivals.iter_mut().chain(&mut self.indistinguishable) {
            rival.confidence *= factor;
        }
        self
    }
}

/// What a statement of this confidence is worth (eq. 11a).
fn honest(stated: f64) -> f64 {
    if stated >= HONEST {
        return stated;
    }
    let line = LEAST + (HONEST - LEAST) * (stated - 0.5) / (HONEST - 0.5);
    line.max(2.0 * LEAST * stated)
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

/// How far two explanations' predictions of the check recordings lie apart, in units of the noise: the
/// largest of the sensors (eq. 10).
pub(super) fn apart(a: &Contender, b: &Contender, bench: &Bench) -> f64 {
    let of_sensor = |sensor: usize| {
        let (mut squares, mut count) = (0.0, 0.0);
        let pairs = a.check.series[sensor].iter().zip(&b.check.series[sensor]);
        for (a, b) in pairs.flat_map(|(a, b)| a.iter().zip(b)) {
            squares += (a - b).powi(2);
            count += 1.0;
        }
        let scale = bench.check.noise[sensor] + 1e-4 * bench.check.spread[sensor];
        (squares / f64::max(count, 1.0)).sqrt() / scale
    };
    (0..a.check.series.len()).map(of_sensor).fold(0.0, f64::max)
}

/// Every explanation that was fitted to everything, the best first.
pub(super) fn finalists(found: &Found, chosen: Option<usize>) -> Vec<Finalist> {
    let gain = |after: &Remains, before: &Remains| {
        let sensors = before.series.len();
        let logs = (0..sensors).map(|s| (after.rms(s) / before.rms(s)).ln());
        (logs.sum::<f64>() / sensors.max(1) as f64).exp()
    };
    let base = &found.base;
    let of = |contender: &Contender, probability: f64, lost: &str| Finalist {
        name: name(contender),
        parameters: contender.parameters(),
        fit_error: gain(&contender.fit, &base.fit),
        check_error: gain(&contender.check, &base.check),
        probability,
        lost: lost.into(),
    };
    let mut order: Vec<usize> = (0..found.finalists.len()).collect();
    order.sort_by(|&a, &b| found.probabilities[b].total_cmp(&found.probabilities[a]));
    let size = |index: usize| found.finalists[index].tried.suspects.len();
    let refuted = found.refuted.iter();
    let refuted = refuted.map(|contender| of(contender, 0.0, REFUTED));
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
            of(&found.finalists[index], found.probabilities[index], lost)
        })
        .chain(refuted)
        .collect()
}

fn name(contender: &Contender) -> String {
    let suspects = contender.tried.suspects.iter();
    let parts: Vec<String> = suspects
        .map(|suspect| format!("{} at {}", suspect.kind(), suspect.component()))
        .collect();
    parts.join(" + ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubtful_statements_are_worth_less_than_they_say_and_sure_ones_what_they_say() {
        assert_eq!(honest(0.99), 0.99);
        assert_eq!(honest(HONEST), HONEST);
        assert!((honest(0.5) - LEAST).abs() < 1e-12);
        let mut before = 0.0;
        for percent in 1..=99 {
            let stated = f64::from(percent) / 100.0;
            assert!(honest(stated) > before && honest(stated) <= stated);
            before = honest(stated);
        }
    }

    #[test]
    fn rivals_keep_their_proportion_and_doubt_about_recordings_is_taken_once() {
        let of = |confidence: f64, rival: f64| Rivalry {
            confidence,
            rivals: vec![Rival {
                kind: "backlash".into(),
                component: "table".into(),
                confidence: rival,
            }],
            indistinguishable: Vec::new(),
        };
        let sure = of(0.9, 0.05).honest(1.0);
        assert_eq!((sure.confidence, sure.rivals[0].confidence), (0.9, 0.05));
        let unsure = of(0.6, 0.3).honest(1.0);
        assert!((unsure.confidence - honest(0.6)).abs() < 1e-12);
        assert!((unsure.rivals[0].confidence - 0.5 * unsure.confidence).abs() < 1e-12);
        let short = of(0.7 * 0.9, 0.0).honest(0.7);
        assert!((short.confidence - 0.7 * 0.9).abs() < 1e-12);
    }
}
