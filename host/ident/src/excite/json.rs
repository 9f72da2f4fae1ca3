//! `sinew-excite/1`: an experiment and what it would reveal, for programs.

use serde_json::{Value, json};

use super::optimal::{Comparison, Measures};
use super::reveal::{PARALLEL, Revelation, Visibility};
use super::{Experiment, Kind};

/// Format of the document.
pub const FORMAT: &str = "sinew-excite/1";

/// Experiment and revelation as JSON. `inputs` are the columns in the plant's order; `revelation`
/// is null where nothing was measured, `design` where no design was searched for.
pub fn json(
    experiment: &Experiment,
    inputs: &[&str],
    found: Option<&Revelation>,
    compared: Option<&Comparison>,
) -> Value {
    let duration_s = experiment.t.last().copied().unwrap_or_default();
    json!({
        "format": FORMAT,
        "rows": experiment.t.len(),
        "duration_s": duration_s,
        "inputs": inputs,
        "revelation": found.map(revelation),
        "design": found.zip(compared).map(|(found, compared)| design(found, compared)),
    })
}

/// The chosen experiment beside the families.
fn design(found: &Revelation, compared: &Comparison) -> Value {
    let one = |name: &str, measures: &Measures| {
        let hardest = measures.hardest.iter().map(|&(index, distance)| {
            let seen = &found.effects[index];
            json!({
                "kind": seen.kind.description().kind,
                "component": seen.component,
                "distance": distance,
            })
        });
        let widest = measures
            .widest
            .as_ref()
            .map(|(name, part)| json!({ "parameter": name, "half_width_part": part }));
        json!({
            "experiment": name,
            "hardest": hardest.collect::<Vec<_>>(),
            "mean_distance": measures.mean_distance,
            "widest": widest,
        })
    };
    let chosen = compared.family.map_or("design", Kind::name);
    let families = compared
        .families
        .iter()
        .map(|(kind, found)| one(kind.name(), found));
    json!({
        "chosen": one(chosen, &compared.chosen),
        "families": families.collect::<Vec<_>>(),
        "gain": compared.gain().0,
    })
}

fn revelation(found: &Revelation) -> Value {
    let place = |index: usize| {
        let seen = &found.effects[index];
        json!({ "kind": seen.kind.description().kind, "component": seen.component })
    };
    let effects = found.effects.iter().map(|seen| {
        json!({
            "kind": seen.kind.description().kind,
            "component": seen.component,
            "distance": seen.distance.filter(|distance| distance.is_finite()),
            "verdict": Visibility::of(seen.distance),
        })
    });
    let confusions = found.confusions.iter().map(|confusion| {
        let pair = confusion.pair.map(place);
        json!({ "pair": pair, "cosine": confusion.cosine })
    });
    json!({
        "effects": effects.collect::<Vec<_>>(),
        "confusions": confusions.collect::<Vec<_>>(),
        "parallel_cosine": PARALLEL,
        "imitating_directions": found.directions,
    })
}
