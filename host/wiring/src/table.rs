//! The pin table of a wiring, for a terminal.

use crate::board::Board;
use crate::file::Wiring;

/// One line a pin: signal, pin, place on the board.
pub fn table(wiring: &Wiring, board: &Board) -> String {
    let of_sensors = wiring.sensors.iter().map(|w| (w.column.as_str(), w.pins()));
    let of_actuators = wiring
        .actuators
        .iter()
        .map(|w| (w.input.as_str(), w.pins()));
    let rows: Vec<(&str, &str)> = of_sensors
        .chain(of_actuators)
        .flat_map(|(name, pins)| pins.into_iter().map(move |pin| (name, pin)))
        .collect();
    let width = rows.iter().map(|(name, _)| name.chars().count()).max();
    let width = width.unwrap_or(0);
    let line = |(name, pin): &(&str, &str)| {
        let place = board.pin(pin).map_or("", |pin| pin.place);
        format!("{name:width$}  {pin:5}  {place}\n")
    };
    rows.iter().map(line).collect()
}
