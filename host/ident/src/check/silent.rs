//! A sensor that falls silent within a recording: a cable that breaks leaves its noise.

use std::ops::Range;

use sinew_sim::{Plant, Rig};

use super::dead::{AGREES, MOVES, QUIET};
use super::finding::{Check, number};
use super::motion::{from_rest, spread};
use crate::noise::noise_alone;
use crate::recording::Recording;

/// Parts of a recording by which the silent end is searched.
const PARTS: usize = 10;

/// Fewest of them: a device may rest at the end of an experiment.
const FEWEST: usize = 2;

/// Smallest spread of some input over the silent end, beside that before it: less may be what holds
/// the sensor's body still.
const DRIVEN: f64 = 0.7;

/// `dead_channel` of one of several sensors that shows noise alone to the end of the recording,
/// where the rig as written moves it as far as another that reads the same unit and moves as
/// recorded. Friction and stops may hold a body too, so it is never certain.
pub(super) fn detect(rig: &Rig, recording: &Recording) -> Option<Check> {
    let values = |sensor: usize| recording.column(&rig.sensors[sensor].signal);
    let silent: Vec<(usize, Range<usize>)> = (0..rig.sensors.len())
        .filter_map(|sensor| Some((sensor, silent_end(recording, values(sensor)?)?)))
        .collect();
    if silent.is_empty() || silent.len() == rig.sensors.len() {
        return None;
    }
    let plant = Plant::new(rig).ok()?;
    let run = from_rest(&plant, recording)?;
    silent.into_iter().find_map(|(sensor, rows)| {
        let unit = |sensor: usize| sinew_sim::unit::of_column(&rig.sensors[sensor].signal);
        let moved = |sensor: usize| {
            spread(&run.column(sensor)[rows.clone()]) / rig.sensors[sensor].column_factor
        };
        let others = (0..rig.sensors.len()).filter(|&other| other != sensor);
        let neighbours = others.filter_map(|other| {
            let (said, shown) = (moved(other), spread(values(other)?.get(rows.clone())?));
            let agrees = said < AGREES * shown && shown < AGREES * said;
            (agrees && unit(other) == unit(sensor)).then_some(shown)
        });
        let neighbour = neighbours.reduce(f64::max)?;
        let noise = spread(&values(sensor)?[rows.clone()]);
        let falls_silent = moved(sensor) > MOVES * neighbour
            && noise < QUIET * moved(sensor)
            && is_driven(&plant, recording, &rows);
        falls_silent.then(|| {
            let name = &rig.sensors[sensor].signal;
            let sentence = format!(
                "{name} shows no motion from t = {} s to the end, where the rig as it is written \
                 moves it by {} {} (standard deviation) and other sensors move on",
                number(recording.t()[rows.start]),
                number(moved(sensor)),
                unit(sensor)
            );
            let remedy = "check the sensor and its cable; leave these fields empty";
            Check::likely(recording, rows.start, "dead_channel", sentence, remedy)
        })
    })
}

/// The longest end, in tenths of the recording, over which a sensor that moved before shows noise
/// alone.
fn silent_end(recording: &Recording, values: &[f64]) -> Option<Range<usize>> {
    let from = |parts: usize| values.len() * (PARTS - parts) / PARTS..values.len();
    let silent = |parts: &usize| {
        let rows = from(*parts);
        noise_alone(&recording.t()[rows.clone()], &values[rows]).is_some()
    };
    let longest = (FEWEST..=PARTS).take_while(silent).last()?;
    (longest < PARTS).then(|| from(longest))
}

/// Tells whether some input moves on over these last rows as it did before them.
fn is_driven(plant: &Plant, recording: &Recording, rows: &Range<usize>) -> bool {
    plant.inputs().iter().any(|input| {
        let Ok(column) = recording.input(input) else {
            return false;
        };
        let (before, within) = column.values.split_at(rows.start);
        spread(within) > DRIVEN * spread(before)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Column;

    const CART: &str = "format = \"sinew-rig/1\"\nname = \"cart\"\n[[body]]\nname = \"cart\"\n\
        motion = \"slide\"\ninertia = 1.0\n[[actuator]]\nname = \"push\"\ndrives = \"cart\"\n\
        input = \"u_N\"\ngain = 1.0\n[[sensor]]\nname = \"ruler\"\nreads = \"cart.position\"\n\
        signal = \"q_m\"\n";

    #[test]
    fn a_drive_that_weakens_in_the_silent_rows_is_no_drive() {
        let plant = Plant::new(&Rig::parse(CART, "cart.toml").unwrap()).unwrap();
        let rows = 0..200_u32;
        let recorded = |later: f64| {
            let push = |k: u32| f64::from(k).sin() * if k < 100 { 1.0 } else { later };
            let column = |name: &str, values| Column {
                name: name.to_owned(),
                values,
            };
            let t = rows.clone().map(|k| 0.01 * f64::from(k)).collect();
            let columns = vec![
                column("u_N", rows.clone().map(push).collect()),
                column("q_m", vec![0.0; 200]),
            ];
            Recording::new("cart.csv", t, columns).unwrap()
        };
        assert!(is_driven(&plant, &recorded(1.0), &(100..200)));
        assert!(!is_driven(&plant, &recorded(0.1), &(100..200)));
    }
}
