//! Sensors that read more, less or elsewhere than the rig says: an offset, a drift, a gain.

use sinew_sim::Rig;
use sinew_sim::rig::Sensor;
use toml_edit::{DocumentMut, InlineTable, Item};

use super::finding::{Check, number};
use super::refitted::{FAR_LESS, Refit, explains_all_but_noise};
use crate::recording::{Column, Recording};

/// A number of a sensor that a refit may change.
#[derive(Clone, Copy, PartialEq)]
enum Key {
    Offset,
    Gain,
}

impl Key {
    fn name(self) -> &'static str {
        match self {
            Self::Offset => "offset",
            Self::Gain => "gain",
        }
    }
}

/// `sensor_offset`, `sensor_drift` or `sensor_gain`: the refitted rig leaves noise alone with that
/// number of one sensor free, and far more without.
pub(super) fn detect(rig: &Rig, recording: &Recording, plain: &Refit) -> Option<Check> {
    let most = FAR_LESS * plain.squares;
    let explains = |refit: &Refit| explains_all_but_noise(rig, recording, plain, refit);
    let said = |refit: &Refit| {
        format!(
            "the refitted rig misses {} % of the signals, as it is {} %",
            number(100.0 * refit.error()),
            number(100.0 * plain.error())
        )
    };
    for sensor in &rig.sensors {
        let Some(freed) = freed(rig, sensor, Key::Offset) else {
            continue;
        };
        let Some(searched) = Refit::searched(&freed, recording) else {
            continue;
        };
        let whole = || Refit::of(&freed, recording).filter(|refit| explains(refit));
        if let Some(refit) = explains(&searched).then(whole).flatten() {
            let offset = refit.value(&format!("{}.offset", sensor.name))?;
            let sentence = format!(
                "{} is off by {}: with that offset {}; a constant load or the rest of a spring \
                 may look the same",
                sensor.signal,
                number(offset / sensor.column_factor),
                said(&refit)
            );
            let remedy = format!("`offset = {{ value = 0.0 }}` in sensor {}", sensor.name);
            let check = Check::likely(recording, 0, "sensor_offset", sentence, remedy);
            return Some(check);
        }
        let Some(rate) = drift(&searched, sensor, recording) else {
            continue;
        };
        let still = without_drift(recording, &sensor.signal, rate)?;
        if let Some(refit) = Refit::below(most, &freed, &still).filter(|refit| explains(refit)) {
            let sentence = format!(
                "{} drifts by {} a second: without that {}",
                sensor.signal,
                number(rate),
                said(&refit)
            );
            let remedy = "let the sensor warm up, or take the drift out of the column";
            return Some(Check::likely(
                recording,
                0,
                "sensor_drift",
                sentence,
                remedy,
            ));
        }
    }
    if rig.sensors.len() < 2 {
        return None;
    }
    rig.sensors.iter().find_map(|sensor| {
        let refit = Refit::below(most, &freed(rig, sensor, Key::Gain)?, recording)?;
        explains(&refit).then_some(())?;
        let gain = refit.value(&format!("{}.gain", sensor.name))?;
        let sentence = format!(
            "{} reads {} times what the rig says, or another sensor reads less or more: with that \
             gain {}",
            sensor.signal,
            number(gain / sensor.gain.value),
            said(&refit)
        );
        let remedy = format!(
            "`gain = {{ value = {} }}` in sensor {}, or in another",
            number(gain),
            sensor.name
        );
        Some(Check::likely(recording, 0, "sensor_gain", sentence, remedy))
    })
}

/// The rig with a number of a sensor free; `None` where it is free already or is no bare number.
fn freed(rig: &Rig, sensor: &Sensor, key: Key) -> Option<Rig> {
    let known = match key {
        Key::Offset => &sensor.offset,
        Key::Gain => &sensor.gain,
    };
    if known.free || known.with.is_some() || known.per_recording {
        return None;
    }
    let mut document: DocumentMut = rig.to_toml().parse().ok()?;
    let sensors = document.get_mut("sensor")?.as_array_of_tables_mut()?;
    let named = |table: &&mut toml_edit::Table| {
        table.get("name").and_then(Item::as_str) == Some(sensor.name.as_str())
    };
    let table = sensors.iter_mut().find(named)?;
    let mut free = InlineTable::new();
    free.insert("value", known.value.into());
    table.insert(key.name(), toml_edit::value(free));
    Rig::parse(&document.to_string(), "freed.toml").ok()
}

/// Slope of what a refit misses of a sensor, in the column's unit a second.
fn drift(refit: &Refit, sensor: &Sensor, recording: &Recording) -> Option<f64> {
    let run = refit.fit.runs.first()?;
    let signal = run.sensors.iter().find(|it| it.signal == sensor.signal)?;
    let begin = recording.t()[0];
    let missed = (run.judged_from..run.t.len())
        .map(|row| {
            (
                run.t[row] - begin,
                signal.measured[row] - signal.simulated[row],
            )
        })
        .filter(|(_, error)| error.is_finite());
    let missed: Vec<(f64, f64)> = missed.collect();
    let count = missed.len().max(1) as f64;
    let middle = missed.iter().map(|it| it.0).sum::<f64>() / count;
    let (along, square) = missed
        .iter()
        .fold((0.0, 0.0), |(along, square), (t, error)| {
            let from = t - middle;
            (along + from * error, square + from * from)
        });
    let rate = along / square / sensor.column_factor;
    (rate.is_finite() && rate != 0.0).then_some(rate)
}

/// The recording with a steady drift taken out of a column.
fn without_drift(recording: &Recording, name: &str, rate: f64) -> Option<Recording> {
    let begin = recording.t()[0];
    let columns = recording.columns().iter().map(|column| {
        let mut values = column.values.clone();
        if column.name == name {
            for (value, t) in values.iter_mut().zip(recording.t()) {
                *value -= rate * (t - begin);
            }
        }
        Column {
            name: column.name.clone(),
            values,
        }
    });
    Recording::new(recording.path(), recording.t().to_vec(), columns.collect()).ok()
}
