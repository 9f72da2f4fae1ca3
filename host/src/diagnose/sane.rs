//! Whether fitted parameters can be what they claim to be.

use sinew_sim::effects::Sign;

use super::data::Data;
use super::evidence::Contender;
use super::suspect::Suspect;

/// Signs as the vocabulary has them, and every effect felt somewhere in the data.
pub(super) fn sane(contender: &Contender, _data: &Data) -> bool {
    let model = &contender.tried.model;
    contender
        .tried
        .suspects
        .iter()
        .filter(|suspect| matches!(suspect, Suspect::Effect { .. }))
        .flat_map(Suspect::trial)
        .all(|(name, sign)| {
            let Some(slot) = model.plant.slot(&name) else {
                return false;
            };
            let value = contender.tried.point.values[slot];
            match sign {
                Sign::NonNegative => value >= 0.0,
                Sign::Positive => value > 0.0,
                Sign::Any | Sign::NonZero | Sign::Side => true,
            }
        })
}
