//! `sinew-excite/1`: an experiment and what it would reveal, for programs.

use serde_json::{Value, json};

use super::Experiment;
use super::reveal::{PARALLEL, Revelation, Visibility};

/// Format of the document.
pub const FORMAT: &str = "sinew-excite/1";

/// Experiment and revelation as JSON. `inputs` are the columns in the plant's order; `revelation`
/// is null where nothing was measured.
pub fn json(experiment: &Experiment, inputs: &[&str], found: Option<&Revelation>) -> Value {
    let duration_s = experiment.t.last().copied().unwrap_or_default();
    json!({
        "format": FORMAT,
        "rows": experiment.t.len(),
        "duration_s": duration_s,
        "inputs": inputs,
        "revelation": found.map(revelation),
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
