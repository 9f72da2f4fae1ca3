//! Columns under each other's names: two sensors, two inputs, or an input and a sensor, exchanged.

use sinew_sim::Rig;

use super::finding::{Check, number};
use super::refitted::{BELIEVED, FAR_LESS, GOOD, Refit, explains_all_but_noise, is_noise};
use crate::recording::{Column, Recording};

/// `swapped_columns`: the refitted rig explains the recording with two columns exchanged, and not
/// as it is.
pub(super) fn detect(rig: &Rig, recording: &Recording, plain: &Refit) -> Option<Check> {
    if is_noise(rig, recording, plain) {
        return None;
    }
    let sensors = rig.sensors.iter().map(|sensor| sensor.signal.as_str());
    let inputs = rig.actuators.iter().map(|actuator| actuator.input.as_str());
    let (sensors, inputs): (Vec<&str>, Vec<&str>) = (sensors.collect(), inputs.collect());
    let across = inputs.iter();
    let across = across.flat_map(|&input| sensors.iter().map(move |&sensor| [input, sensor]));
    let across: Vec<[&str; 2]> = across.filter(|[input, sensor]| input != sensor).collect();
    let mut pairs = pairs(sensors);
    pairs.extend(self::pairs(inputs));
    let of_a_kind = pairs.len();
    pairs.extend(across);
    pairs.into_iter().enumerate().find_map(|(index, pair)| {
        // An input for a sensor leaves nothing right, and mends all of it.
        let across = index >= of_a_kind;
        if across && plain.error() < GOOD {
            return None;
        }
        let exchanged = exchanged(recording, pair)?;
        let refit = Refit::below(FAR_LESS * plain.squares, rig, &exchanged)?;
        if across && refit.farthest() > BELIEVED {
            return None;
        }
        let explains = plain.error() > GOOD
            && refit.error() < GOOD
            && refit.squares < FAR_LESS * plain.squares
            || explains_all_but_noise(rig, &exchanged, plain, &refit);
        explains.then(|| {
            let [one, other] = pair;
            let sentence = format!(
                "{one} and {other} stand under each other's names: exchanged, the refitted rig \
                 misses {} % of the signals, as it is {} %",
                number(100.0 * refit.error()),
                number(100.0 * plain.error())
            );
            let remedy = "exchange the two names in the header, or in the rig";
            Check::certain(recording, 0, "swapped_columns", sentence, remedy)
        })
    })
}

/// Every two different names of a list.
fn pairs(mut names: Vec<&str>) -> Vec<[&str; 2]> {
    names.sort_unstable();
    names.dedup();
    let mut pairs = Vec::new();
    for (at, one) in names.iter().enumerate() {
        pairs.extend(names[at + 1..].iter().map(|other| [*one, *other]));
    }
    pairs
}

/// The recording with two columns exchanged.
fn exchanged(recording: &Recording, [one, other]: [&str; 2]) -> Option<Recording> {
    let columns = recording.columns().iter().map(|column| {
        let source = match column.name.as_str() {
            name if name == one => other,
            name if name == other => one,
            name => name,
        };
        Some(Column {
            name: column.name.clone(),
            values: recording.column(source)?.to_vec(),
        })
    });
    let columns = columns.collect::<Option<Vec<Column>>>()?;
    Recording::new(recording.path(), recording.t().to_vec(), columns).ok()
}
