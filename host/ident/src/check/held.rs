//! Inputs that were not held between rows as the rig says.

use sinew_sim::rig::Hold;
use sinew_sim::{Plant, Rig};
use toml_edit::{DocumentMut, value};

use super::finding::{Check, number};
use super::refitted::{FAR_LESS, Refit, explains_all_but_noise, is_noise};
use crate::recording::Recording;

/// `input_not_held`: with inputs that run straight from row to row the rig leaves noise alone, and
/// with inputs that step far more; or the other way round.
pub(super) fn detect(rig: &Rig, recording: &Recording, plain: &Refit) -> Option<Check> {
    if is_noise(rig, recording, plain) {
        return None;
    }
    let first = rig.actuators.first()?.hold;
    let (other, key, runs, as_written) = match first {
        Hold::Zero => (
            Hold::Linear,
            "linear",
            "run straight from row to row",
            "step",
        ),
        Hold::Linear => (Hold::Zero, "zero", "step from row to row", "run straight"),
    };
    if rig.actuators.iter().any(|it| it.hold == other) {
        return None;
    }
    // A few steps from the fitted rig tell most of it.
    let near = Refit::from_near(&held(&plain.fit.rig, key)?, recording)?;
    if near.squares > FAR_LESS * plain.squares {
        return None;
    }
    let turned = held(rig, key)?;
    let refit = Refit::searched(&turned, recording)?;
    explains_all_but_noise(&turned, recording, plain, &refit).then(|| {
        let inputs: Vec<&str> = rig.actuators.iter().map(|it| it.input.as_str()).collect();
        let inputs = inputs.join(" and ");
        let sentence = format!(
            "{inputs} {runs}: so the refitted rig misses {} % of the signals; where they \
             {as_written}, as the rig says, {} %",
            number(100.0 * refit.error()),
            number(100.0 * plain.error())
        );
        let remedy = format!("`hold = \"{key}\"` in the rig's actuators");
        Check::likely(recording, 0, "input_not_held", sentence, remedy)
    })
}

/// The rig with all inputs held in this way.
fn held(rig: &Rig, key: &str) -> Option<Rig> {
    let mut document: DocumentMut = rig.to_toml().parse().ok()?;
    let actuators = document.get_mut("actuator")?.as_array_of_tables_mut()?;
    for table in actuators.iter_mut() {
        table.insert("hold", value(key));
    }
    let rig = Rig::parse(&document.to_string(), "held.toml").ok()?;
    Plant::new(&rig).is_ok().then_some(rig)
}
