//! From what the search found to what is said.

use std::collections::BTreeMap;

use sinew_sim::Rig;

use super::details::{Details, Finalist};
use super::errors;
use super::evidence::Contender;
use super::finding::{
    Diagnosis, Estimate, FORMAT, FoundEffect, Interval, Location, Rival, SignalFit, Verdict,
};
use super::roles::Roles;
use super::search::{Bench, Found};
use super::suspect::Suspect;
use crate::error::Result;
use crate::fit::Fit;

/// Decides on the verdict and writes everything down.
pub(super) fn conclude(
    rig: &Rig,
    refitted: &Fit,
    bench: &Bench,
    found: Option<Found>,
    roles: &Roles,
) -> Result<Diagnosis> {
    let chosen = found
        .as_ref()
        .and_then(|found| found.chosen.map(|index| (found, index)));
    let number = chosen.is_some_and(|(found, index)| {
        matches!(
            found.finalists[index].tried.suspects[..],
            [Suspect::Number { .. }]
        )
    });
    let mended = match chosen {
        Some((found, index)) if !number => {
            let best = &found.finalists[index];
            best.tried.model.with(&best.tried.point.values)?
        }
        _ => refitted.rig.clone(),
    };
    let effects = match chosen {
        Some((found, index)) if !number => effects(found, index, bench),
        _ => Vec::new(),
    };
    let verdict = match (&found, chosen) {
        (_, Some(_)) if !number => Verdict::MissingPhysics,
        (Some(found), None) if !bench.leaves_something(&found.base) => Verdict::Parameters,
        _ => Verdict::Unexplained,
    };
    let sentence = match verdict {
        Verdict::MissingPhysics => effects
            .iter()
            .map(|effect| effect.sentence.clone())
            .collect::<Vec<_>>()
            .join(" "),
        Verdict::Consistent => "The rig explains the recordings as it is written.".into(),
        Verdict::Parameters => {
            "With its parameters refitted the rig explains the recordings; no physics is missing."
                .into()
        }
        Verdict::Unexplained => {
            "Something is missing from the rig that no effect of the vocabulary explains.".into()
        }
    };
    let mut signals = BTreeMap::new();
    let rigs = [rig, &refitted.rig, &mended];
    let fit = errors(rigs, &roles.fit)?;
    let check = errors(rigs, &roles.check)?;
    let test = if roles.test.is_empty() {
        None
    } else {
        Some(errors(rigs, &roles.test)?)
    };
    for (sensor, described) in sinew_sim::Plant::new(rig)?.sensors().iter().enumerate() {
        let name = &described.column;
        signals.insert(
            name.clone(),
            SignalFit {
                unit: described.unit.clone(),
                fit: fit[name],
                check: check[name],
                test: test.as_ref().map(|test| test[name]),
                noise_rms: bench.check.noise[sensor],
            },
        );
    }
    let parameters = refitted
        .parameters
        .iter()
        .map(|p| {
            (
                p.name.clone(),
                Estimate {
                    value: p.value,
                    unit: p.unit.clone(),
                    ci95: p.ci95,
                },
            )
        })
        .collect();
    let location = match verdict {
        Verdict::MissingPhysics => Some(Location {
            component: effects[0].component.clone(),
            follows: String::new(),
            intervals: Vec::<Interval>::new(),
        }),
        _ => None,
    };
    Ok(Diagnosis {
        format: FORMAT,
        verdict,
        sentence,
        effects,
        location,
        fit: signals,
        parameters,
        next_experiment: String::new(),
        seconds: 0.0,
        refitted: refitted.rig.clone(),
        mended,
        details: Details {
            set_aside: roles.set_aside.clone(),
            finalists: found
                .iter()
                .flat_map(|found| names(found, chosen.map(|(_, at)| at)))
                .collect(),
            ..Details::default()
        },
    })
}

/// Every explanation that was fitted to everything, the best first, the believed rig last.
fn names(found: &Found, chosen: Option<usize>) -> Vec<Finalist> {
    let gain = |contender: &Contender| {
        let sensors = found.base.check.series.len();
        let logs = (0..sensors).map(|s| (contender.check.rms(s) / found.base.check.rms(s)).ln());
        (logs.sum::<f64>() / sensors.max(1) as f64).exp()
    };
    let mut order: Vec<usize> = (0..found.finalists.len()).collect();
    order.sort_by(|&a, &b| found.probabilities[b].total_cmp(&found.probabilities[a]));
    order
        .into_iter()
        .map(|index| Finalist {
            name: name(&found.finalists[index]),
            parameters: found.finalists[index].parameters(),
            check_error: gain(&found.finalists[index]),
            probability: found.probabilities[index],
            lost: if chosen == Some(index) {
                String::new()
            } else {
                "less evidence".into()
            },
        })
        .collect()
}

fn name(contender: &Contender) -> String {
    let parts: Vec<String> = contender
        .tried
        .suspects
        .iter()
        .map(|suspect| format!("{} at {}", suspect.kind(), suspect.component()))
        .collect();
    parts.join(" + ")
}

fn effects(found: &Found, chosen: usize, bench: &Bench) -> Vec<FoundEffect> {
    let best = &found.finalists[chosen];
    let left = bench.share_left(best, &found.base);
    let surety = 1.0 - left.sqrt().min(0.6);
    best.tried
        .suspects
        .iter()
        .filter_map(|suspect| {
            let Suspect::Effect { kind, component } = suspect else {
                return None;
            };
            let description = kind.description();
            let values: Vec<(String, f64, String)> = description
                .parameters
                .iter()
                .filter_map(|spec| {
                    let name = format!("{component}.{}.{}", description.kind, spec.name);
                    let slot = best.tried.model.plant.slot(&name)?;
                    let unit = best.tried.model.plant.parameters()[slot].unit.clone();
                    Some((spec.name.to_owned(), best.tried.point.values[slot], unit))
                })
                .collect();
            let probability: f64 = found
                .finalists
                .iter()
                .zip(&found.probabilities)
                .filter(|(finalist, _)| finalist.tried.suspects.contains(suspect))
                .map(|(_, p)| p)
                .sum();
            let mut rivals: Vec<Rival> = Vec::new();
            for (finalist, p) in found.finalists.iter().zip(&found.probabilities) {
                if finalist.tried.suspects.len() != best.tried.suspects.len()
                    || finalist.tried.suspects.contains(suspect)
                {
                    continue;
                }
                for other in &finalist.tried.suspects {
                    if !best.tried.suspects.contains(other) {
                        rivals.push(Rival {
                            kind: other.kind().into(),
                            component: other.component().into(),
                            confidence: p * surety,
                        });
                    }
                }
            }
            let numbers: Vec<(f64, &str)> = values
                .iter()
                .map(|(_, value, unit)| (*value, unit.as_str()))
                .collect();
            Some(FoundEffect {
                kind: description.kind.into(),
                component: component.clone(),
                equation: kind.equation(&numbers),
                sentence: kind.sentence(component, &numbers),
                parameters: values
                    .into_iter()
                    .map(|(name, value, unit)| {
                        (
                            name,
                            Estimate {
                                value,
                                unit,
                                ci95: None,
                            },
                        )
                    })
                    .collect(),
                confidence: probability * surety,
                rivals,
                indistinguishable_from: Vec::new(),
            })
        })
        .collect()
}
