//! Sentences about parameters of which each recording has a value of its own (`per`).

use sinew_sim::{Plant, Rig};

use super::quantity;
use crate::fit::{FittedParameter, OwnValue};

/// Line of a verb that works without recordings to estimate from: it takes the shared values;
/// `None` where the rig has no parameter that differs by recording.
pub fn shared_values(rig: &Rig) -> Option<String> {
    let plant = Plant::new(rig).ok()?;
    let own = plant.parameters().iter().filter(|p| p.per_recording);
    let own: Vec<String> = own
        .map(|p| format!("`{}` = {}", p.name, quantity(p.value, &p.unit)))
        .collect();
    let list = own.join(", ");
    (!own.is_empty()).then(|| format!("differing by recording, here at `value`: {list}"))
}

/// Interval of an own value, or why there is none.
pub fn own_interval(own: &OwnValue) -> String {
    match own.ci95 {
        Some([low, high]) => {
            format!(
                "{} to {}",
                quantity(low, &own.unit),
                quantity(high, &own.unit)
            )
        }
        None if own.at_bound => "at its bound".into(),
        None => "not determined by this recording".into(),
    }
}

/// An own value with its interval: `0.12 N (0.11 N to 0.13 N)`.
pub fn own_value(own: &OwnValue) -> String {
    let value = quantity(own.value, &own.unit);
    format!("{value} ({})", own_interval(own))
}

/// Note about parameters that differ by recording where there is only one; `None` without any.
pub(super) fn only_one(parameters: &[FittedParameter]) -> Option<String> {
    let alone = parameters.iter().filter(|p| p.recordings.len() == 1);
    let names: Vec<String> = alone.map(|p| format!("`{}`", p.name)).collect();
    let list = names.join(", ");
    (!names.is_empty()).then(|| {
        format!("{list} may differ by recording, and there is only one: `per` changes nothing")
    })
}
